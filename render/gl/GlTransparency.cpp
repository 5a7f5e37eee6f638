#include "GlTransparency.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "Shaders.h"

namespace simflex {

using SimTK::Vec3;

namespace {

// Texture units used by peeling; unit 0 holds the colour map.
constexpr int sceneUnit = 1, previousUnit = 2, ghostUnit = 3;

/** Bounding box of a shape, along the shape's axes, in Ground. **/
struct Box {
    explicit Box(const SurfaceItem& surface)
        : item(surface),
          R(item.X_GM.R()),
          center(item.X_GM * (0.5 * (item.geometry->lower + item.geometry->upper))
                                 .elementwiseMultiply(item.scale)),
          half((0.5 * (item.geometry->upper - item.geometry->lower))
                   .elementwiseMultiply(item.scale)) {}

    double calcReach(const Vec3& axis) const {
        double reach = 0;
        for (int k = 0; k < 3; ++k) reach += std::abs(half[k] * SimTK::dot(Vec3(R.col(k)), axis));
        return reach;
    }

    // Returns the extent of the shape itself from the centre. O(vertices)
    double calcReachOfShape(const Vec3& axis) const {
        const Vec3 along = (~R * axis).elementwiseMultiply(item.scale);
        const double offset = SimTK::dot(axis, item.X_GM.p() - center);
        double reach = -SimTK::Infinity;
        const std::vector<float>& v = item.geometry->vertices;
        for (std::size_t i = 0; i < v.size(); i += SurfaceGeometry::floatsPerVertex)
            reach = std::max(reach,
                             offset + along[0] * v[i] + along[1] * v[i + 1] + along[2] * v[i + 2]);
        return reach;
    }

