#include "GeometricStiffness.h"

#include <stdexcept>

#include "ElementAssembly.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

/** work.m ← Σ v Gᵀ σ G of the element under u (3·n). **/
void integrateStress(const Eigen::VectorXd& u, ElementWork& work) {
    const Eigen::Index n = u.size() / 3;
    work.m.setZero(n, n);
    for (const ElementPoint& point : work.points.points) {
        point.calcStrainMatrix(work.B);
        const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> D(point.D[0].data());
        const Eigen::Matrix<double, 6, 1> stress = D * (work.B * u);
        Eigen::Matrix3d sigma;
        for (Eigen::Index c = 0; c < 6; ++c) {
            const auto [a, b] = TensorPairs[c];
            sigma(a, b) = sigma(b, a) = stress[c];
        }
        work.A.noalias() = point.volume * (sigma * point.G);
        work.m.noalias() += point.G.transpose() * work.A;
    }
}

}  // namespace

void checkStressesAreKnown(const FeModel& model) {
    if (!model.elements)
        throw std::invalid_argument(model.source +
                                    ": geometric stiffness needs the elements of the part, not "
                                    "its matrices alone; reduce it from a deck or a mesh, or leave "
                                    "stiffening out");
    if (model.elements->beside.hasSprings || model.elements->beside.hasHinged)
        throw std::invalid_argument(model.source +
                                    ": geometric stiffness of a part with springs, trusses or "
                                    "membranes is not possible, for their forces are not known; "
                                    "put them into the multibody model, or leave stiffening "
                                    "out");
}

void calcGeometricStiffness(const FeModel& model, const double* fields, int count,
                            const ProgressCallback& progress,
                            const std::function<void(int, const SymmetricMatrix&)>& take) {
    checkStressesAreKnown(model);
    const FeElements& elements = *model.elements;
    const ElementAssembly assembly(elements, model.mesh.numNodes());
    SymmetricMatrix k;
    for (int field = 0; field < count; ++field) {
        reportProgress(progress, "geometric stiffness", double(field) / count);
        const double* from = fields + size_t(field) * 3 * size_t(model.mesh.numNodes());
        assembly.assemble(
            [&](int element, ElementWork& work) {
                const int n = elements.numNodesOf(element);
                Eigen::VectorXd u(3 * n);
                for (int i = 0; i < n; ++i)
                    u.segment<3>(3 * i) = Eigen::Map<const Eigen::Vector3d>(
                        from + 3 * size_t(elements.nodesOf(element)[i]));
                elements.calcPoints(element, model.mesh, work.points);
                integrateStress(u, work);
            },
            nullptr, &k);
        take(field, k);
    }
}

}  // namespace simflex
