#pragma once
/** @file
Small parts and scenes for the renderer's tests. **/

#include <cmath>
#include <memory>

#include "Simbody.h"
#include "simflex/part/ReducedBody.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace test {

/** An empty system with one body on ground and a State of it. **/
struct EmptyScene {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::State state;

    EmptyScene() {
        matter.setShowDefaultGeometry(false);
        state = system.realizeTopology();
    }
};

/** A brick of Hex8 elements, centred at the origin, with modes that are smooth functions of x:
mode 0 shifts along y, mode 1 stretches linearly: u = (x, 0, 0), mode 2 bends: u_y = x². **/
inline std::shared_ptr<const ReducedBody> makeBrickPart(SimTK::Vec3 size, int nx, int ny, int nz) {
    auto part = std::make_shared<ReducedBody>();
    part->name = "brick";
    part->mass = 1;
    part->inertia = {1, 1, 1, 0, 0, 0};
    part->numModes = 3;
    part->omegaSquared = {1, 2, 3};
    Mesh& mesh = part->mesh;
    const auto node = [&](int i, int j, int k) { return (k * (ny + 1) + j) * (nx + 1) + i; };
    for (int k = 0; k <= nz; ++k)
        for (int j = 0; j <= ny; ++j)
            for (int i = 0; i <= nx; ++i) {
                mesh.nodeNumbers.push_back(int(mesh.nodeNumbers.size()) + 1);
                mesh.positions.push_back(size[0] * (double(i) / nx - 0.5));
                mesh.positions.push_back(size[1] * (double(j) / ny - 0.5));
                mesh.positions.push_back(size[2] * (double(k) / nz - 0.5));
            }
    ElementBlock block;
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i)
                for (const int n : {node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k),
                                    node(i, j + 1, k), node(i, j, k + 1), node(i + 1, j, k + 1),
                                    node(i + 1, j + 1, k + 1), node(i, j + 1, k + 1)})
                    block.nodes.push_back(n);
    mesh.elements.push_back(block);

    const std::size_t rows = 3 * mesh.nodeNumbers.size();
    part->Phi.assign(rows * 3, 0.0);
    for (std::size_t n = 0; n < mesh.nodeNumbers.size(); ++n) {
        const double x = mesh.positions[3 * n];
        part->Phi[3 * n + 1] = 1;
        part->Phi[rows + 3 * n] = x;
        part->Phi[2 * rows + 3 * n + 1] = x * x;
    }
    return part;
}

/** A mesh with constant modal coordinates at a constant pose. **/
inline DeformableMesh makeStill(std::shared_ptr<const ReducedBody> part, const SimTK::Vector& xi,
                                const SimTK::Transform& X_GB = SimTK::Transform()) {
    return {part, "", [X_GB](const SimTK::State&) { return X_GB; },
            [xi](const SimTK::State&) { return xi; }};
}

/** White background, no ground, no text, unlit colours; camera on the z axis looking along −z. **/
inline void makePlain(OffscreenVisualizer& viz, double distance = 5) {
    viz.setBackgroundType(SimTK::Visualizer::SolidColor)
        .setLighting(OffscreenVisualizer::Lighting::Flat)
        .setShowAxes(false)
        .setShowSimTime(false)
        .setCameraTransform(SimTK::Transform(SimTK::Vec3(0, 0, distance)));
}

/** Returns the covered area in pixels, with partial coverage of edge pixels: the sum of each
pixel's distance from white towards a colour's darkest channel. **/
inline double calcCoveredArea(const Image& image, int channel, double colorOfChannel) {
    double area = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x)
            area +=
                (255.0 - image.getPixel(x, y)[std::size_t(channel)]) / (255 * (1 - colorOfChannel));
    return area;
}

inline int countPixels(const Image& image, const Image::Pixel& other) {
    int count = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x) count += image.getPixel(x, y) != other;
    return count;
}

}  // namespace test
}  // namespace simflex
