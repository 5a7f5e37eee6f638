"use strict";
// Shows the motion and the curves of a report. Its data stand in the page, as base64 in JSON.

const decode = (text, Type) => {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
  return new Type(bytes.buffer);
};
const find = (root, name) => root.querySelector(`[data-is="${name}"]`);
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
const writeNumber = (x, digits = 4) => {
  if (!Number.isFinite(x)) return "–";
  const size = Math.abs(x);
  return size !== 0 && (size < 1e-3 || size >= 1e6) ? x.toExponential(digits - 1)
                                                   : String(Number(x.toPrecision(digits)));
};

// ---------------------------------------------------------------- vectors, 4×4 by columns

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const add = (a, b, f = 1) => [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };

function multiply(a, b) {
  const c = new Float32Array(16);
  for (let j = 0; j < 4; ++j)
    for (let i = 0; i < 4; ++i) {
      let sum = 0;
      for (let k = 0; k < 4; ++k) sum += a[4 * k + i] * b[4 * j + k];
      c[4 * j + i] = sum;
    }
  return c;
}

// From a place and a quaternion (x, y, z, w), with factors along the own axes.
function makePose(p, q, s = [1, 1, 1]) {
  const [x, y, z, w] = q;
  return new Float32Array([
    s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
    s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
    s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0,
    p[0], p[1], p[2], 1]);
}

// Ground's coordinates in a camera at `eye` with axes x, y, z.
function makeView(eye, x, y, z) {
  return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0,
                           -dot(x, eye), -dot(y, eye), -dot(z, eye), 1]);
}

function makeProjection(fieldOfView, height, aspect, near, far) {
  const m = new Float32Array(16);
  if (fieldOfView > 0) {
    const f = 1 / Math.tan(fieldOfView / 2);
    m[0] = f / aspect; m[5] = f; m[10] = (far + near) / (near - far); m[11] = -1;
    m[14] = 2 * far * near / (near - far);
  } else {
    m[0] = 2 / (height * aspect); m[5] = 2 / height; m[10] = 2 / (near - far);
    m[14] = (far + near) / (near - far); m[15] = 1;
  }
  return m;
}

// ---------------------------------------------------------------- OpenGL

const vertexShader = `#version 300 es
in vec3 position; in vec3 normal; in float value;
uniform mat4 model, view, projection; uniform float lift;
out vec3 place; out vec3 direction; out float shown; out vec3 inGround;
void main() {
  vec4 p = model * vec4(position, 1.0);
  inGround = p.xyz;
  place = (view * p).xyz;
  mat3 turn = mat3(view) * mat3(model);
  vec3 factors = vec3(dot(model[0], model[0]), dot(model[1], model[1]), dot(model[2], model[2]));
  direction = turn * (normal / factors);
  shown = value;
  gl_Position = projection * vec4(place * (1.0 - lift), 1.0);
}`;
const fragmentShader = `#version 300 es
precision highp float;
in vec3 place; in vec3 direction; in float shown; in vec3 inGround;
uniform vec4 color; uniform int kind; uniform sampler2D colors; uniform vec3 light;
uniform vec3 center, along, across; uniform float spacing, radius;
out vec4 fragment;
float cover(float x) {
  float w = fwidth(x), d = abs(fract(x - 0.5) - 0.5);
  return (1.0 - smoothstep(0.5 * w, 1.5 * w, d)) * clamp(0.35 / w, 0.0, 1.0);
}
void main() {
  if (kind == 2) { fragment = color; return; }
  if (kind == 3) {
    vec3 d = inGround - center;
    vec2 cell = vec2(dot(inGround, along), dot(inGround, across)) / spacing;
    float line = max(max(cover(cell.x), cover(cell.y)) * 0.55, max(cover(cell.x / 5.0), cover(cell.y / 5.0)));
    float fade = 1.0 - smoothstep(2.0, 7.0, length(d) / radius);
    fragment = vec4(mix(vec3(0.915, 0.925, 0.935), vec3(0.70, 0.73, 0.765), line), fade);
    return;
  }
  vec3 base = color.rgb;
  if (kind == 1) base = shown < -0.5 ? vec3(0.6) : texture(colors, vec2(clamp(shown, 0.0, 1.0), 0.5)).rgb;
  vec3 n = normalize(direction), v = normalize(-place);
  if (!gl_FrontFacing) n = -n;
  float bright = 0.58 + 0.48 * max(dot(n, light), 0.0) + 0.12 * max(n.y, 0.0);
  vec3 lit = sqrt(base * base * bright) + 0.10 * pow(max(dot(reflect(-light, n), v), 0.0), 24.0);
  fragment = vec4(lit, color.a);
}`;

