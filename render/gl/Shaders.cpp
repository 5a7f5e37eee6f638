#include "Shaders.h"

namespace simflex {
namespace shaders {

const char* const version330 = "#version 330 core\n";
const char* const version430 =
    "#version 430 core\n#extension GL_ARB_post_depth_coverage : require\n";

std::string compose(std::initializer_list<const char*> parts) {
    std::string source;
    for (const char* part : parts) source += part;
    return source;
}

const char* const lighting = R"(
uniform vec3 up;                // of the ground
uniform vec3 keyDirection;      // towards the main light
uniform vec3 viewDirection;     // towards the viewer where perspective is off
uniform bool isPerspective;

vec3 calcViewDirection(vec3 place) {
    return isPerspective ? normalize(-place) : viewDirection;
}

// What falls on a surface, as (diffuse, gloss): it shines with base * diffuse + gloss.
vec4 calcLight(vec3 n, vec3 v) {
    float sky = 0.5 + 0.5 * dot(n, up);
    vec3 ambient = mix(vec3(0.20, 0.19, 0.18), vec3(0.46, 0.49, 0.54), sky);
    float key = max(dot(n, keyDirection), 0.0);
    float fill = max(dot(n, normalize(vec3(-0.75, 0.15, 0.65))), 0.0);
    float head = max(n.z, 0.0);
    vec3 diffuse = ambient + key * vec3(0.72, 0.70, 0.66) + fill * vec3(0.10, 0.12, 0.15) + 0.12 * head;

    vec3 h = normalize(keyDirection + v);
    float shine = max(dot(n, h), 0.0);
    shine *= shine;
    shine *= shine;
    shine *= shine;
    shine *= shine;
    float highlight = shine * shine * shine * 0.22 * step(0.0, dot(n, keyDirection));  // its 48th power
    float away = 1.0 - max(dot(n, v), 0.0);
    float sheen = away * away * away * away * 0.10 * sky;
    return vec4(diffuse, highlight + sheen);
}
)";

const char* const baseColor = R"(
uniform vec3 color;
uniform bool isContour;
uniform vec2 contourRange;      // low end, 1 / (high - low)
uniform sampler2D colorMap;
const float colors = 256.0;

vec3 calcBase(float value) {
    if (!isContour) return color;
    // Not a number: no value there. Asked in integers, which no compiler optimizes away.
    if ((floatBitsToUint(value) & 0x7fffffffu) > 0x7f000000u) return vec3(0.62);
    float f = clamp((value - contourRange.x) * contourRange.y, 0.0, 1.0);
    return texture(colorMap, vec2((0.5 + f * (colors - 1.0)) / colors, 0.5)).rgb;
}
)";

const char* const surfaceVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float value;
uniform mat4 modelView;
uniform mat4 projection;
uniform mat3 normalMatrix;
uniform vec2 shift;             // along the view ray: factor, and offset in z
out vec3 viewPosition;
out vec3 viewNormal;
out float contourValue;
invariant gl_Position;

void main() {
    vec4 p = modelView * vec4(position, 1.0);
    viewPosition = p.xyz;
    viewNormal = normalMatrix * normal;
    contourValue = value;
    gl_Position = projection * vec4(p.xyz * shift.x + vec3(0.0, 0.0, shift.y), 1.0);
}
)";

// Colours are squared on input and square-rooted on output: light is added in linear space, and
// unlit colours are unchanged. All vectors are in the camera frame.
const char* const surfaceShade = R"(
in vec3 viewPosition;
in vec3 viewNormal;
in float contourValue;
uniform float opacity;
uniform bool isGhost;
uniform bool isLit;

vec4 calcShade() {
    vec3 base = calcBase(contourValue);
    if (!isLit) return vec4(base, opacity);

    vec3 n = normalize(viewNormal);
    if (!gl_FrontFacing) n = -n;
    vec3 v = calcViewDirection(viewPosition);
    if (isGhost) {
        float facing = max(dot(n, v), 0.0);
        float rim = 1.0 - facing;
        return vec4(color * (0.75 + 0.25 * facing),
                    min(opacity * (0.45 + 1.6 * rim * rim), 1.0));
    }
    vec4 light = calcLight(n, v);
    return vec4(sqrt(base * base * light.rgb + light.a), opacity);
}
)";

