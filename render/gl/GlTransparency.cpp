#include "GlTransparency.h"

#include <algorithm>
#include <stdexcept>

#include "Shaders.h"

namespace simflex {

using SimTK::Vec3;

namespace {

// Units of the textures that peeling reads; unit 0 holds the colour map.
constexpr int sceneUnit = 1, previousUnit = 2, ghostUnit = 3;

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
      depthProgram(gl, shaders::surfaceVertex, shaders::depthOnlyFragment) {
    gl.GenQueries(1, &query);
}

GlTransparency::~GlTransparency() {
    gl.DeleteQueries(1, &query);
}

void GlTransparency::draw(const Scene& scene, const GlView& view, PictureTarget& target) {
    numLayers = 0;
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
    if (canSort(items, ghosts)) {
        drawSorted(items, view);
        drawGhosts(ghosts, view);
    } else {
        peel(items, ghosts, view, target);
    }
}

bool GlTransparency::canSort(const std::vector<Item>& items, const std::vector<Item>& ghosts) {
    for (const Item& item : items)
        for (const Item& ghost : ghosts)
            if (item.rectangle.overlaps(ghost.rectangle)) return false;
    for (std::size_t i = 0; i < items.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const Item &a = items[i], &b = items[j];
            const bool areApart = !a.rectangle.overlaps(b.rectangle) || a.nearest > b.farthest ||
                                  b.nearest > a.farthest;
            if (!areApart) return false;
        }
    return std::all_of(items.begin(), items.end(), [this](const Item& item) {
        return surfaces.updShapes().isConvex(item.surface->geometry);
    });
}

void GlTransparency::drawSorted(std::vector<Item>& items, const GlView& view) {
    std::stable_sort(items.begin(), items.end(), [](const Item& a, const Item& b) {
        return a.nearest + a.farthest > b.nearest + b.farthest;
    });
    gl.Enable(GL_CULL_FACE);
    for (const Item& item : items)
        for (const GLenum hidden : {GL_FRONT, GL_BACK}) {
            gl.CullFace(hidden);
            surfaces.draw(*item.surface, view, GlSurfaces::Sides::Both);
        }
    gl.Disable(GL_CULL_FACE);
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

// Depth first, then colour: only the nearest layer of a ghost shows.
void GlTransparency::drawGhosts(const std::vector<Item>& ghosts, const GlView& view) {
    if (ghosts.empty()) return;
    drawGhostDepth(ghosts, view);
    gl.DepthFunc(GL_LEQUAL);
    for (const Item& ghost : ghosts)
        surfaces.draw(*ghost.surface, view, GlSurfaces::chooseSides(*ghost.surface));
    gl.DepthFunc(GL_LESS);
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
    // Mesa clears a multisampled rectangle without its outermost samples: a little more is cleared
    // than is drawn.
    const auto clear = [&](GLbitfield mask) {
        constexpr int border = 2;
        gl.Scissor(used.left - border, used.bottom - border, used.right - used.left + 2 * border,
                   used.top - used.bottom + 2 * border);
        gl.Clear(mask);
        gl.Scissor(used.left, used.bottom, used.right - used.left, used.top - used.bottom);
    };
    gl.ClearColor(0, 0, 0, 0);
    gl.Viewport(0, 0, width, height);

    // Of ghosts, only the nearest surface takes part.
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

        // Depth of the nearest surface behind the layer before.
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

        // Its colour, under what lies before it.
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
