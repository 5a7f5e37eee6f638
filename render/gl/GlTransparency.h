#pragma once
/** @file
Draws what one can see through, in the right order at each sample of each pixel.

Shapes that are convex and that a plane keeps apart, by pairs, are drawn from far to near, each
first from inside, then from outside. For all else, fragments are listed and sorted at each pixel,
see GlFragments.h.

A context without what lists need peels (C. Everitt, Interactive order-independent transparency,
NVIDIA 2001): layer by layer from the viewer, each the nearest surface behind the layer before, laid
under what has been gathered so far. A layer costs two passes over the transparent shapes, so that n
bodies that reach into each other cost about n² times one.

Both show the nearest `maxLayers` surfaces. Internal to the renderer. **/

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

    /** Onto the target's scene, which is bound; blending is on, depth is not written. **/
    void draw(const Scene& scene, const GlView& view, PictureTarget& target);

    /** Layers that the last call has peeled; 0 when sorting was enough, or with lists. **/
    int getNumLayers() const { return numLayers; }

    /** Whether the last call used lists. **/
    bool hasListed() const { return isListed; }

    /** Peels whatever the context has. **/
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

    /** Orders items from far to near. False where that cannot be enough. **/
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
    std::unique_ptr<GlProgram> peelProgram, sampleProgram;  // made when first wanted
    std::unique_ptr<Layers> layers;
    GLuint query = 0;
    int numLayers = 0;
};

}  // namespace simflex