const char* const surfaceFragment = R"(
uniform bool isPremultiplied;   // the colour leaves times its alpha
out vec4 fragment;

void main() {
    fragment = calcShade();
    if (isPremultiplied) fragment.rgb = min(fragment.rgb, 1.0) * fragment.a;
}
)";

// A fragment stores the index of the next one in its list (from 1, 0 after the last); its kind: the
// samples it covers (4 bits), whether it is a ghost's (1 bit), its rank; its colour; and its depth
// at the pixel's centre. Depth is linear across a triangle: slopes are per pixel.
const char* const fragmentLists = R"(
layout(std430, binding = 0) buffer Lists {
    uint number;                // of fragments
    uint starts[];              // of the list of each pixel
};
uniform ivec4 area;             // the pixels that have lists: left, bottom, right, top
const uint allSamples = 15u, ghostBit = 16u;

// Scissors of a multisampled picture let samples of pixels through that are outside.
bool isInside(ivec2 p) {
    return all(greaterThanEqual(p, area.xy)) && all(lessThan(p, area.zw));
}

int findList(ivec2 p) {
    return (p.y - area.y) * (area.z - area.x) + p.x - area.x;
}
)";

const char* const appendFragment = R"(
layout(early_fragment_tests) in;
layout(post_depth_coverage) in;
layout(std430, binding = 1) buffer Fragments {
    uvec4 fragments[];
};
layout(std430, binding = 2) buffer Slopes {
    vec2 slopes[];
};
uniform int capacity;
uniform int rank;

void main() {
    vec2 slope = vec2(dFdx(gl_FragCoord.z), dFdy(gl_FragCoord.z));
    uint samples = uint(gl_SampleMaskIn[0]) & allSamples;
    vec4 shade = calcShade();
    ivec2 p = ivec2(gl_FragCoord.xy);
    if (samples == 0u || !isInside(p)) return;
    uint place = atomicAdd(number, 1u);
    if (place >= uint(capacity)) return;
    uint next = atomicExchange(starts[findList(p)], place + 1u);
    uint kind = uint(rank) << 5 | (isGhost ? ghostBit : 0u) | samples;
    fragments[place] =
        uvec4(next, kind, packUnorm4x8(shade), floatBitsToUint(gl_FragCoord.z));
    slopes[place] = slope;
}
)";

// Visits the fragments of a list in order, a few at a time; they are kept in registers, which
// requires unrolled loops.
const char* const sortFragments = R"(
#define FOR_EACH(Do) Do(0) Do(1) Do(2) Do(3)
uniform usamplerBuffer listTexels, fragmentTexels;
uniform samplerBuffer slopeTexels;
out vec4 fragment;
const int most = 32, few = 4;
float depths[few];              // ascending; of the same depth, the lower kind is before
uint kinds[few], places[few], colors[few];   // place 0: no more
int left;                       // so many are behind the last one, these included
uint coverage;                  // samples that all fragments of the list cover
float lastDepth = -1e9;
uint lastKind = 0u, lastPlace = 0u;

uint findStart(ivec2 p) {
    return isInside(p) ? texelFetch(listTexels, 1 + findList(p)).r : 0u;
}

vec2 findSlope(uint place) {
    return texelFetch(slopeTexels, int(place) - 1).rg;
}

bool isBefore(float depth, uint kind, uint place, float depth2, uint kind2, uint place2) {
    return depth < depth2 ||
           (depth == depth2 && (kind < kind2 || (kind == kind2 && place < place2)));
}

