#pragma once
/** @file
Parts with stress for the renderer's tests. **/

#include "TestParts.h"

namespace simflex {
namespace test {

/** Returns the stress of mode i at a node: c_i (1 + x), with a different tensor for each mode. **/
inline SimTK::SymMat33 calcModeStress(int mode, double x) {
    const SimTK::SymMat33 tensors[] = {SimTK::SymMat33(3, 0, 0, 0, 0, 0),      // tension along x
                                       SimTK::SymMat33(-2, 1, -5, 0.5, 0, 1),  // mostly pressure
                                       SimTK::SymMat33(0.5, 2, -0.5, -1, 1, -3)};
    return 1e8 * (1 + x) * tensors[mode];
}

/** Makes a brick (see makeBrickPart) with calcModeStress() at all nodes with x ≤ `end`; strain is
stress / 2e11. **/
inline std::shared_ptr<const ReducedBody> makeStressedBrick(SimTK::Vec3 size, int nx, int ny,
                                                            int nz, double end = SimTK::Infinity) {
    ReducedBody part = *makeBrickPart(size, nx, ny, nz);
    ReducedBody::ModalStress modal;
    for (int node = 0; node < part.mesh.numNodes(); ++node)
        if (part.mesh.position(node)[0] <= end) modal.nodes.push_back(node);
    for (int mode = 0; mode < part.numModes; ++mode)
        for (const int node : modal.nodes) {
            const SimTK::SymMat33 s = calcModeStress(mode, part.mesh.position(node)[0]);
            for (const double value : {s(0, 0), s(1, 1), s(2, 2), s(1, 0), s(2, 0), s(2, 1)}) {
                modal.stress.push_back(float(value));
                modal.strain.push_back(float(value / 2e11));
            }
        }
    part.modalStress = std::move(modal);
    return std::make_shared<const ReducedBody>(std::move(part));
}

}  // namespace test
}  // namespace simflex
