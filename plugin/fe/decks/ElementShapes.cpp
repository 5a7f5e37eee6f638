#include "ElementShapes.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "DeckVocabulary.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/fe/FaceShapes.h"
#include "simflex/fe/elements/SolidElements.h"

namespace simflex {
namespace {

/** Smallest det(t₁ t₂ t₃)/|t₁||t₂||t₃| at a corner: slightly concave elements pass, swapped nodes
give −0.5. **/
constexpr double LeastCorner = -0.1;
/** Largest distance of a node from the middle of its edge, in lengths of the edge: 0.5 for a half
circle, more for swapped nodes. **/
constexpr double FarthestMiddle = 0.49;

class ShapeCheck {
public:
    ShapeCheck(const std::string& calculixType, ElementType type)
        : m_points(makeIntegrationPoints(calculixType.compare(0, 4, "C3D8") == 0 ? "C3D8"
                                         : calculixType == "C3D20R"              ? "C3D20"
                                                                                 : calculixType,
                                         type)),
          m_corners(makeCornerPoints(type)),
          m_ends(getEdgeEnds(type)) {}

    /** Returns the defect of an element, or "". **/
    std::string find(const std::vector<Vec3d>& x, const std::vector<int>& numbers) const {
        for (size_t k = 0; k < m_corners.size(); ++k) {
            const auto t = calcTangents(x, m_corners[k]);
            const double size = normOf(t[0]) * normOf(t[1]) * normOf(t[2]);
            const double share = size > 0 ? calcDeterminant(t) / size : 0;
            if (share >= LeastCorner) continue;
            std::ostringstream text;
            text << "is turned inside out at node " << numbers[k] << " (scaled Jacobian " << share
                 << "; it must be positive)";
            return text.str();
        }
        for (size_t k = m_corners.size(); k < x.size(); ++k) {
            const size_t a = size_t(m_ends[k][0]), b = size_t(m_ends[k][1]);
            const double length = normOf(sumOf(x[b], -1, x[a]));
            const double off =
                normOf(sumOf(sumOf(x[k], -0.5, x[a]), -0.5, x[b])) / (length > 0 ? length : 1);
            if (length == 0 || off <= FarthestMiddle) continue;
            std::ostringstream text;
            text << "has node " << numbers[k] << " " << off
                 << " edge lengths off the middle of the edge from node " << numbers[a]
                 << " to node " << numbers[b] << ", allowed " << FarthestMiddle;
            return text.str();
        }
        for (const IntegrationPoint& point : m_points) {
            const double determinant = calcDeterminant(calcTangents(x, point));
            if (determinant > 0) continue;
            std::ostringstream text;
            text << "is turned inside out within (Jacobian " << determinant
                 << "; it must be positive)";
            return text.str();
        }
        return "";
    }

private:
    std::vector<IntegrationPoint> m_points, m_corners;
    std::vector<std::array<int, 2>> m_ends;
};

}  // namespace

void checkElementShapes(const DeckModel& deck) {
    for (const auto& typed : deck.solids) {
        const std::string& type = typed.first;  // structured bindings cannot be captured by
                                                // parallel loops and lambdas
        const auto& solids = typed.second;
        const ShapeCheck check(type == LayeredHex     ? "C3D20R"
                               : type == LayeredWedge ? "C3D15"
                               : type == ShellHex     ? "C3D8"
                               : type == ShellWedge   ? "C3D6"
                                                      : type,
                               getSolid(type));
        const auto find = [&](size_t k) {
            std::vector<Vec3d> x;
            x.reserve(solids[k].nodes.size());
            for (const int node : solids[k].nodes)
                x.push_back(deck.mesh.position(deck.mesh.indexOf(node)));
            return check.find(x, solids[k].nodes);
        };
        parallelFor(solids.size(), omp_get_max_threads(), [&](size_t k) {
            const std::string wrong = find(k);
            if (wrong.empty()) return;
            throw BadElementShape(deck.path + ": element " + std::to_string(solids[k].number) +
                                  ", a " + type + ", " + wrong +
                                  "; are its nodes in CalculiX's order? Mend the mesh.");
        });
    }
}

}  // namespace simflex