// Those that cover one of some samples, at an offset from the middle of the pixel.
void findNext(uint place, uint samples, vec2 offset) {
#define CLEAR(i) \
    depths[i] = 1e9; \
    kinds[i] = 0u; \
    places[i] = 0u; \
    colors[i] = 0u;
    FOR_EACH(CLEAR)
    left = 0;
    coverage = allSamples;
    while (place != 0u) {
        uvec4 f = texelFetch(fragmentTexels, int(place) - 1);
        float depth = uintBitsToFloat(f.w);
        if (offset != vec2(0.0)) depth += dot(findSlope(place), offset);
        if ((f.y & samples) != 0u &&
            isBefore(lastDepth, lastKind, lastPlace, depth, f.y, place)) {
            ++left;
            uint kind = f.y, p = place, color = f.z;
            bool isNearer;
            float d;
            uint k, q, c;
#define INSERT(i) \
    isNearer = isBefore(depth, kind, p, depths[i], kinds[i], places[i]); \
    d = depths[i]; \
    k = kinds[i]; \
    q = places[i]; \
    c = colors[i]; \
    depths[i] = isNearer ? depth : d; \
    kinds[i] = isNearer ? kind : k; \
    places[i] = isNearer ? p : q; \
    colors[i] = isNearer ? color : c; \
    depth = isNearer ? d : depth; \
    kind = isNearer ? k : kind; \
    p = isNearer ? q : p; \
    color = isNearer ? c : color;
            FOR_EACH(INSERT)
        }
        coverage &= f.y;
        place = f.x;
    }
    lastDepth = depths[few - 1];
    lastKind = kinds[few - 1];
    lastPlace = places[few - 1];
}

vec4 sum = vec4(0.0);
bool hasGhost = false;

// Of ghosts, only the nearest shows.
void lay(uint kind, uint color) {
    bool isGhost = (kind & ghostBit) != 0u;
    if (!(isGhost && hasGhost)) {
        vec4 c = unpackUnorm4x8(color);
        sum += (1.0 - sum.a) * c.a * vec4(c.rgb, 1.0);
    }
    hasGhost = hasGhost || isGhost;
}

void layAll() {
#define LAY(i) lay(kinds[i], colors[i]);
    FOR_EACH(LAY)
}
)";

// Runs per pixel; ends the lists of pixels whose samples are all alike.
const char* const layPixels = R"(
bool isAlike;
float depthBefore = -1e9;
vec2 slopeBefore = vec2(0.0);

// Whether it is behind the one before at each sample.
void check(float depth, uint place) {
    if (place == 0u) return;
    vec2 slope = findSlope(place), change = abs(slope - slopeBefore);
    isAlike = isAlike && depth - depthBefore >= 0.5 * (change.x + change.y);
    depthBefore = depth;
    slopeBefore = slope;
}

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    uint start = findStart(p);
    isAlike = start != 0u && (uint(gl_SampleMaskIn[0]) & allSamples) == allSamples;
    for (int number = 0; number < most && isAlike; number += few) {
        findNext(start, allSamples, vec2(0.0));
        isAlike = coverage == allSamples;
#define CHECK(i) check(depths[i], places[i]);
        FOR_EACH(CHECK)
        layAll();
        if (left <= few) break;
    }
    if (isAlike) {
        starts[findList(p)] = 0u;
        fragment = sum;
    } else {
        discard;
    }
}
)";

// Runs per sample.
const char* const laySamples = R"(
void main() {
    uint start = findStart(ivec2(gl_FragCoord.xy));
    if (start == 0u) discard;
    for (int number = 0; number < most; number += few) {
        findNext(start, 1u << gl_SampleID, gl_SamplePosition - 0.5);
        layAll();
        if (left <= few) break;
    }
    fragment = sum;
}
)";

const char* const fineSurfaceVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float value;
uniform mat4 modelView;
uniform mat4 projection;
uniform mat3 normalMatrix;
out vec4 light;
out float contourValue;
invariant gl_Position;

void main() {
    vec4 p = modelView * vec4(position, 1.0);
    light = calcLight(normalize(normalMatrix * normal), calcViewDirection(p.xyz));
    contourValue = value;
    gl_Position = projection * p;
}
)";

const char* const fineSurfaceFragment = R"(
in vec4 light;
in float contourValue;
uniform float opacity;
out vec4 fragment;

