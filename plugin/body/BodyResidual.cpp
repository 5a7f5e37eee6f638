// The only loop over a body's modes: all O(n_f) work of an evaluation, eight modes at a time.
// Compiled with fused multiply-add, whose order is fixed here.

#include <algorithm>

#include "simflex/base/Chunk.h"
#include "simflex/body/FlexibleBodyEquations.h"

namespace simflex {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** ½ω_aω_b by component; off-diagonal ones are doubled. **/
struct OmegaProducts {
    explicit OmegaProducts(const Vector3d& omega)
        : of{0.5 * omega[0] * omega[0], 0.5 * omega[1] * omega[1], 0.5 * omega[2] * omega[2],
             omega[0] * omega[1],       omega[0] * omega[2],       omega[1] * omega[2]} {}
    double of[6];
};

}  // namespace

void calcBodyResidual(const FlexibleBodyModel& model, FlexibleBodyData& data, const Vector3d& omega,
                      const Vector3d& omegaDot, const double* xi, const double* xiDot,
                      const double* xiDotDot, const VectorXd& damping, Vector3d& rotation,
                      double* modes) {
    // I = I₀ + Σ_j ξ_j (I₁ⱼ + I₂ⱼᵢξᵢ), ∂I/∂ξ_j = B_j = I₁ⱼ + 2 I₂ⱼᵢξᵢ, İ = Σ_j ξ̇_j B_j, C_a =
    // −(N_aξ)ᵀ.
    const int n = model.n;
    const OmegaProducts products(omega);
    const double *I1 = model.I1Values.data(), *I2Xi = data.I2Xi.data();
    const double *NXi = data.NXi.data(), *NXiDot = data.NXiDot.data();
    const double *d = damping.data(), *omegaSquared = model.omegaSquared.data();
    Chunk inertia[6] = {}, rate[6] = {}, NXiTimesXiDot[3] = {}, NXiTimesXiDotDot[3] = {};
    for (int i = 0; i < n; i += ChunkSize) {
        const int count = std::min(n - i, ChunkSize);
        const Chunk x = loadChunk(xi + i, count), xDot = loadChunk(xiDot + i, count);
        const Chunk xDotDot = loadChunk(xiDotDot + i, count);
        // inertia, damping, elasticity: ξ̈ + D ξ̇ + Ω² ξ
        Chunk mode = xDotDot + loadChunk(d + i, count) * xDot;
        mode += loadChunk(omegaSquared + i, count) * x;
        for (int c = 0; c < 6; ++c) {
            const Chunk half = loadChunk(I1 + c * n + i), product = loadChunk(I2Xi + c * n + i);
            const Chunk sum = half + product, B = sum + product;
            inertia[c] += sum * x;
            rate[c] += B * xDot;
            mode -= B * products.of[c];  // centrifugal: −½ ωᵀ ∂I/∂ξ ω
        }
        for (int a = 0; a < 3; ++a) {
            const Chunk atXi = loadChunk(NXi + a * n + i);
            NXiTimesXiDot[a] += atXi * xDot;
            NXiTimesXiDotDot[a] += atXi * xDotDot;
            mode -= atXi * omegaDot[a];                              // Cᵀ ω̇
            mode -= loadChunk(NXiDot + a * n + i) * (2 * omega[a]);  // gyroscopic: −2 ω_a N_a ξ̇
        }
        storeChunk(mode, modes + i, count);
    }

    Eigen::Matrix<double, 6, 1> inertiaSums, rateSums;
    for (int c = 0; c < 6; ++c) {
        inertiaSums[c] = sumChunk(inertia[c]);
        rateSums[c] = sumChunk(rate[c]);
    }
    data.I = model.inertia + symmetricMatrix(inertiaSums);
    data.IDot = symmetricMatrix(rateSums);
    for (int a = 0; a < 3; ++a) data.CXiDot[a] = -sumChunk(NXiTimesXiDot[a]);
    // İ ω + ω × (I ω + C ξ̇) + I ω̇ + C ξ̈
    rotation = data.IDot * omega + omega.cross(data.I * omega + data.CXiDot) + data.I * omegaDot;
    for (int a = 0; a < 3; ++a) rotation[a] -= sumChunk(NXiTimesXiDotDot[a]);
}

}  // namespace simflex
