#pragma once
/** @file
Draws transparent surfaces in the right order for each sample of each pixel. Internal to the
renderer.

Convex shapes that are pairwise separated by planes are drawn from far to near, each first its
inside, then its outside. For all others, fragments are listed and sorted per pixel, see
GlFragments.h.

Contexts without support for lists use depth peeling (C. Everitt, Interactive order-independent
transparency, NVIDIA 2001): layer by layer from the viewer, each the nearest surface behind the
previous layer, blended under the layers so far. A layer costs two passes over the transparent
shapes, so n intersecting bodies cost about n² times one.

Both show the nearest `maxLayers` surfaces. **/

#include <memory>
#include <vector>

#include "GlFragments.h"
#include "GlProgram.h"
#include "GlScreen.h"
#include "GlSurfaces.h"
#include "GlTargets.h"
#include "GlView.h"
#include "simflex/render/scene/Scene.h"

namespace simflex {

class GlTransparency {
public:
    static constexpr int maxLayers = GlFragments::maxLayers;

    GlTransparency(const GlFunctions& gl, const GlScreen& screen, GlSurfaces& surfaces);
    ~GlTransparency();
    GlTransparency(const GlTransparency&) = delete;
    GlTransparency& operator=(const GlTransparency&) = delete;

    /** Draws onto the target's bound scene, with blending and without depth writes. **/
    void draw(const Scene& scene, const GlView& view, PictureTarget& target);

    /** Returns the number of layers peeled by the last call; 0 if sorting was sufficient, or with
    lists. **/
    int getNumLayers() const { return numLayers; }

    /** Returns whether the last call used lists. **/
    bool hasListed() const { return isListed; }

    /** Uses peeling in any context. **/
    void forbidLists() { hasLists = false; }

    /** See GlFragments::setMaxNumber(). **/
    void setMaxFragments(unsigned number) { maxFragments = number; }

private:
    struct Item {
        const SurfaceItem* surface;
        GlRectangle rectangle;
        double nearest, farthest;  // along the view direction
    };
    struct Layers {
        Layers(const GlFunctions& gl, int width, int height);
        ~Layers();

        const GlFunctions& gl;
        int width, height;
        SampleTexture color, ghosts, depths[2];
        GLuint buffers[2] = {0, 0}, ghostBuffer = 0;
    };

    /** Sorts items from far to near. Returns false if sorting is not sufficient. **/
    bool sort(std::vector<Item>& items, const std::vector<Item>& ghosts, const GlView& view);
    void drawSorted(const std::vector<Item>& items, const GlView& view);
    void drawGhosts(const std::vector<Item>& ghosts, const GlView& view);
    void drawGhostDepth(const std::vector<Item>& ghosts, const GlView& view);
    void drawLists(const Scene& scene, const std::vector<Item>& items,
                   const std::vector<Item>& ghosts, const GlView& view);
    void peel(const std::vector<Item>& items, const std::vector<Item>& ghosts, const GlView& view,
              PictureTarget& target);

    const GlFunctions& gl;
    const GlScreen& screen;
    GlSurfaces& surfaces;
    GlProgram depthProgram;
    bool hasLists, isListed = false;
    unsigned maxFragments = GlFragments::defaultMaxNumber;
    std::unique_ptr<GlFragments> fragments;
    std::unique_ptr<GlProgram> peelProgram, sampleProgram;  // created on demand
    std::unique_ptr<Layers> layers;
    GLuint query = 0;
    int numLayers = 0;
};

}  // namespace simflex