void main() {
    vec3 base = calcBase(contourValue);
    fragment = vec4(sqrt(base * base * light.rgb + light.a), opacity);
}
)";

// Moves edges forward by the depth difference of the surface across the line's width.
const char* const edgeVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
uniform mat4 modelView;
uniform mat4 projection;
uniform mat3 normalMatrix;
uniform vec2 pixel;             // size at distance 1, and at any distance
uniform float width;            // [pixel]

void main() {
    vec3 p = (modelView * vec4(position, 1.0)).xyz;
    vec3 v = pixel.x > 0.0 ? normalize(-p) : vec3(0.0, 0.0, 1.0);
    float facing = abs(dot(normalize(normalMatrix * normal), v));
    float slope = min(sqrt(max(1.0 - facing * facing, 0.0)) / max(facing, 1e-3), 8.0);
    float forward = 0.3 + 0.8 * slope * width;
    p = p * (1.0 - forward * pixel.x) + vec3(0.0, 0.0, forward * pixel.y);
    gl_Position = projection * vec4(p, 1.0);
}
)";

const char* const edgeFragment = R"(#version 330 core
uniform vec3 color;
uniform float opacity;
out vec4 fragment;

void main() {
    fragment = vec4(color, opacity);
}
)";

// A line is a rectangle of four vertices around its two end points, given in the camera frame.
const char* const lineVertex = R"(#version 330 core
layout(location = 0) in vec3 start;
layout(location = 1) in vec3 end;
layout(location = 2) in vec4 lineColor;
layout(location = 3) in float width;
uniform mat4 projection;
uniform vec2 viewport;
uniform vec2 shift;             // along the view ray: factor, and offset in z
out vec4 vertexColor;

void main() {
    vec4 a = projection * vec4(start * shift.x + vec3(0.0, 0.0, shift.y), 1.0);
    vec4 b = projection * vec4(end * shift.x + vec3(0.0, 0.0, shift.y), 1.0);
    vec2 direction = (b.xy / b.w - a.xy / a.w) * viewport;
    float size = length(direction);
    direction = size > 0.0 ? direction / size : vec2(1.0, 0.0);
    vec2 across = vec2(-direction.y, direction.x);
    bool isEnd = (gl_VertexID & 1) == 1;
    float side = (gl_VertexID & 2) == 2 ? 1.0 : -1.0;
    vec4 p = isEnd ? b : a;
    vec2 offset = (across * side + direction * (isEnd ? 0.5 : -0.5)) * width / viewport;
    gl_Position = vec4(p.xy + offset * p.w, p.z, p.w);
    vertexColor = lineColor;
}
)";

const char* const pointVertex = R"(#version 330 core
layout(location = 0) in vec3 center;
layout(location = 1) in vec4 pointColor;
layout(location = 2) in float diameter;
uniform mat4 projection;
uniform vec2 viewport;
uniform vec2 shift;             // along the view ray: factor, and offset in z
out vec4 vertexColor;
out vec2 local;
out float radius;

void main() {
    local = vec2((gl_VertexID & 1) == 1 ? 1.0 : -1.0, (gl_VertexID & 2) == 2 ? 1.0 : -1.0);
    radius = 0.5 * diameter;
    local *= radius + 1.0;
    vec4 p = projection * vec4(center * shift.x + vec3(0.0, 0.0, shift.y), 1.0);
    gl_Position = vec4(p.xy + 2.0 * local / viewport * p.w, p.z, p.w);
    vertexColor = pointColor;
}
)";

const char* const pointFragment = R"(#version 330 core
in vec4 vertexColor;
in vec2 local;
in float radius;
out vec4 fragment;

void main() {
    float inside = clamp(radius + 0.5 - length(local), 0.0, 1.0);
    if (inside <= 0.0) discard;
    fragment = vec4(vertexColor.rgb, vertexColor.a * inside);
}
)";

const char* const colorFragment = R"(#version 330 core
in vec4 vertexColor;
out vec4 fragment;

void main() {
    fragment = vertexColor;
}
)";