class Painter {
  constructor(canvas) {
    const gl = this.gl = canvas.getContext("webgl2", {alpha: false, antialias: true, stencil: true, preserveDrawingBuffer: true});
    if (!gl) throw new Error("this browser has no WebGL 2");
    const compile = (type, text) => {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      return shader;
    };
    const program = this.program = gl.createProgram();
    gl.attachShader(program, compile(gl.VERTEX_SHADER, vertexShader));
    gl.attachShader(program, compile(gl.FRAGMENT_SHADER, fragmentShader));
    ["position", "normal", "value"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    this.at = {};
    for (const name of ["model", "view", "projection", "lift", "color", "kind", "colors", "light", "center", "along", "across", "spacing", "radius"])
      this.at[name] = gl.getUniformLocation(program, name);
    this.table = gl.createTexture();
  }
  setColors(colors) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.table);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, colors.length / 3, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, new Uint8Array(colors));
    for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
                                 [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]])
      gl.texParameteri(gl.TEXTURE_2D, name, value);
  }
  makeBuffer(data, target = this.gl.ARRAY_BUFFER) {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, this.gl.STATIC_DRAW);
    return buffer;
  }
  update(buffer, data) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, data, this.gl.DYNAMIC_DRAW);
  }
  bind(shape) {
    const gl = this.gl;
    [[shape.position, 3], [shape.normal, 3], [shape.value, 1]].forEach(([buffer, width], i) => {
      if (!buffer) { gl.disableVertexAttribArray(i); gl.vertexAttrib1f(i, 0); return; }
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, width, gl.FLOAT, false, 0, 0);
    });
  }
}

// ---------------------------------------------------------------- a motion

