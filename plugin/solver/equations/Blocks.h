#pragma once
/** @file
All blocks of a system, and what is done to each of them alike (private header): coordinates and
speeds, in the solver's vectors and in Simbody's. N(q) is that of the last evaluation. **/

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
    std::vector<FlexibleBlock*> flexible;  ///< by FlexibleBodyIndex, the first of all
    std::vector<RigidTree*> rigid;
    std::vector<std::vector<FlexibleBlock*>> batches;  ///< the flexible ones of Topology::batches
    int numSimbodyU = 0;
    EvaluationContext context;
    int numThreads = 1;

    int numQ() const { return all.empty() ? 0 : all.back()->firstQ + all.back()->numQ; }
    int numU() const { return all.empty() ? 0 : all.back()->firstU + all.back()->numU; }

    /** Threads to use at most; models of few or small bodies get fewer. **/
    void chooseNumThreads(int most);

    const FrameMotion& motionOf(const FrameRef& frame) const {
        return frame.block < 0 ? frame.fixed
                               : all[size_t(frame.block)]->frames[size_t(frame.frame)];
    }
    /** Where a body's coordinates and speeds stand in the solver's vectors, if it belongs to a
    rigid tree. @returns false if not. **/
    bool findRigidSlots(const Topology& topology, SimTK::MobilizedBodyIndex body, int& q0, int& nq,
                        int& u0) const;
    /** r −= Jᵀf of the whole system for a force at a frame; nothing if it is in Ground. **/
    void subtractForce(const FrameRef& frame, const SimTK::SpatialVec& F_G, double* r) const {
        if (frame.block < 0) return;
        const Block& block = *all[size_t(frame.block)];
        block.subtractForce(frame.frame, F_G, r + block.firstU);
    }
    /** Writes (or, of own columns, adds) a column of Gᵀ: the coefficients of d·(ω, v). **/
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
    /** True if N(q) is asked of Simbody. **/
    bool askForN() const;

    /** Largest displacement over the blocks [m]; `worst` receives the block.
    @param prepare  if given, writes a block's part of δ, from several threads **/
    double calcDisplacement(const double* delta, int* worst = nullptr,
                            const std::function<void(int b)>& prepare = {}) const;
    /** The largest of what size(b) gives for each block, NaN if one is; `worst` receives it. **/
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
    /** Weighs speeds and coordinates of rigid trees by what they move in this pose; cheap on the
    average. Flexible bodies have their own frames. **/
    void followPose();

    void getFromState(const SimTK::State& state, double* q, double* u) const;
    void putIntoState(double time, const double* q, const double* u, SimTK::State& state) const;
    SimTK::Vector calcSimbodyUDot(const double* q, const double* uDot) const;

private:
    /** By block: a workspace, so that a step allocates nothing. **/
    std::unique_ptr<std::vector<double>> m_sizes = std::make_unique<std::vector<double>>();
};

}  // namespace simflex
