#pragma once
/** @file
A flexible body as a block of the Newton system (private header).

q = [quaternion of B in Ground (4), p_GB (3), ξ (n_f)],  u = [ω_B (3, in B), v (3, in Ground), ξ̇
(n_f)]. **/

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/solver/equations/Block.h"

namespace simflex {

class FlexibleBlock : public Block {
public:
    enum class Modes {
        All,
        None  ///< all held at zero: n_f = 0 here
    };

    FlexibleBlock(const FlexibleBodySubsystem::Guts& guts, FlexibleBodyIndex index,
                  const SimTK::State& state, Modes modes = Modes::All);

    const FlexibleBodyModel& getModel() const { return m_model; }
    /** True if the body has modes that are not speeds of the block. **/
    bool hasHeldModes() const { return !m_held.empty(); }
    const Eigen::VectorXd& getDamping() const { return m_constants->damping; }
    /** Shares constant data with `other` if they are equal, so that a thousand bodies of one part
    store it once. **/
    void shareConstants(const FlexibleBlock& other);
    /** True if some frame's shapes change with ξ (geometric stiffening), so that they cannot be
    shared by a part. **/
    bool hasCurvedFrames() const { return !m_curves.empty(); }
    const FrameShapes* getShapes(int frame) const { return m_frames[size_t(frame)].shapes.get(); }
    const FlexibleFrame& getFrame(int frame) const { return m_frames[size_t(frame)]; }
    /** For a frame whose shapes change with ξ, the shapes of which getShapes() are the tangent;
    otherwise null. **/
    const FrameShapes* findCurvature(int frame) const {
        const int curve = m_curveOf[size_t(frame)];
        return curve < 0 ? nullptr : m_curves[size_t(curve)].shapes.get();
    }
    /** Body frame at the last realize(). **/
    const BodyFrame& getBody() const { return m_body; }
    const FlexibleFramePose& getPose(int frame) const { return m_poses[size_t(frame)]; }

    /** Writes the mode–mode diagonal of the arrow, the same for all bodies of one part and
    damping. **/
    void calcDiagonal(const NewtonFactors& factors, double* diagonal) const;

    /** Adds a frame of this body; returns its index in `frames`. **/
    int addFrame(const FlexibleFrame& frame);

    /** Sets the first index of the scales of the body's loads in TimeValues. **/
    void setFirstScale(int first) { m_firstScale = size_t(first); }

    /** Largest number of blocks in one call of the products below. **/
    static constexpr int LargestBatch = 8;

    /** Computes products of the part's interface shapes with q and u of several blocks of one part,
    before realize().
    @param q, u  of the whole system **/
    static void calcShapeProducts(const std::vector<FlexibleBlock*>& blocks, const double* q,
                                  const double* u);
    /** Computes those with accelerations, before calcFrameAcceleration(). **/
    static void calcAccelerationProducts(const std::vector<FlexibleBlock*>& blocks,
                                         const double* uDot);
    /** calcResidual() for several blocks of one part, with products with the part's invariants
    computed together.
    @param q, u, uDot, r  of the whole system **/
    static void calcResiduals(const std::vector<FlexibleBlock*>& blocks,
                              const EvaluationContext& context, const double* q, const double* u,
                              const double* uDot, double* r);