class Motion {
  constructor(scene, painter) {
    this.scene = scene;
    this.painter = painter;
    this.time = scene.time;
    this.geometries = scene.geometries.map(g => {
      const made = {positions: decode(g.positions, Float32Array), normals: decode(g.normals, Float32Array),
                    triangles: decode(g.triangles, Uint32Array), edges: decode(g.edges, Uint32Array)};
      made.shape = {position: painter.makeBuffer(made.positions), normal: painter.makeBuffer(made.normals)};
      const elements = painter.gl.ELEMENT_ARRAY_BUFFER;
      made.faces = painter.makeBuffer(made.triangles, elements);
      made.lines = painter.makeBuffer(made.edges, elements);
      return made;
    });
    this.bodies = scene.bodies.map(body => {
      const made = {name: body.name, poses: body.poses.map(text => decode(text, Float32Array)), items: body.items};
      if (body.items) return made;
      made.geometry = this.geometries[body.geometry];
      made.shapes = body.shapes.map(s => ({scale: s.scale, values: decode(s.values, Int16Array)}));
      made.weights = decode(body.weights, Float32Array);
      made.references = decode(body.references, Float32Array);
      made.values = body.values ? decode(body.values, Uint8Array) : null;
      made.color = body.color; made.opacity = body.opacity; made.contoured = body.contoured;
      const n = made.geometry.positions.length;
      made.u = new Float32Array(n); made.at = new Float32Array(n); made.n = new Float32Array(n);
      made.shown = new Float32Array(n / 3);
      made.shape = {position: painter.gl.createBuffer(), normal: painter.gl.createBuffer(), value: painter.gl.createBuffer()};
      return made;
    });
    this.links = (scene.links.ends || []).map(list => list.map(text => decode(text, Float32Array)));
    const up = this.up = scene.up;
    this.front = Math.abs(up[2]) > 0.9 ? [0, -1, 0] : [0, 0, 1];
    this.right = cross(up, this.front);
    const c = scene.center, R = 7 * scene.radius;
    const middle = add(c, up, scene.ground - dot(c, up));
    const corners = [];
    for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, 1]])
      corners.push(...add(add(middle, this.right, a * R), this.front, b * R));
    this.ground = {shape: {position: painter.makeBuffer(new Float32Array(corners))},
                   faces: painter.makeBuffer(new Uint32Array([0, 1, 2, 0, 2, 3]), painter.gl.ELEMENT_ARRAY_BUFFER), middle};
    const step = 10 ** Math.floor(Math.log10(scene.radius / 8));
    this.spacing = [1, 2, 5, 10].map(k => k * step).find(s => s >= scene.radius / 8);
  }

  // The two times that a time lies between, and the share of the second.
  locate(t) {
    const time = this.time, last = time.length - 1;
    if (t <= time[0] || last === 0) return [0, 0, 0];
    if (t >= time[last]) return [last, last, 0];
    let low = 0, high = last;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (time[middle] <= t) low = middle; else high = middle;
    }
    return [low, high, (t - time[low]) / ((time[high] - time[low]) || 1)];
  }

  calcPose(poses, [i, j, share]) {
    if (poses.length === 7) i = j = 0;
    const a = poses.subarray(7 * i, 7 * i + 7), b = poses.subarray(7 * j, 7 * j + 7), mixed = [];
    for (let k = 0; k < 7; ++k) mixed.push(a[k] + share * (b[k] - a[k]));
    const q = mixed.slice(3), n = Math.hypot(...q);
    return [mixed.slice(0, 3), q.map(x => x / n)];
  }

  // A rod between two ends.
  placeLink(ends, [i, j, share], radius) {
    const at = k => [0, 1, 2].map(c => ends[6 * i + k + c] + share * (ends[6 * j + k + c] - ends[6 * i + k + c]));
    const a = at(0), b = at(3), y = sub(b, a).map(c => c / 2), along = unit(y);
    const x = unit(cross(along, Math.abs(along[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])), z = cross(x, along);
    return new Float32Array([...x.map(c => c * radius), 0, ...y, 0, ...z.map(c => c * radius), 0, ...add(a, y), 1]);
  }

  // Displacements, places, normals and values of a flexible body.
  deform(body, where, factor, contour) {
    const [i, j, share] = where, K = body.shapes.length, rest = body.geometry.positions, {u, at, n} = body;
    const mix = (values, width, k) => values[width * i + k] + share * (values[width * j + k] - values[width * i + k]);
    u.fill(0);
    body.shapes.forEach((shape, k) => {
      const w = mix(body.weights, K, k) * shape.scale, values = shape.values;
      for (let v = 0; v < u.length; ++v) u[v] += w * values[v];
    });
    const r = [0, 1, 2, 3, 4, 5].map(k => mix(body.references, 6, k));
    for (let v = 0; v < u.length; v += 3) {
      const x = rest[v], y = rest[v + 1], z = rest[v + 2];
      const held = [r[0] + r[4] * z - r[5] * y, r[1] + r[5] * x - r[3] * z, r[2] + r[3] * y - r[4] * x];
      for (let k = 0; k < 3; ++k) {
        at[v + k] = rest[v + k] + factor * u[v + k] - (factor - 1) * held[k];
        u[v + k] -= held[k];
      }
    }
    n.fill(0);
    const triangles = body.geometry.triangles;
    for (let t = 0; t < triangles.length; t += 3) {
      const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
      const ax = at[b] - at[a], ay = at[b + 1] - at[a + 1], az = at[b + 2] - at[a + 2];
      const bx = at[c] - at[a], by = at[c + 1] - at[a + 1], bz = at[c + 2] - at[a + 2];
      const nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
      for (const v of [a, b, c]) { n[v] += nx; n[v + 1] += ny; n[v + 2] += nz; }
    }
    if (contour && body.contoured) {
      const [low, high] = contour.range, shown = body.shown, axis = "xyz".indexOf(contour.kind);
      const V = shown.length;
      for (let v = 0; v < V; ++v) {
        if (contour.kind === "values") {
          const a = body.values ? body.values[V * i + v] : 255, b = body.values ? body.values[V * j + v] : 255;
          shown[v] = a === 255 ? -1 : (a + share * (b - a)) / 254;
          continue;
        }
        const value = axis < 0 ? Math.hypot(u[3 * v], u[3 * v + 1], u[3 * v + 2]) : u[3 * v + axis];
        shown[v] = clamp((value - low) / (high - low), 0, 1);
      }
      this.painter.update(body.shape.value, shown);
    }
    this.painter.update(body.shape.position, at);
    this.painter.update(body.shape.normal, n);
  }

  draw(t, which, contour, camera) {
    const {gl, at, program} = this.painter, {scene} = this, where = this.locate(t);
    const factor = scene.factors[which];
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0.87, 0.90, 0.94, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(program);
    gl.uniformMatrix4fv(at.view, false, camera.view);
    gl.uniformMatrix4fv(at.projection, false, camera.projection);
    const light = unit([-0.42, 1.0, 0.75]);
    gl.uniform3f(at.light, ...light);
    gl.uniform1i(at.colors, 0);
    if (contour) this.painter.setColors(contour.colors);

    const pieces = [];
    for (const body of this.bodies) {
      const pose = makePose(...this.calcPose(body.poses[which], where));
      if (!body.items) {
        this.deform(body, where, factor, contour);
        pieces.push({model: pose, geometry: body.geometry, shape: body.shape, color: [...body.color, body.opacity],
                     kind: contour && body.contoured ? 1 : 0});
        continue;
      }
      for (const item of body.items)
        pieces.push({model: multiply(pose, makePose(item.place, item.turn, item.scale)),
                     geometry: this.geometries[item.geometry], shape: this.geometries[item.geometry].shape,
                     color: [...item.color, item.opacity], kind: 0});
    }
    for (const link of this.links) {
      const {geometry, color, radius} = scene.links, shown = this.geometries[geometry];
      pieces.push({model: this.placeLink(link[which], where, radius), geometry: shown, shape: shown.shape, color: [...color, 1], kind: 0});
    }
    this.drawGround(pieces, camera);
    const drawAll = isOpaque => {
      for (const piece of pieces) if ((piece.color[3] >= 1) === isOpaque) this.drawPiece(piece, piece.kind, piece.color);
    };
    drawAll(true);
    for (const piece of pieces) if (piece.color[3] >= 1) this.drawEdges(piece);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    drawAll(false);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  drawPiece(piece, kind, color) {
    const {gl, at} = this.painter;
    gl.uniformMatrix4fv(at.model, false, piece.model);
    gl.uniform4f(at.color, ...color);
    gl.uniform1i(at.kind, kind);
    gl.uniform1f(at.lift, 0);
    this.painter.bind(piece.shape);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, piece.geometry.faces);
    gl.drawElements(gl.TRIANGLES, piece.geometry.triangles.length, gl.UNSIGNED_INT, 0);
  }

  drawEdges(piece) {
    const {gl, at} = this.painter;
    if (!piece.geometry.edges.length) return;
    gl.uniformMatrix4fv(at.model, false, piece.model);
    gl.uniform4f(at.color, 0.12, 0.15, 0.2, 1);
    gl.uniform1i(at.kind, 2);
    gl.uniform1f(at.lift, 1e-3);
    this.painter.bind(piece.shape);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, piece.geometry.lines);
    gl.drawElements(gl.LINES, piece.geometry.edges.length, gl.UNSIGNED_INT, 0);
  }

  // With a shadow straight below.
  drawGround(pieces, camera) {
    const {gl, at} = this.painter, {scene, up} = this;
    if (dot(camera.eye, up) < scene.ground) return;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.uniform3f(at.center, ...this.ground.middle);
    gl.uniform3f(at.along, ...this.right);
    gl.uniform3f(at.across, ...this.front);
    gl.uniform1f(at.spacing, this.spacing);
    gl.uniform1f(at.radius, scene.radius);
    this.drawPiece({model: makePose([0, 0, 0], [0, 0, 0, 1]), shape: this.ground.shape,
                    geometry: {faces: this.ground.faces, triangles: {length: 6}}}, 3, [1, 1, 1, 1]);
    const flat = new Float32Array(16);
    for (let j = 0; j < 3; ++j)
      for (let i = 0; i < 3; ++i) flat[4 * j + i] = (i === j ? 1 : 0) - up[i] * up[j];
    for (let i = 0; i < 3; ++i) flat[12 + i] = up[i] * scene.ground;
    flat[15] = 1;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.disable(gl.DEPTH_TEST);
    for (const piece of pieces)
      if (piece.color[3] >= 1) this.drawPiece({...piece, model: multiply(flat, piece.model)}, 2, [0.07, 0.09, 0.12, 0.3]);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.STENCIL_TEST);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
}