    const SurfaceItem& item;
    SimTK::Rotation R;
    Vec3 center, half;
};

// Returns −1 if a is behind b and must be drawn first, 1 if it is in front of b, 0 if unknown.
int findOrder(double nearestA, double farthestA, double nearestB, double farthestB) {
    return nearestA > farthestB ? -1 : (nearestB > farthestA ? 1 : 0);
}

// As above for objects separated by a plane: the one on the camera's side is in front.
int findOrder(const Vec3& normalToB, double endOfA, double startOfB, const Camera& camera) {
    const double side = camera.isOrthographic
                            ? SimTK::dot(normalToB, Vec3(camera.X_GC.R().z()))
                            : SimTK::dot(normalToB, camera.X_GC.p()) - 0.5 * (endOfA + startOfB);
    return side > 0 ? -1 : 1;
}

// As above for two shapes, if such a plane exists. For two disjoint boxes, one of 15 axes is normal
// to one (S. Gottschalk et al., OBBTree, SIGGRAPH 1996); for two spheres, the line between their
// centres is.
int findOrder(const Box& a, const Box& b, const Camera& camera) {
    std::vector<Vec3> axes;
    for (int k = 0; k < 3; ++k) {
        axes.emplace_back(a.R.col(k));
        axes.emplace_back(b.R.col(k));
        for (int m = 0; m < 3; ++m)
            axes.push_back(SimTK::cross(Vec3(a.R.col(k)), Vec3(b.R.col(m))));
    }
    for (const Vec3& axis : axes) {
        if (axis.norm() < 1e-6) continue;
        const Vec3 toB = SimTK::dot(axis, b.center - a.center) > 0 ? axis : Vec3(-axis);
        const double endOfA = SimTK::dot(toB, a.center) + a.calcReach(axis);
        const double startOfB = SimTK::dot(toB, b.center) - b.calcReach(axis);
        if (endOfA <= startOfB) return findOrder(toB, endOfA, startOfB, camera);
    }
    const Vec3 toB = b.center - a.center;
    const double endOfA = SimTK::dot(toB, a.center) + a.calcReachOfShape(toB);
    const double startOfB = SimTK::dot(toB, b.center) - b.calcReachOfShape(Vec3(-toB));
    if (endOfA < startOfB) return findOrder(toB, endOfA, startOfB, camera);
    return 0;
}

}  // namespace

GlTransparency::Layers::Layers(const GlFunctions& functions, int layerWidth, int layerHeight)
    : gl(functions),
      width(layerWidth),
      height(layerHeight),
      color(gl, SampleTexture::Kind::Color, width, height),
      ghosts(gl, SampleTexture::Kind::ExactDepth, width, height),
      depths{{gl, SampleTexture::Kind::ExactDepth, width, height},
             {gl, SampleTexture::Kind::ExactDepth, width, height}} {
    gl.GenFramebuffers(2, buffers);
    for (int i = 0; i < 2; ++i) {
        gl.BindFramebuffer(GL_FRAMEBUFFER, buffers[i]);
        color.attach();
        depths[i].attach();
        checkFramebuffer(gl, width, height);
    }
    gl.GenFramebuffers(1, &ghostBuffer);
    gl.BindFramebuffer(GL_FRAMEBUFFER, ghostBuffer);
    color.attach();
    ghosts.attach();
    checkFramebuffer(gl, width, height);
}

GlTransparency::Layers::~Layers() {
    gl.DeleteFramebuffers(2, buffers);
    gl.DeleteFramebuffers(1, &ghostBuffer);
}

GlTransparency::GlTransparency(const GlFunctions& functions, const GlScreen& sharedScreen,
                               GlSurfaces& sharedSurfaces)
    : gl(functions),
      screen(sharedScreen),
      surfaces(sharedSurfaces),
      depthProgram(gl, shaders::surfaceVertex, shaders::depthOnlyFragment),
      hasLists(GlFragments::isSupported(gl)) {
    gl.GenQueries(1, &query);
}

GlTransparency::~GlTransparency() {
    gl.DeleteQueries(1, &query);
}

void GlTransparency::draw(const Scene& scene, const GlView& view, PictureTarget& target) {
    numLayers = 0;
    isListed = false;
    std::vector<Item> items, ghosts;
    std::vector<Vec3> corners;
    for (const SurfaceItem& surface : scene.surfaces) {
        if (!surface.isTransparent() || surface.opacity <= 0) continue;
        corners.clear();
        surface.appendBounds(corners);
        Item item = {&surface, calcCoveredRectangle(view, corners, 4), SimTK::Infinity,
                     -SimTK::Infinity};
        for (const Vec3& corner : corners) {
            const double distance = -view.toCamera(corner)[2];
            item.nearest = std::min(item.nearest, distance);
            item.farthest = std::max(item.farthest, distance);
        }
        if (item.rectangle.isEmpty() || item.farthest < view.camera.nearPlane) continue;
        (surface.style == SurfaceItem::Style::Ghost ? ghosts : items).push_back(item);
    }
    if (sort(items, ghosts, view)) {
        drawSorted(items, view);
        drawGhosts(ghosts, view);
    } else if (hasLists) {
        drawLists(scene, items, ghosts, view);
    } else {
        peel(items, ghosts, view, target);
    }
}

bool GlTransparency::sort(std::vector<Item>& items, const std::vector<Item>& ghosts,
                          const GlView& view) {
    for (const Item& item : items)
        for (const Item& ghost : ghosts)
            if (item.rectangle.overlaps(ghost.rectangle)) return false;
    std::stable_sort(items.begin(), items.end(), [](const Item& a, const Item& b) {
        return a.nearest + a.farthest > b.nearest + b.farthest;
    });

    // Determine which items must be drawn before which.
    std::vector<std::vector<std::size_t>> nearerThan(items.size());
    std::vector<int> numFarther(items.size(), 0);
    for (std::size_t j = 0; j < items.size(); ++j)
        for (std::size_t i = 0; i < j; ++i) {
            if (!items[i].rectangle.overlaps(items[j].rectangle)) continue;
            int order =
                findOrder(items[i].nearest, items[i].farthest, items[j].nearest, items[j].farthest);
            if (order == 0)
                order = findOrder(Box(*items[i].surface), Box(*items[j].surface), view.camera);
            if (order == 0) return false;
            const std::size_t farther = order < 0 ? i : j, nearer = order < 0 ? j : i;
            nearerThan[farther].push_back(nearer);
            ++numFarther[nearer];
        }
    const bool areConvex = std::all_of(items.begin(), items.end(), [this](const Item& item) {
        return surfaces.updShapes().isConvex(item.surface->geometry);
    });
    if (!areConvex) return false;

    std::vector<Item> sorted;
    std::vector<std::size_t> ready;
    for (std::size_t i = 0; i < items.size(); ++i)
        if (numFarther[i] == 0) ready.push_back(i);
    for (std::size_t k = 0; k < ready.size(); ++k) {
        sorted.push_back(items[ready[k]]);
        for (const std::size_t nearer : nearerThan[ready[k]])
            if (--numFarther[nearer] == 0) ready.push_back(nearer);
    }
    if (sorted.size() < items.size()) return false;  // cyclic overlap
    items = std::move(sorted);
    return true;
}

void GlTransparency::drawSorted(const std::vector<Item>& items, const GlView& view) {
    for (const Item& item : items) {
        if (item.surface->representation != SimTK::DecorativeGeometry::DrawSurface) {
            surfaces.draw(*item.surface, view, GlSurfaces::Sides::Both);
            continue;
        }
        gl.Enable(GL_CULL_FACE);
        for (const GLenum hidden : {GL_FRONT, GL_BACK}) {
            gl.CullFace(hidden);
            surfaces.draw(*item.surface, view, GlSurfaces::Sides::Both);
        }
        gl.Disable(GL_CULL_FACE);
    }
}

void GlTransparency::drawGhostDepth(const std::vector<Item>& ghosts, const GlView& view) {
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    gl.DepthMask(GL_TRUE);
    depthProgram.use();
    depthProgram.set("projection", view.projection);
    for (const Item& ghost : ghosts)
        surfaces.drawShape(*ghost.surface, view, GlSurfaces::chooseSides(*ghost.surface),
                           depthProgram);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.DepthMask(GL_FALSE);
}

// Draws depth first, then colour, so that only the nearest layer of a ghost is visible.
void GlTransparency::drawGhosts(const std::vector<Item>& ghosts, const GlView& view) {
    if (ghosts.empty()) return;
    drawGhostDepth(ghosts, view);
    gl.DepthFunc(GL_LEQUAL);
    for (const Item& ghost : ghosts)
        surfaces.draw(*ghost.surface, view, GlSurfaces::chooseSides(*ghost.surface));
    gl.DepthFunc(GL_LESS);
}

void GlTransparency::drawLists(const Scene& scene, const std::vector<Item>& items,
                               const std::vector<Item>& ghosts, const GlView& view) {
    isListed = true;
    if (!fragments) fragments = std::make_unique<GlFragments>(gl, screen);
    fragments->setMaxNumber(maxFragments);
    GlRectangle used = items.front().rectangle;
    for (const Item& item : items) used.include(item.rectangle);
    for (const Item& ghost : ghosts) used.include(ghost.rectangle);
    const auto drawOne = [&](const SurfaceItem& surface, GlSurfaces::Sides sides) {
        surfaces.draw(surface, view, sides,
                      fragments->useProgram(int(&surface - scene.surfaces.data())));
    };
    fragments->draw(used, [&] {
        for (const Item& item : items) drawOne(*item.surface, GlSurfaces::Sides::Both);
        for (const Item& ghost : ghosts)
            drawOne(*ghost.surface, GlSurfaces::chooseSides(*ghost.surface));
    });
}

void GlTransparency::peel(const std::vector<Item>& items, const std::vector<Item>& ghosts,
                          const GlView& view, PictureTarget& target) {
    if (!peelProgram) {
        peelProgram =
            std::make_unique<GlProgram>(gl, shaders::surfaceVertex, shaders::peelFragment);
        sampleProgram =
            std::make_unique<GlProgram>(gl, shaders::backgroundVertex, shaders::sampleFragment);
    }
    const int width = target.getWidth(), height = target.getHeight();
    if (!layers || layers->width != width || layers->height != height) {
        layers.reset();
        layers = std::make_unique<Layers>(gl, width, height);
    }

    GlRectangle used = items.front().rectangle;
    for (const Item& item : items) used.include(item.rectangle);
    for (const Item& ghost : ghosts) used.include(ghost.rectangle);
    gl.Enable(GL_SCISSOR_TEST);
    // Mesa clears a multisampled rectangle without its outermost samples, so clear a slightly
    // larger one.
    const auto clear = [&](GLbitfield mask) {
        constexpr int border = 2;
        gl.Scissor(used.left - border, used.bottom - border, used.right - used.left + 2 * border,
                   used.top - used.bottom + 2 * border);
        gl.Clear(mask);
        gl.Scissor(used.left, used.bottom, used.right - used.left, used.top - used.bottom);
    };
    gl.ClearColor(0, 0, 0, 0);
    gl.Viewport(0, 0, width, height);

    // Only the nearest surface of ghosts is included.
    if (!ghosts.empty()) {
        gl.BindFramebuffer(GL_FRAMEBUFFER, layers->ghostBuffer);
        gl.DepthMask(GL_TRUE);
        clear(GL_DEPTH_BUFFER_BIT);
        drawGhostDepth(ghosts, view);
    }

    const auto forEach = [&](const auto& drawOne) {
        for (const Item& item : items) drawOne(item, GlSurfaces::Sides::Both);
        for (const Item& ghost : ghosts) drawOne(ghost, GlSurfaces::chooseSides(*ghost.surface));
    };
    target.getSceneDepth().bind(sceneUnit);
    layers->ghosts.bind(ghostUnit);
    for (int layer = 0; layer < maxLayers; ++layer) {
        gl.BindFramebuffer(GL_FRAMEBUFFER, layers->buffers[layer % 2]);
        layers->depths[(layer + 1) % 2].bind(previousUnit);

        // Depth of the nearest surface behind the previous layer.
        gl.DepthMask(GL_TRUE);
        clear(GL_DEPTH_BUFFER_BIT | (layer == 0 ? GL_COLOR_BUFFER_BIT : 0u));
        gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        peelProgram->use();
        peelProgram->set("projection", view.projection);
        peelProgram->set("scene", sceneUnit);
        peelProgram->set("previous", previousUnit);
        peelProgram->set("ghosts", ghostUnit);
        peelProgram->set("isFirst", layer == 0);
        gl.BeginQuery(GL_ANY_SAMPLES_PASSED, query);
        forEach([&](const Item& item, GlSurfaces::Sides sides) {
            peelProgram->set("isGhost", item.surface->style == SurfaceItem::Style::Ghost);
            surfaces.drawShape(*item.surface, view, sides, *peelProgram);
        });
        gl.EndQuery(GL_ANY_SAMPLES_PASSED);
        gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        gl.DepthMask(GL_FALSE);
        GLuint hasAny = 0;
        gl.GetQueryObjectuiv(query, GL_QUERY_RESULT, &hasAny);
        if (!hasAny) break;

        // Its colour, blended under the previous layers.
        numLayers = layer + 1;
        gl.DepthFunc(GL_EQUAL);
        gl.BlendFuncSeparate(GL_ONE_MINUS_DST_ALPHA, GL_ONE, GL_ONE_MINUS_DST_ALPHA, GL_ONE);
        forEach([&](const Item& item, GlSurfaces::Sides sides) {
            surfaces.draw(*item.surface, view, sides, GlSurfaces::Alpha::Premultiplied);
        });
        gl.DepthFunc(GL_LESS);
    }

    target.bindScene();
    gl.Disable(GL_DEPTH_TEST);
    gl.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    sampleProgram->use();
    sampleProgram->set("layer", sceneUnit);
    layers->color.bind(sceneUnit);
    screen.drawAll();
    gl.Enable(GL_DEPTH_TEST);
    gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    gl.Disable(GL_SCISSOR_TEST);
}

}  // namespace simflex
