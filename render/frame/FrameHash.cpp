#include "FrameHash.h"

#include <cstdio>
#include <map>
#include <memory>
#include <mutex>

#include "simflex/base/Hash.h"

namespace simflex {

namespace {

constexpr int drawingVersion = 3;  // increment if the same snapshot is drawn differently

// Every member is named below, so that a new member does not compile until it is added here.

void add(Hash& hash, const SimTK::Vec3& v) {
    for (int k = 0; k < 3; ++k) hash.add(v[k]);
}
void add(Hash& hash, const SimTK::Rotation& R) {
    for (int k = 0; k < 3; ++k) add(hash, SimTK::Vec3(R.col(k)));
}
void add(Hash& hash, const SimTK::Transform& X) {
    add(hash, X.R());
    add(hash, X.p());
}
void add(Hash& hash, const SimTK::Vector& v) {
    hash.add(v.size());
    for (int i = 0; i < v.size(); ++i) hash.add(v[i]);
}
void add(Hash& hash, const Image::Pixel& color) {
    hash.addBytes(color.data(), color.size());
}
void add(Hash& hash, const std::vector<std::string>& texts) {
    hash.add(texts.size());
    for (const std::string& text : texts) hash.add(text);
}

// Large constant objects are hashed once during their lifetime.
template <class T>
std::uint64_t findConstant(const std::shared_ptr<const T>& object,
                           void (*addContent)(Hash&, const T&)) {
    struct Known {
        std::weak_ptr<const T> object;
        std::uint64_t value;
    };
    static std::mutex mutex;
    static std::map<const T*, Known> known;
    {
        const std::lock_guard<std::mutex> lock(mutex);
        const auto found = known.find(object.get());
        if (found != known.end() && found->second.object.lock() == object)
            return found->second.value;
    }
    Hash hash;
    addContent(hash, *object);
    const std::lock_guard<std::mutex> lock(mutex);
    for (auto entry = known.begin(); entry != known.end();)
        entry = entry->second.object.expired() ? known.erase(entry) : std::next(entry);
    known[object.get()] = {object, hash.get()};
    return hash.get();
}

void addGeometry(Hash& hash, const SurfaceGeometry& geometry) {
    const auto& [vertices, triangles, featureEdges, elementEdges, isClosed, isFine, lower, upper,
                 version] = geometry;
    hash.add(vertices);
    hash.add(triangles);
    hash.add(featureEdges);
    hash.add(elementEdges);
    hash.add(isClosed);
    hash.add(isFine);
    add(hash, lower);
    add(hash, upper);
    (void)version;
}

void addSkin(Hash& hash, const SkinModes& skin) {
    const auto& [part, nodes, restPositions, Phi, between, vertexPoint, around, undeformed] = skin;
    (void)part;    // only its skin is drawn
    (void)around;  // follows from the triangles
    hash.add(nodes);
    hash.add(restPositions);
    hash.add(Phi);
    hash.add(between.starts);
    hash.add(between.nodes);
    hash.add(between.weights);
    hash.add(vertexPoint);
    addGeometry(hash, *undeformed);
}

void addField(Hash& hash, const ContourField& field) {
    field.addTo(hash);
}

void add(Hash& hash, const SurfaceItem& item) {
    const auto& [geometry, X_GM, scale, color, opacity, style, representation, showFeatureEdges,
                 showElementEdges] = item;
    hash.add(findConstant<SurfaceGeometry>(geometry, addGeometry));
    add(hash, X_GM);
    add(hash, scale);
    add(hash, color);
    hash.add(opacity);
    hash.add(style);
    hash.add(representation);
    hash.add(showFeatureEdges);
    hash.add(showElementEdges);
}

void add(Hash& hash, const Scene& scene) {
    const auto& [surfaces, lines, points, texts, screenTexts] = scene;
    hash.add(surfaces.size());
    for (const SurfaceItem& item : surfaces) add(hash, item);
    hash.add(lines.size());
    for (const auto& [start, end, color, opacity, width] : lines) {
        add(hash, start);
        add(hash, end);
        add(hash, color);
        hash.add(opacity);
        hash.add(width);
    }
    hash.add(points.size());
    for (const auto& [location, color, opacity, diameter] : points) {
        add(hash, location);
        add(hash, color);
        hash.add(opacity);
        hash.add(diameter);
    }
    hash.add(texts.size());
    for (const auto& [text, X_GT, height, color, opacity, facesCamera, widthFactor, line] : texts) {
        hash.add(text);
        add(hash, X_GT);
        hash.add(height);
        add(hash, color);
        hash.add(opacity);
        hash.add(facesCamera);
        hash.add(widthFactor);
        hash.add(line);
    }
    add(hash, screenTexts);
}

void add(Hash& hash, const PartSnapshot& part) {
    const auto& [skin, field, look, X_GB, X_GD, xi, reference, V_GB, xiDot] = part;
    const auto& [isVisible, opacity, color, hasContour] = look;
    hash.add(findConstant<SkinModes>(skin, addSkin));
    hash.add(bool(field));
    if (field) hash.add(findConstant<ContourField>(field, addField));
    hash.add(isVisible);
    hash.add(opacity);
    add(hash, color);
    (void)hasContour;  // otherwise there is no field
    add(hash, X_GB);
    add(hash, X_GD);
    add(hash, xi);
    add(hash, reference.shift);
    add(hash, reference.turn);
    add(hash, V_GB[0]);
    add(hash, V_GB[1]);
    add(hash, xiDot);
}

void add(Hash& hash, const PartStyle& style) {
    const auto& [deformationFactor, contour, showUndeformed, showElementEdges, showFeatureEdges] =
        style;
    hash.add(deformationFactor);
    const auto& [quantity, colorMap, isColorMapFixed, range, isRangeFixed, fixedLow, fixedHigh] =
        contour;
    hash.add(quantity);
    hash.add(colorMap);
    hash.add(isColorMapFixed);
    // The actual ends of the range are hashed instead.
    (void)range, (void)isRangeFixed, (void)fixedLow, (void)fixedHigh;
    hash.add(showUndeformed);
    hash.add(showElementEdges);
    hash.add(showFeatureEdges);
}

void add(Hash& hash, const FrameStyle& style) {
    const auto& [palette, ground, up, toLight, isLit, occlusionRadius, colorMap, contourLow,
                 contourHigh, hasTriad, unit, isBackgroundTransparent] = style;
    const auto& [backgroundTop, backgroundBottom, groundColor, grid, edge, ghost, text, faintText,
                 halo] = palette;
    for (const SimTK::Vec3& color :
         {backgroundTop, backgroundBottom, groundColor, grid, edge, ghost})
        add(hash, color);
    for (const Image::Pixel& color : {text, faintText, halo}) add(hash, color);
    const auto& [isShown, hasShadow, X_GP, gridOffset, gridSpacing, radius] = ground;
    hash.add(isShown);
    hash.add(hasShadow);
    add(hash, X_GP);
    hash.add(gridOffset[0]);
    hash.add(gridOffset[1]);
    hash.add(gridSpacing);
    hash.add(radius);
    add(hash, SimTK::Vec3(up));
    add(hash, SimTK::Vec3(toLight));
    hash.add(isLit);
    hash.add(occlusionRadius);
    hash.add(colorMap);
    (void)contourLow, (void)contourHigh;  // set by the painter
    hash.add(hasTriad);
    hash.add(unit);
    hash.add(isBackgroundTransparent);
}

void add(Hash& hash, const ViewSnapshot& view) {
    const auto& [left, top, width, height, camera, X_GF, fitsClippingPlanes, showAxes, unit,
                 overlay] = view;
    (void)X_GF;  // included in the camera
    for (const int number : {left, top, width, height}) hash.add(number);
    const auto& [X_GC, isOrthographic, fieldOfView, viewHeight, nearPlane, farPlane] = camera;
    add(hash, X_GC);
    hash.add(isOrthographic);
    for (const double number : {fieldOfView, viewHeight, nearPlane, farPlane, unit})
        hash.add(number);
    hash.add(fitsClippingPlanes);
    hash.add(showAxes);
    const auto& [title, captions, screenTexts, footnote, overlayUnit, hasScaleBar, pixelSize,
                 hasColorBar, colorBar, hasBorder, hasTriad, R_GC, labels] = overlay;
    hash.add(title);
    add(hash, captions);
    add(hash, screenTexts);
    hash.add(footnote);
    hash.add(overlayUnit);
    hash.add(hasScaleBar);
    hash.add(pixelSize);
    hash.add(hasColorBar);
    const auto& [quantity, reference, ofValues, low, high, colorMap, hasBelow, hasAbove, barTop,
                 barBottom, hasGaps] = colorBar;
    hash.add(barTop);
    hash.add(barBottom);
    hash.add(quantity);
    hash.add(reference);
    hash.add(ofValues);
    (void)low, (void)high, (void)hasBelow, (void)hasAbove;  // set by the painter
    hash.add(hasGaps);
    hash.add(colorMap);
    hash.add(hasBorder);
    hash.add(hasTriad);
    add(hash, R_GC);
    hash.add(labels.size());
    for (const auto& [text, x, y, color] : labels) {
        hash.add(text);
        hash.add(x);
        hash.add(y);
        add(hash, color);
    }
}

void add(Hash& hash, const FrameSnapshot& snapshot) {
    const auto& [number, time, width, height, scene, parts, partStyle, style, center_G, radius,
                 views, labels] = snapshot;
    (void)labels;  // visible ones are in the views
    hash.add(number);
    hash.add(time);
    hash.add(width);
    hash.add(height);
    add(hash, scene);
    hash.add(parts.size());
    for (const PartSnapshot& part : parts) add(hash, part);
    add(hash, partStyle);
    add(hash, style);
    add(hash, center_G);
    hash.add(radius);
    hash.add(views.size());
    for (const ViewSnapshot& view : views) add(hash, view);
}

}  // namespace

std::string hashFrame(const FrameJob& job, const std::vector<SimTK::Vec2>& ranges) {
    const auto& [pictures, compose, composition, plots] = job;
    (void)compose;
    Hash hash;
    hash.add(drawingVersion);
    hash.add(pictures.size());
    for (const FrameSnapshot& picture : pictures) add(hash, picture);
    for (const SimTK::Vec2& range : ranges) {
        hash.add(range[0]);
        hash.add(range[1]);
    }
    hash.add(composition);
    hash.add(plots.size());
    for (const auto& [painter, side, timeUnit] : plots) {
        painter->addTo(hash);
        hash.add(side);
        hash.add(timeUnit);
    }
    return hash.getText();
}

}  // namespace simflex
