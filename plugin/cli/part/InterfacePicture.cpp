#include "simflex/cli/part/InterfacePicture.h"

#include <algorithm>

#include "simflex/cli/part/PartView.h"
#include "simflex/render/SurfaceMesh.h"

namespace simflex {
namespace cli {
namespace {

using SimTK::Vec3;

constexpr int PictureWidth = 1280, PictureHeight = 800;
constexpr double DotSize = 5;  // [pixel]

/** Colours that colour-blind readers can distinguish (Okabe and Ito). **/
const Vec3 InterfaceColors[] = {Vec3(0.84, 0.37, 0.00), Vec3(0.00, 0.45, 0.70),
                                Vec3(0.00, 0.62, 0.45), Vec3(0.80, 0.47, 0.65),
                                Vec3(0.90, 0.62, 0.00), Vec3(0.34, 0.71, 0.91)};

Vec3 positionOf(const Mesh& mesh, int node) {
    const auto x = mesh.position(node);
    return Vec3(x[0], x[1], x[2]);
}

SimTK::PolygonalMesh makeSkin(const Mesh& mesh) {
    const SurfaceMesh surface = extractSurface(mesh);
    SimTK::PolygonalMesh skin;
    for (const int node : surface.nodes) skin.addVertex(positionOf(mesh, node));
    for (const auto& [a, b, c] : surface.triangles) {
        SimTK::Array_<int> corners;
        for (const int corner : {a, b, c}) corners.push_back(corner);
        skin.addFace(corners);
    }
    return skin;
}

}  // namespace

Image drawInterfaces(const ReducedBody& part) {
    EmptySystem empty;
    OffscreenVisualizer visualizer(empty.system, PictureWidth, PictureHeight);
    const int up = choosePartView(visualizer, part);
    visualizer.setBackgroundType(SimTK::Visualizer::SolidColor)
        .setShowSimTime(false)
        .setWindowTitle(part.name);
    const SimTK::MobilizedBodyIndex ground(0);
    const auto add = [&](const SimTK::DecorativeGeometry& geometry, const Vec3& location) {
        visualizer.addDecoration(ground, SimTK::Transform(location), geometry);
    };
    const SimTK::PolygonalMesh skin = makeSkin(part.mesh);
    if (skin.getNumFaces() > 0)
        add(SimTK::DecorativeMesh(skin).setColor(Vec3(0.62, 0.67, 0.73)).setOpacity(0.3), Vec3(0));

    const double size = 2 * part.calcRadius();
    for (size_t k = 0; k < part.interfaces.size(); ++k) {
        const ReducedBody::Interface& interface = part.interfaces[k];
        const Vec3 color = InterfaceColors[k % std::size(InterfaceColors)];
        const Vec3 master(interface.position[0], interface.position[1], interface.position[2]);
        double top = 0;
        for (const int node : interface.nodes) {
            const Vec3 x = positionOf(part.mesh, node);
            top = std::max(top, x[up] - master[up]);
            SimTK::DecorativePoint dot(x);
            dot.setColor(color).setLineThickness(DotSize);
            add(dot, Vec3(0));
        }
        SimTK::DecorativeText legend(interface.name + ": " +
                                     std::to_string(interface.nodes.size()) + " nodes, " +
                                     nameOf(interface.tie) + " tie");
        legend.setIsScreenText(true);
        add(legend, Vec3(0));
        add(SimTK::DecorativeFrame(0.07 * size), master);
        Vec3 place = master;
        place[up] += top + 0.04 * size;
        SimTK::DecorativeText label(interface.name);
        label.setColor(0.8 * color).setScale(0.022 * size);
        add(label, place);
    }
    return visualizer.drawFrame(empty.state);
}

}  // namespace cli
}  // namespace simflex