const char* const backgroundVertex = R"(#version 330 core
out vec2 place;

void main() {
    place = vec2((gl_VertexID & 1) == 1 ? 2.0 : 0.0, (gl_VertexID & 2) == 2 ? 2.0 : 0.0);
    gl_Position = vec4(2.0 * place - 1.0, 0.0, 1.0);
}
)";

const char* const backgroundFragment = R"(#version 330 core
in vec2 place;
uniform vec3 topColor;
uniform vec3 bottomColor;
uniform vec2 band;              // first row that is drawn, height of the whole picture [pixel]
out vec4 fragment;

// Half a level of ordered noise hides the steps of the gradient.
void main() {
    vec2 pixel = gl_FragCoord.xy + vec2(0.0, band.x);
    float noise = fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
    vec3 shade = mix(bottomColor, topColor, smoothstep(0.0, 1.0, pixel.y / band.y));
    float amplitude = topColor == bottomColor ? 0.0 : 1.0 / 255.0;
    fragment = vec4(shade + (noise - 0.5) * amplitude, 1.0);
}
)";

const char* const layerFragment = R"(#version 330 core
in vec2 place;
uniform sampler2DMS layer;
out vec4 fragment;

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    fragment = 0.25 * (texelFetch(layer, p, 0) + texelFetch(layer, p, 1) +
                       texelFetch(layer, p, 2) + texelFetch(layer, p, 3));
}
)";

const char* const depthOnlyFragment = R"(#version 330 core
in vec3 viewPosition;
in vec3 viewNormal;
in float contourValue;

void main() {}
)";

// Rejects fragments of earlier layers. Runs per sample, so that each sample has its own layers.
const char* const peelFragment = R"(#version 330 core
#extension GL_ARB_sample_shading : require
in vec3 viewPosition;
in vec3 viewNormal;
in float contourValue;
uniform sampler2DMS scene;      // depth of what is opaque
uniform sampler2DMS previous;   // depth of the layer before
uniform sampler2DMS ghosts;     // depth of the nearest ghost
uniform bool isFirst;
uniform bool isGhost;

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    float z = gl_FragCoord.z;
    if (z >= texelFetch(scene, p, gl_SampleID).r) discard;
    if (!isFirst && z <= texelFetch(previous, p, gl_SampleID).r) discard;
    if (isGhost && z > texelFetch(ghosts, p, gl_SampleID).r) discard;
}
)";

const char* const sampleFragment = R"(#version 330 core
#extension GL_ARB_sample_shading : require
in vec2 place;
uniform sampler2DMS layer;
out vec4 fragment;

void main() {
    fragment = texelFetch(layer, ivec2(gl_FragCoord.xy), gl_SampleID);
}
)";

// Depth at the centre of a pixel covered by one surface; otherwise the nearest depth.
const char* const depthFragment = R"(#version 330 core
in vec2 place;
uniform sampler2DMS scene;
out vec4 fragment;

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    vec4 z = vec4(texelFetch(scene, p, 0).r, texelFetch(scene, p, 1).r,
                  texelFetch(scene, p, 2).r, texelFetch(scene, p, 3).r);
    float nearest = min(min(z.x, z.y), min(z.z, z.w));
    float farthest = max(max(z.x, z.y), max(z.z, z.w));
    fragment = vec4(farthest < 1.0 ? 0.25 * (z.x + z.y + z.z + z.w) : nearest);
}
)";

// Distances along the view direction at half resolution; 0: no surface.
const char* const distanceFragment = R"(#version 330 core
in vec2 place;
uniform sampler2DMS scene;      // depth
uniform vec2 depthTerms;        // of the projection: what multiplies z, and what is added
uniform bool isPerspective;
out vec4 fragment;

void main() {
    float z = texelFetch(scene, 2 * ivec2(gl_FragCoord.xy), 0).r;
    float clip = 2.0 * z - 1.0;
    float distance = isPerspective ? depthTerms.y / (clip + depthTerms.x)
                                   : (depthTerms.y - clip) / depthTerms.x;
    fragment = vec4(z >= 1.0 ? 0.0 : distance);
}
)";

