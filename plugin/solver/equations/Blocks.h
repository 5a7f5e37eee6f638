#pragma once
/** @file
All blocks of a system, and operations on all of them (private header), on coordinates and speeds in
the solver's and in Simbody's numbering. N(q) is that of the last evaluation. **/

#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "simflex/base/ParallelFor.h"
#include "simflex/solver/equations/Block.h"
#include "simflex/solver/equations/Topology.h"

namespace simflex {

class FlexibleBlock;
class RigidTree;

struct Blocks {
    std::vector<std::unique_ptr<Block>> all;
    std::vector<FlexibleBlock*> flexible;  ///< by FlexibleBodyIndex; the first of all blocks
    std::vector<RigidTree*> rigid;
    std::vector<std::vector<FlexibleBlock*>> batches;  ///< the flexible ones of Topology::batches
    int numSimbodyU = 0;
    EvaluationContext context;
    int numThreads = 1;

    int numQ() const { return all.empty() ? 0 : all.back()->firstQ + all.back()->numQ; }
    int numU() const { return all.empty() ? 0 : all.back()->firstU + all.back()->numU; }

    /** Maximum number of threads; models with few or small bodies use fewer. **/
    void chooseNumThreads(int most);

    const FrameMotion& motionOf(const FrameRef& frame) const {
        return frame.block < 0 ? frame.fixed
                               : all[size_t(frame.block)]->frames[size_t(frame.frame)];
    }
    /** Indices of a body's coordinates and speeds in the solver's vectors, if it belongs to a rigid
    tree. @returns false if not. **/
    bool findRigidSlots(const Topology& topology, SimTK::MobilizedBodyIndex body, int& q0, int& nq,
                        int& u0) const;
    /** r −= Jᵀf, in the whole system, for a force at a frame; no effect for frames in Ground. **/
    void subtractForce(const FrameRef& frame, const SimTK::SpatialVec& F_G, double* r) const {
        if (frame.block < 0) return;
        const Block& block = *all[size_t(frame.block)];
        block.subtractForce(frame.frame, F_G, r + block.firstU);
    }
    /** Writes (or adds, to own columns) a column of Gᵀ: the coefficients of d·(ω, v). **/
    void setColumn(int b, int frame, int column, const SimTK::SpatialVec& d,
                   NewtonSystem::Block& block) const;

    void integrateQ(const double* qHist, double gamma, const double* u, double* q) const;
    /** q̇ = N(q) u. **/
    void calcQDot(const double* q, const double* u, double* qDot) const;
    void displaceQ(const double* delta, double* q) const;
    /** The same for a finite δ, exact to second order. **/
    void moveQ(const double* delta, double* q) const;
    void turnAlong(const double* fromQ, const double* toQ, double* u) const;
    void normalizeQ(double* q) const;
    /** True if N(q) is evaluated by Simbody. **/
    bool askForN() const;

    /** Largest displacement over the blocks [m]; `worst` receives the block.
    @param prepare  if given, writes a block's part of δ, from several threads **/
    double calcDisplacement(const double* delta, int* worst = nullptr,
                            const std::function<void(int b)>& prepare = {}) const;
    /** Largest value of size(b) over the blocks, NaN if one is; `worst` receives the block. **/
    template <class Size>
    double findLargest(const Size& size, int* worst) const {
        std::vector<double>& sizes = *m_sizes;
        sizes.resize(all.size());
        parallelFor(int(all.size()), numThreads, [&](int b) { sizes[size_t(b)] = size(b); });
        double largest = 0;
        for (int b = 0; b < int(all.size()); ++b) {
            const double value = sizes[size_t(b)];
            if (value <= largest) continue;
            largest = value;
            if (worst) *worst = b;
            if (std::isnan(largest)) break;
        }
        return largest;
    }
    /** Power of damping and of loads on whole blocks [W]. **/
    void addInPower(const double* q, const double* u, double& power) const;
    /** Updates the weights of rigid trees' speeds and coordinates for this pose; cheap on average.
    Flexible bodies have body-fixed axes. **/
    void followPose();

    void getFromState(const SimTK::State& state, double* q, double* u) const;
    void putIntoState(double time, const double* q, const double* u, SimTK::State& state) const;
    SimTK::Vector calcSimbodyUDot(const double* q, const double* uDot) const;

private:
    /** Workspaces by block, so that a step does not allocate. **/
    std::unique_ptr<std::vector<double>> m_sizes = std::make_unique<std::vector<double>>();
};

}  // namespace simflex