    std::string describeSpeed(int speed) const override;
    std::string describeCoordinate(int coordinate) const override;
    void realize(const EvaluationContext& context, const double* q, const double* u) override;
    void calcResidual(const EvaluationContext& context, const double* q, const double* u,
                      const double* uDot, double* r) override;
    bool hasLoads() const override { return !m_record.loads.empty(); }
    void subtractLoads(const EvaluationContext& context, const double* q, double* r) override;
    void subtractForce(int frame, const SimTK::SpatialVec& F_G, double* r) const override;
    void subtractSimbodyForces(const SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                               const SimTK::Vector& mobilityForces, double* r) override;
    void addInRow(int frame, const SimTK::SpatialVec& d, double* row) const override;
    /** Writes the same row through the frame's shapes: 6 rigid entries and 6 coefficients. **/
    void calcColumn(int frame, const SimTK::SpatialVec& d, double* rigid,
                    double* coefficients) const;
    SimTK::SpatialVec calcFrameAcceleration(int frame, const double* u,
                                            const double* uDot) const override;
    void formNewtonBlock(const NewtonFactors& factors, BlockDerivatives derivatives,
                         const EvaluationContext& context, const double* q, const double* u,
                         const double* uDot, NewtonSystem::Block& block) override;
    void formMassBlock(NewtonSystem::Block& block) override;
    /** Adds −ΔM u̇ = −[(I − I₀) ω̇ + C ξ̈; Cᵀ ω̇] to forces on the frame and on the mobilities.
    @pre calcResidual(). **/
    void addInCouplingForces(const double* uDot, SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                             SimTK::Vector& mobilityForces);
    void integrateQ(const EvaluationContext& context, const double* qHist, double gamma,
                    const double* u, double* q) const override;
    void calcQDot(const EvaluationContext& context, const double* q, const double* u,
                  double* qDot) const override;
    void displaceQ(const EvaluationContext& context, const double* delta, double* q) const override;
    bool isUsable(const double* q, const double* u) const override {
        return Block::isUsable(q, u) && isUsableQuaternion(q);
    }
    void normalizeQ(double* q) const override;
    void alignQ(const double* reference, double* q) const override;
    double calcDisplacement(const double* delta) const override;
    void getDisplacements(double* ofSpeeds) const override;
    double calcQDisplacement(const double* deltaQ) const override;
    double calcUDisplacement(const double* deltaU, double h) const override;
    double calcDampingPower(const double* u) const override;
    double calcLoadPower(const EvaluationContext& context, const double* q,
                         const double* u) override;
    void getFromState(const SimTK::State& state, double* q, double* u) const override;
    void putIntoState(const double* q, const double* u, SimTK::State& state) const override;
    void putUDot(const double* q, const double* uDot, SimTK::Vector& simbodyUDot) const override;

private:
    using ConstModes = Eigen::Map<const Eigen::VectorXd>;

    /** @pre data has the products with ξ and ξ̇. **/
    void calcResidual(const EvaluationContext& context, FlexibleBodyData& data, const double* q,
                      const double* u, const double* uDot, double* r);
    /** Nξ of the last residual, 3n. Computed on demand, by one thread at a time: it is three times
    as long as ξ, and few residuals are followed by a new matrix. **/
    const double* findNXi();
    /** Cᵀ = −Nξ, n×3, of the last residual. **/
    auto findCTransposed() {
        return -Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>>(findNXi(), m_n, 3);
    }
    /** Writes head and coupling of the arrow, mass entries divided by the mass factor. **/
    void formArrow(double mass, NewtonSystem::Block& block);
    /** Writes the arrow as a full matrix except for its tail, for a block without a part. **/
    void formFullArrow(double mass, NewtonSystem::Block& block);
    /** Sums of a frame: from the products with interface shapes, or for a node from its own. **/
    FrameSums calcFrameSums(int frame, const Eigen::VectorXd& products,
                            const double* coordinates) const;
    double calcModalDisplacement(const double* modes) const;
    /** ξ of all the body's modes. **/
    const double* findXi(const double* q) const { return m_held.empty() ? q + 7 : m_held.data(); }

    const FlexibleBodySubsystem::Guts& m_guts;
    const FlexibleBodyRecord& m_record;
    const FlexibleBodyModel& m_model;
    int m_n;
    struct Constants {
        Eigen::VectorXd damping, inverseOmega;
    };
    std::shared_ptr<const Constants> m_constants;
    bool m_hasDampingCoupling = false;
    std::vector<int> m_stateQ, m_stateU;  ///< indices of ξ and ξ̇ in Simbody's vectors
    std::vector<double> m_held;           ///< zeros, one per held mode
    int m_stateFrameU = 0;
    size_t m_firstScale = 0;

    /** An interface with second-order motion: its shapes, and their tangent at ξ, used by its
    frames. **/
    struct Curve {
        std::shared_ptr<const FrameShapes> shapes;
        std::shared_ptr<FrameShapes> tangent;
        FrameSums atXi;
    };

    std::vector<FlexibleFrame> m_frames;
    std::vector<int> m_interfaces;  ///< of the part, for each frame; −1: a node, or curved
    std::vector<int> m_curveOf;     ///< for each frame; −1: none
    std::vector<Curve> m_curves;
    /** Φξ, Ψξ of all interfaces, their rates and accelerations. **/
    Eigen::VectorXd m_shapesXi, m_shapesXiDot, m_shapesXiDotDot;
    std::vector<FlexibleFramePose> m_poses;
    BodyFrame m_body;
    // Of the last residual.
    Eigen::Matrix3d m_I, m_IDot;
    Eigen::Vector3d m_CXiDot;
    Eigen::VectorXd m_xi;
    Eigen::VectorXd m_NXi;
    bool m_hasNXi = false;
    Eigen::VectorXd m_loads;  ///< modal forces of the body's loads; empty if it has none
};

}  // namespace simflex