const char* const occlusionFragment = R"(#version 330 core
in vec2 place;
uniform sampler2D distances;
uniform bool isPerspective;
uniform vec4 ray;               // camera x, y of a pixel at distance 1: factors, offsets
uniform float radius;           // [m]
uniform float pixelsPerMetre;   // at distance 1, or at any in a parallel projection
out vec4 fragment;

const int count = 16;

vec3 findPoint(ivec2 p) {
    ivec2 size = textureSize(distances, 0);
    p = clamp(p, ivec2(0), size - 1);
    float d = texelFetch(distances, p, 0).r;
    vec2 xy = (2.0 * (vec2(p) + 0.25) / vec2(size) - 1.0) * ray.xy + ray.zw;
    return vec3(isPerspective ? xy * d : xy, -d);
}

// Of two neighbours the one on the same surface.
vec3 findTangent(vec3 middle, ivec2 p, ivec2 step) {
    vec3 after = findPoint(p + step), before = findPoint(p - step);
    return abs(after.z - middle.z) < abs(middle.z - before.z) ? after - middle : middle - before;
}

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    vec3 middle = findPoint(p);
    float reach = radius * pixelsPerMetre / (isPerspective ? -middle.z : 1.0);
    if (middle.z == 0.0 || reach < 1.5) {
        fragment = vec4(1.0);
        return;
    }
    reach = min(reach, 96.0);
    vec3 n = normalize(cross(findTangent(middle, p, ivec2(1, 0)),
                             findTangent(middle, p, ivec2(0, 1))));
    float turn = 6.2831853 * fract(52.9829189 * fract(dot(vec2(p), vec2(0.06711056, 0.00583715))));
    float sum = 0.0;
    for (int i = 0; i < count; ++i) {
        float part = (float(i) + 0.5) / float(count);
        float angle = turn + 43.982297 * part;
        vec3 other = findPoint(p + ivec2(round(part * reach * vec2(cos(angle), sin(angle)))));
        if (other.z == 0.0) continue;
        vec3 v = (other - middle) / radius;
        float near = max(1.0 - dot(v, v), 0.0);
        sum += near * near * near * max(dot(v, n) - 0.02, 0.0) / (dot(v, v) + 0.01);
    }
    fragment = vec4(max(1.0 - 1.6 * sum / float(count), 0.0));
}
)";

// Mean of seven neighbours in a row, restricted to the same surface.
const char* const occlusionBlurFragment = R"(#version 330 core
in vec2 place;
uniform sampler2D distances;
uniform sampler2D light;
uniform vec2 along;
uniform float radius;
out vec4 fragment;

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy), last = textureSize(distances, 0) - 1;
    float middle = texelFetch(distances, p, 0).r, sum = 0.0, weights = 0.0;
    for (int i = -3; i <= 3; ++i) {
        ivec2 q = clamp(p + i * ivec2(along), ivec2(0), last);
        float away = abs(texelFetch(distances, q, 0).r - middle) / radius;
        float weight = max(1.0 - 4.0 * away, 0.0);
        sum += weight * texelFetch(light, q, 0).r;
        weights += weight;
    }
    fragment = vec4(sum / weights);
}
)";

// Light at full resolution, from surrounding pixels on the same surface.
const char* const darkenFragment = R"(#version 330 core
in vec2 place;
uniform sampler2DMS scene;      // depth
uniform sampler2D distances;
uniform sampler2D light;
uniform vec2 depthTerms;
uniform bool isPerspective;
uniform float radius;
out vec4 fragment;

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy), last = textureSize(distances, 0) - 1;
    float z = texelFetch(scene, p, 0).r;
    if (z >= 1.0) discard;
    float clip = 2.0 * z - 1.0;
    float distance = isPerspective ? depthTerms.y / (clip + depthTerms.x)
                                   : (depthTerms.y - clip) / depthTerms.x;
    vec2 between = 0.5 * vec2(p & 1);
    float sum = 1e-4, weights = 1e-4;
    for (int k = 0; k < 4; ++k) {
        ivec2 offset = ivec2(k & 1, k >> 1);
        ivec2 q = min(p / 2 + offset, last);
        vec2 share = mix(1.0 - between, between, vec2(offset));
        float away = abs(texelFetch(distances, q, 0).r - distance) / radius;
        float weight = share.x * share.y * max(1.0 - 4.0 * away, 0.0);
        sum += weight * texelFetch(light, q, 0).r;
        weights += weight;
    }
    fragment = vec4(sqrt(sum / weights));   // colours are roots of light
}
)";