// ---------------------------------------------------------------- an analysis: motion, curves, controls

class Player {
  constructor(section, analysis) {
    this.section = section;
    this.listeners = [];
    this.first = analysis.first;
    this.last = analysis.last;
    this.time = this.first;
    this.isPlaying = false;
    this.slider = find(section, "time");
    this.button = find(section, "play");
    this.speed = find(section, "speed");
    // A usual speed lasts about eight seconds.
    const length = this.last - this.first || 1, usual = length / 8;
    const round = x => { const p = 10 ** Math.floor(Math.log10(x)); return Number((p * [1, 2, 5, 10].find(k => k * p >= x * 0.999)).toPrecision(1)); };
    for (const share of [0.1, 0.25, 0.5, 1, 2, 4]) {
      const rate = round(usual * share);
      if ([...this.speed.options].some(o => Number(o.value) === rate)) continue;
      this.speed.add(new Option(rate === 1 ? "real time" : `×${writeNumber(rate, 2)}`, rate, share === 1, share === 1));
    }
    this.button.onclick = () => this.toggle();
    this.slider.oninput = () => { this.stop(); this.setTime(this.first + length * this.slider.value / 1e4); };
    section.addEventListener("keydown", event => this.takeKey(event));
    this.setTime(this.first);
  }
  setTime(t) {
    this.time = clamp(t, this.first, this.last);
    this.slider.value = 1e4 * (this.time - this.first) / ((this.last - this.first) || 1);
    this.slider.setAttribute("aria-valuetext", `t = ${writeNumber(this.time)} s`);
    find(this.section, "clock").textContent = `t = ${this.time.toFixed(4)} s`;
    for (const listener of this.listeners) listener(this.time);
  }
  toggle() { if (this.isPlaying) this.stop(); else this.play(); }
  stop() { this.isPlaying = false; this.button.textContent = "▶ Play"; }
  play() {
    if (this.time >= this.last) this.setTime(this.first);
    this.isPlaying = true;
    this.button.textContent = "❚❚ Pause";
    let before = performance.now();
    const step = now => {
      if (!this.isPlaying) return;
      const t = this.time + Number(this.speed.value) * (now - before) / 1000;
      before = now;
      this.setTime(t >= this.last ? this.first : t);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
  takeKey(event) {
    if (["SELECT", "INPUT", "BUTTON"].includes(event.target.tagName) && event.key !== "Home" && event.key !== "End") return;
    const step = (this.last - this.first) / 200 * (event.shiftKey ? 10 : 1);
    const actions = {" ": () => this.toggle(), "ArrowLeft": () => { this.stop(); this.setTime(this.time - step); },
                     "ArrowRight": () => { this.stop(); this.setTime(this.time + step); },
                     "Home": () => this.setTime(this.first), "End": () => this.setTime(this.last)};
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }
}

class Stage {
  constructor(section, scene, player) {
    this.section = section;
    this.player = player;
    this.canvas = find(section, "scene");
    this.motion = new Motion(scene, new Painter(this.canvas));
    this.fieldOfView = Math.PI / 6;
    const option = (text, value, isChosen) => new Option(text, value, isChosen, isChosen);
    this.factor = find(section, "factor");
    const usual = scene.factors.length - 1;
    scene.factors.map((f, i) => [f, i]).sort((a, b) => a[0] - b[0])
        .forEach(([f, i]) => this.factor.add(option(`×${writeNumber(f, 3)}`, i, i === usual)));
    this.contour = find(section, "contour");
    this.contour.add(option("none", "", scene.shown === "none"));
    scene.contours.forEach((c, i) => this.contour.add(option(c.name, i, c.kind === scene.shown)));
    this.camera = find(section, "camera");
    scene.views.forEach((v, i) => this.camera.add(option(v.name, `own ${i}`, i === 0)));
    for (const name of ["front", "back", "left", "right", "top", "bottom", "isometric"]) this.camera.add(option(name, name, false));
    this.free = null;  // once the camera has been moved by hand
    this.camera.onchange = () => { this.free = null; this.chooseDirection(); this.draw(); };
    this.factor.onchange = () => this.draw();
    this.contour.onchange = () => { this.showBar(); this.draw(); };
    this.watchPointers();
    this.canvas.addEventListener("keydown", event => this.takeKey(event));
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    this.showBar();
    this.resize();
    player.listeners.push(() => this.draw());
  }

  resize() {
    const ratio = Math.min(2, window.devicePixelRatio || 1), box = this.canvas.getBoundingClientRect();
    this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    this.draw();
  }

  showBar() {
    const bar = find(this.section, "bar"), contour = this.motion.scene.contours[this.contour.value];
    bar.hidden = this.contour.value === "" || !contour;
    if (bar.hidden) return;
    find(bar, "quantity").textContent = `${contour.name} [${contour.unit}]`;
    const colors = find(bar, "colors"), stops = [];
    for (let k = 0; k < contour.colors.length; k += 3) stops.push(`rgb(${contour.colors.slice(k, k + 3)})`);
    colors.style.background = `linear-gradient(to top, ${stops})`;
    colors.replaceChildren();
    for (let k = 0; k <= 4; ++k) {
      const label = document.createElement("span");
      label.style.bottom = `${25 * k}%`;
      label.textContent = writeNumber((contour.range[0] + (contour.range[1] - contour.range[0]) * k / 4) / contour.size, 3);
      colors.append(label);
    }
  }

  chooseDirection() {
    const angles = {front: [0, 0], back: [Math.PI, 0], left: [-Math.PI / 2, 0], right: [Math.PI / 2, 0], top: [0, Math.PI / 2],
                    bottom: [0, -Math.PI / 2], isometric: [Math.PI / 4, Math.atan(Math.SQRT1_2)]}[this.camera.value];
    if (!angles) return;
    const {scene} = this.motion, aspect = this.canvas.width / this.canvas.height;
    const distance = 1.05 * scene.radius / Math.sin(this.fieldOfView / 2) / Math.min(1, aspect);
    this.free = {target: scene.center, azimuth: angles[0], elevation: angles[1], distance, fieldOfView: this.fieldOfView};
  }

  axesOf({azimuth, elevation}) {
    const {up, front, right} = this.motion, c = Math.cos(elevation), s = Math.sin(elevation);
    const level = add(front.map(k => k * Math.cos(azimuth)), right, Math.sin(azimuth));
    const z = add(level.map(k => k * c), up, s), x = cross(up, level);
    return [x, cross(z, x), z];
  }

  calcCamera() {
    const {scene} = this.motion, aspect = this.canvas.width / this.canvas.height;
    let eye, axes, fieldOfView, height = 1;
    if (this.free) {
      axes = this.axesOf(this.free);
      eye = add(this.free.target, axes[2], this.free.distance);
      fieldOfView = this.free.fieldOfView;
      height = this.free.height || 1;
    } else {
      const view = scene.views[Number(this.camera.value.slice(4))];
      const poses = view.decoded || (view.decoded = decode(view.poses, Float32Array));
      const [p, q] = this.motion.calcPose(poses, this.motion.locate(this.player.time)), m = makePose(p, q);
      axes = [0, 4, 8].map(k => [m[k], m[k + 1], m[k + 2]]);
      eye = p;
      // A narrow window sees as much to the sides as the picture did.
      const wide = Math.max(1, view.aspect / aspect);
      fieldOfView = view.fieldOfView > 0 ? 2 * Math.atan(wide * Math.tan(view.fieldOfView / 2)) : 0;
      height = view.height * wide;
    }
    const away = Math.hypot(...sub(scene.center, eye)), far = away + 8 * scene.radius;
    const near = fieldOfView > 0 ? Math.max(1e-3 * scene.radius, away - 8 * scene.radius) : -far;
    return {eye, axes, fieldOfView, height, aspect, view: makeView(eye, ...axes),
            projection: makeProjection(fieldOfView, height, aspect, near, far)};
  }

  // From where the camera is, so that it can be moved by hand.
  release() {
    if (this.free) return;
    const {motion} = this, camera = this.calcCamera(), z = camera.axes[2];
    const distance = Math.max(0.05 * motion.scene.radius, dot(sub(camera.eye, motion.scene.center), z));
    const target = add(camera.eye, z, -distance);
    this.free = {target, distance, fieldOfView: camera.fieldOfView, height: camera.height,
                 elevation: Math.asin(clamp(dot(z, motion.up), -1, 1)),
                 azimuth: Math.atan2(dot(z, motion.right), dot(z, motion.front))};
  }
  turn(dx, dy) {
    this.release();
    this.free.azimuth -= dx;
    this.free.elevation = clamp(this.free.elevation + dy, -Math.PI / 2, Math.PI / 2);
    this.draw();
  }
  shift(dx, dy) {  // in heights of the picture
    this.release();
    const [x, y] = this.axesOf(this.free);
    const size = this.free.fieldOfView > 0 ? 2 * this.free.distance * Math.tan(this.free.fieldOfView / 2) : this.free.height;
    this.free.target = add(add(this.free.target, x, -dx * size), y, dy * size);
    this.draw();
  }
  zoom(by) {
    this.release();
    this.free.distance *= by;
    if (this.free.height) this.free.height *= by;
    this.draw();
  }

  watchPointers() {
    const {canvas} = this, down = new Map();
    canvas.onpointerdown = event => { try { canvas.setPointerCapture(event.pointerId); } catch (e) {} down.set(event.pointerId, event); canvas.focus(); };
    canvas.onpointerup = canvas.onpointercancel = event => down.delete(event.pointerId);
    canvas.oncontextmenu = event => event.preventDefault();
    canvas.onpointermove = event => {
      const before = down.get(event.pointerId);
      if (!before) return;
      const height = canvas.clientHeight, dx = (event.clientX - before.clientX) / height, dy = (event.clientY - before.clientY) / height;
      if (down.size === 2) {
        const other = [...down.values()].find(e => e.pointerId !== event.pointerId);
        const apart = e => Math.hypot(e.clientX - other.clientX, e.clientY - other.clientY) || 1;
        this.zoom(apart(before) / apart(event));
        this.shift(dx / 2, dy / 2);
      } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) this.shift(dx, dy);
      else this.turn(3 * dx, 3 * dy);
      down.set(event.pointerId, event);
    };
    canvas.addEventListener("wheel", event => { event.preventDefault(); this.zoom(Math.exp(0.0012 * event.deltaY)); }, {passive: false});
    canvas.ondblclick = () => { this.free = null; this.chooseDirection(); this.draw(); };
  }
  takeKey(event) {
    const actions = {"+": () => this.zoom(0.9), "-": () => this.zoom(1 / 0.9), "a": () => this.turn(-0.1, 0), "d": () => this.turn(0.1, 0),
                     "w": () => this.turn(0, 0.1), "s": () => this.turn(0, -0.1)};
    if (actions[event.key]) { event.preventDefault(); actions[event.key](); }
  }

  draw() {
    const contour = this.contour.value === "" ? null : this.motion.scene.contours[this.contour.value];
    this.motion.draw(this.player.time, Number(this.factor.value), contour, this.calcCamera());
  }
}

const curveColors = ["#2a5db0", "#c8501e", "#2e8540", "#8a4bad", "#b08a00", "#0f8b8d"];

// Curves over the time, or over another number.
class Plot {
  constructor(figure, plot, player) {
    this.canvas = figure.querySelector("canvas");
    this.player = player;
    const shared = plot.x ? decode(plot.x, Float64Array) : null;
    this.curves = plot.curves.map(curve => ({name: curve.name, x: curve.x ? decode(curve.x, Float64Array) : shared, y: decode(curve.y, Float32Array)}));
    this.isDots = plot.dots;
    this.isLog = plot.log;
    if (plot.log) this.curves = this.curves.map(c => ({name: c.name, x: c.x.map(Math.log10), y: c.y.map(Math.log10)}));
    this.legend = find(figure, "legend");
    const finite = list => list.filter(Number.isFinite);
    const all = this.curves.flatMap(c => finite(Array.from(c.y))), allX = this.curves.flatMap(c => Array.from(c.x));
    const extreme = (list, f) => list.reduce((a, b) => f(a, b), f === Math.min ? Infinity : -Infinity);
    this.x = [extreme(allX, Math.min), extreme(allX, Math.max)];
    const y = all.length ? [extreme(all, Math.min), extreme(all, Math.max)] : [0, 1];
    const pad = (y[1] - y[0]) * 0.06 || Math.abs(y[0]) * 0.1 || 1;
    this.y = [y[0] - pad, y[1] + pad];
    if (player) {
      const seek = event => { if (event.buttons !== 1 && event.type !== "pointerdown") return;
        const box = this.canvas.getBoundingClientRect();
        player.stop();
        player.setTime(this.x[0] + (this.x[1] - this.x[0]) * clamp((event.clientX - box.left - this.left) / (box.width - this.left - 8), 0, 1)); };
      this.canvas.onpointerdown = this.canvas.onpointermove = seek;
      player.listeners.push(t => this.show(t));
    }
    new ResizeObserver(() => this.prepare()).observe(this.canvas);
    this.prepare();
  }
  ticks(low, high, most) {
    if (this.isLog && high - low > 1.2) return Plot.ticks(low, high, Math.min(most, high - low)).filter(Number.isInteger);
    return Plot.ticks(low, high, most);
  }
  write(v, digits) { return writeNumber(this.isLog ? 10 ** v : v, this.isLog ? 3 : digits); }
  static ticks(low, high, most) {
    const raw = (high - low) / most, p = 10 ** Math.floor(Math.log10(raw)), step = p * [1, 2, 2.5, 5, 10].find(k => k * p >= raw * 0.999);
    const list = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high * (1 + 1e-12) + 1e-9 * step; ++k) list.push(k * step);
    return list;
  }
  prepare() {
    const ratio = window.devicePixelRatio || 1, w = this.canvas.clientWidth, h = this.canvas.clientHeight;
    if (!w) return;
    this.canvas.width = w * ratio;
    this.canvas.height = h * ratio;
    const g = this.canvas.getContext("2d");
    g.scale(ratio, ratio);
    g.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    const yTicks = this.ticks(...this.y, 4), labels = yTicks.map(v => this.write(v, 4));
    this.left = Math.max(...labels.map(l => g.measureText(l).width), 10) + 8;
    const bottom = h - 18, X = x => this.left + (w - this.left - 8) * (x - this.x[0]) / ((this.x[1] - this.x[0]) || 1);
    const Y = y => bottom - (bottom - 6) * (y - this.y[0]) / (this.y[1] - this.y[0]);
    this.X = X;
    g.strokeStyle = "#e3e8ee"; g.fillStyle = "#5b6676"; g.lineWidth = 1;
    g.textAlign = "right"; g.textBaseline = "middle";
    yTicks.forEach((v, k) => { g.beginPath(); g.moveTo(this.left, Y(v)); g.lineTo(w - 8, Y(v)); g.stroke(); g.fillText(labels[k], this.left - 4, Y(v)); });
    g.textAlign = "center"; g.textBaseline = "top";
    for (const v of this.ticks(...this.x, Math.max(2, w / 110))) { g.beginPath(); g.moveTo(X(v), 6); g.lineTo(X(v), bottom); g.stroke(); g.fillText(this.write(v, 6), clamp(X(v), this.left + 8, w - 20), bottom + 3); }
    g.save();
    g.beginPath(); g.rect(this.left, 0, w - this.left, bottom + 1); g.clip();
    this.curves.forEach((curve, k) => {
      g.strokeStyle = g.fillStyle = curveColors[k % curveColors.length];
      g.lineWidth = 1.4;
      g.beginPath();
      let isOn = false;
      for (let i = 0; i < curve.x.length; ++i) {
        if (!Number.isFinite(curve.y[i])) { isOn = false; continue; }
        const px = X(curve.x[i]), py = Y(curve.y[i]);
        if (this.isDots) { g.moveTo(px + 2.5, py); g.arc(px, py, 2.5, 0, 7); }
        else if (isOn) g.lineTo(px, py); else g.moveTo(px, py);
        isOn = true;
      }
      if (this.isDots) g.fill(); else g.stroke();
    });
    g.restore();
    this.picture = g.getImageData(0, 0, this.canvas.width, this.canvas.height);
    this.show(this.player ? this.player.time : NaN);
  }
  show(t) {
    if (!this.picture) return;
    const g = this.canvas.getContext("2d"), ratio = window.devicePixelRatio || 1;
    g.putImageData(this.picture, 0, 0);
    if (Number.isFinite(t)) { g.fillStyle = "#1c222c"; g.fillRect(this.X(t) - 0.5, 4, 1, this.canvas.height / ratio - 22); }
    this.legend.replaceChildren(...this.curves.map((curve, k) => {
      const label = document.createElement("span");
      label.style.color = curveColors[k % curveColors.length];
      label.textContent = (curve.name ? curve.name : "") + (Number.isFinite(t) ? ` ${writeNumber(this.sample(curve, t))}` : "");
      return label;
    }));
  }
  sample(curve, t) {
    let low = 0, high = curve.x.length - 1;
    while (high - low > 1) { const m = (low + high) >> 1; if (curve.x[m] <= t) low = m; else high = m; }
    const length = curve.x[high] - curve.x[low], share = length > 0 ? clamp((t - curve.x[low]) / length, 0, 1) : 0;
    return curve.y[low] + share * (curve.y[high] - curve.y[low]);
  }
}

function show() {
  const data = JSON.parse(document.getElementById("data").textContent);
  const stages = window.simflexStages = [];
  for (const analysis of data.analyses) {
    const section = document.getElementById(analysis.id);
    const player = analysis.last > analysis.first ? new Player(section, analysis) : null;
    if (analysis.scene) {
      try {
        stages.push(new Stage(section, analysis.scene, player));
      } catch (error) {
        find(section, "bar").hidden = true;
        find(section, "clock").textContent = `The motion cannot be drawn: ${error.message}.`;
      }
    }
    const figures = section.querySelectorAll("figure");
    analysis.plots.forEach((plot, k) => new Plot(figures[k], plot, plot.isOfTime ? player : null));
  }
  document.documentElement.dataset.ready = "yes";
}
show();