const char* const groundVertex = R"(#version 330 core
layout(location = 0) in vec2 corner;
uniform mat4 modelView;
uniform mat4 projection;
uniform vec2 middle;            // of the rectangle to draw, on the ground
uniform vec2 halfWidth;
out vec2 place;

void main() {
    place = middle + corner * halfWidth;
    gl_Position = projection * modelView * vec4(place, 0.0, 1.0);
}
)";

const char* const groundFragment = R"(#version 330 core
in vec2 place;                  // on the ground, from the middle of the scene [m]
uniform vec2 gridOrigin;        // offset to the next grid crossing [m]
uniform float spacing;
uniform float size;
uniform vec3 groundColor;
uniform vec3 gridColor;
uniform float lineWidth;        // [pixel]
out vec4 fragment;

// Coverage of a pixel by lines one `period` apart that are `width` pixels wide.
float lines(vec2 p, float period, float width) {
    vec2 pixel = fwidth(p) / period;
    vec2 distance = abs(fract(p / period - 0.5) - 0.5) / max(pixel, 1e-6);
    vec2 c = clamp(0.5 + 0.5 * width - distance, 0.0, 1.0);
    c *= clamp(1.5 - 4.0 * pixel, 0.0, 1.0);   // lines that crowd fade away
    return max(c.x, c.y);
}

void main() {
    float fade = 1.0 - smoothstep(0.25, 1.0, length(place) / size);
    if (fade <= 0.0) discard;
    vec2 p = place - gridOrigin;
    float grid = max(0.45 * lines(p, spacing, lineWidth),
                     0.9 * lines(p, 5.0 * spacing, 1.2 * lineWidth));
    vec3 shade = mix(groundColor, gridColor, grid);
    fragment = vec4(shade, fade);
}
)";

const char* const groundShadowFragment = R"(#version 330 core
in vec2 place;
uniform float size;
uniform vec4 shadowRegion;      // origin, 1 / extent
uniform sampler2D shadow;
uniform vec3 groundColor;
uniform bool isLaidOver;        // as a colour with alpha, not as a factor
out vec4 fragment;

const vec3 absorption = vec3(0.42, 0.40, 0.36);

void main() {
    float fade = 1.0 - smoothstep(0.25, 1.0, length(place) / size);
    vec2 s = (place - shadowRegion.xy) * shadowRegion.zw;
    float dark = texture(shadow, s).r * fade;
    float alpha = dark * absorption.r;
    fragment = isLaidOver ? vec4((alpha - dark * absorption) * groundColor, alpha)
                          : vec4(1.0 - dark * absorption, 1.0);
}
)";

const char* const textVertex = R"(#version 330 core
layout(location = 0) in vec2 corner;
uniform vec3 origin;            // lower left corner, in camera frame
uniform vec3 right;             // width and direction of the line
uniform vec3 top;
uniform mat4 projection;
out vec2 place;

void main() {
    place = 0.5 * corner + 0.5;
    gl_Position = projection * vec4(origin + place.x * right + place.y * top, 1.0);
}
)";

const char* const textFragment = R"(#version 330 core
in vec2 place;
uniform sampler2D coverage;
uniform vec3 color;
uniform float opacity;
out vec4 fragment;

void main() {
    float a = texture(coverage, vec2(place.x, 1.0 - place.y)).r * opacity;
    if (a < 0.004) discard;
    fragment = vec4(color, a);
}
)";

}  // namespace shaders
}  // namespace simflex
