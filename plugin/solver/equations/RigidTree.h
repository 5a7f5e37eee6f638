#pragma once
/** @file
A tree of ordinary Simbody bodies rooted at Ground, or several of them between which forces may
act, as one block of the Newton system (private header).

q and u are Simbody's own. Weld, Pin, Slider, Cylinder, Screw, Universal, Planar, BendStretch,
Gimbal, Bushing, Translation, Ball and Free mobilizers are evaluated by simflex's own recursion,
which is checked against Simbody once; a tree with any other mobilizer (reversed, custom, …) takes
poses and Jacobians from Simbody. q̇ = N(q)u is evaluated here for all of Simbody's mobilizers;
custom ones with their own N use Simbody.

    A_B = shift(A_P) + H_B u̇_B + bias,   r = Σ_B J_Bᵀ F_inertial(A_B),   M = Σ_B J_Bᵀ M_B J_B

J_B, the columns H of B and its ancestors shifted to B's origin, is never formed: accelerations
propagate outwards and forces inwards in O(n), M follows from composite bodies in O(n·depth), and
the derivatives of r with respect to u and q are known body by body (RigidTreeTangent.cpp). **/

#include <optional>

#include "Simbody.h"
#include "simflex/solver/equations/Block.h"

namespace simflex {

class RigidTree : public Block {
public:
    /** Builds the tree of base bodies (children of Ground) and everything outboard of them.
    @param state  realized to Stage::Velocity
    @throws std::invalid_argument if a mobilizer's speeds are not the rates of its positions **/
    RigidTree(const SimTK::SimbodyMatterSubsystem& matter,
              const std::vector<SimTK::MobilizedBodyIndex>& roots, const SimTK::State& state);

    /** Adds a frame X_BF on one of the tree's bodies; returns its index in `frames`. **/
    int addFrame(SimTK::MobilizedBodyIndex body, const SimTK::Transform& X_BF);

    bool contains(SimTK::MobilizedBodyIndex body) const;

    /** Indices of a body's coordinates and speeds in the block. **/
    struct Slots {
        int q0, nq, u0, nu;
    };
    Slots findSlots(SimTK::MobilizedBodyIndex body) const;

    /** True if poses and Jacobians come from Simbody, so that realize() needs
    EvaluationContext::state. **/
    bool needsSimbody() const { return m_needsSimbody; }
    /** True if the Newton block can have the exact derivatives of all forces in calcResidual(). **/
    bool knowsDerivatives() const { return !m_needsSimbody; }

    /** Writes q and u of this block into Simbody's vectors. **/
    void putSpeeds(const double* u, SimTK::Vector& stateU) const;
    void putCoordinates(const double* q, const double* u, SimTK::Vector& stateQ,
                        SimTK::Vector& stateU) const;

    std::string describeSpeed(int speed) const override;
    std::string describeCoordinate(int coordinate) const override;
    void realize(const EvaluationContext& context, const double* q, const double* u) override;
    void calcResidual(const EvaluationContext& context, const double* q, const double* u,
                      const double* uDot, double* r) override;
    void subtractForce(int frame, const SimTK::SpatialVec& F_G, double* r) const override;
    void subtractSimbodyForces(const SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                               const SimTK::Vector& mobilityForces, double* r) override;
    void addInRow(int frame, const SimTK::SpatialVec& d, double* row) const override;
    SimTK::SpatialVec calcFrameAcceleration(int frame, const double* u,
                                            const double* uDot) const override;
    void formNewtonBlock(const NewtonFactors& factors, BlockDerivatives derivatives,
                         const EvaluationContext& context, const double* q, const double* u,
                         const double* uDot, NewtonSystem::Block& block) override;
    void formMassBlock(NewtonSystem::Block& block) override;
    /** Writes M by bodies, at the realized point. **/
    void formInertia(BasicTreeMatrix<double>& tree) const;
    void integrateQ(const EvaluationContext& context, const double* qHist, double gamma,
                    const double* u, double* q) const override;
    void calcQDot(const EvaluationContext& context, const double* q, const double* u,
                  double* qDot) const override;
    void displaceQ(const EvaluationContext& context, const double* delta, double* q) const override;
    void moveQ(const EvaluationContext& context, const double* delta, double* q) const override;
    /** True if N(q) of some mobilizer comes from Simbody. **/
    bool asksForN() const { return m_hasUnknownTurning; }
    void followPose() override;
    void visit(Checkpoint& checkpoint) override;
    /** Writes N W N⁺ δq, a coordinate difference weighted by Simbody's weights W of the speeds.
    Where only Simbody knows N, the largest weight of a mobilizer is used for all its coordinates.
    **/
    void weighQ(const double* q, const double* uWeights, const double* deltaQ,
                double* weighed) const;
    /** Copies this block's part of a vector over Simbody's speeds. **/
    void takeSpeeds(const SimTK::Vector& simbody, double* u) const;
    void turnAlong(const double* fromQ, const double* toQ, double* u) const override;
    bool isUsable(const double* q, const double* u) const override;
    void normalizeQ(double* q) const override;
    void alignQ(const double* reference, double* q) const override;
    double calcDisplacement(const double* delta) const override;
    void getDisplacements(double* ofSpeeds) const override;
    double calcQDisplacement(const double* deltaQ) const override;
    double calcUDisplacement(const double* deltaU, double h) const override;
    /** Coordinates and speeds of one base body and its outboard bodies, in the block. **/
    struct Root {
        int firstQ, numQ, firstU, numU;
    };
    const std::vector<Root>& getRoots() const { return m_roots; }
    /** The same for the bodies of one root. **/
    double calcDisplacement(const Root& root, const double* delta) const;
    double calcQDisplacement(const Root& root, const double* deltaQ) const;
    double calcDampingPower(const double*) const override { return 0; }
    void getFromState(const SimTK::State& state, double* q, double* u) const override;
    void putIntoState(const double* q, const double* u, SimTK::State& state) const override;
    void putUDot(const double* q, const double* uDot, SimTK::Vector& simbodyUDot) const override;

private:
    static constexpr int LargestNumQ = 7;  ///< of one mobilizer

    enum class Mobilizer {
        Weld,
        Pin,
        Slider,
        Cylinder,
        Screw,
        Universal,
        Planar,
        BendStretch,
        Gimbal,
        Bushing,
        Translation,
        Ball,
        Free,
        Other
    };
    /** Meaning of the first coordinates of a mobilizer; the others have q̇ = u. **/
    enum class Turning {
        None,               ///< q̇ = u throughout
        Quaternion,         ///< 4 q; 3 u: ω of M in F, expressed in F
        LineQuaternion,     ///< 4 q; 2 u: ω_x, ω_y expressed in M
        BodyXYZ,            ///< 3 q, body-fixed angles; u as for Quaternion
        LineBodyXYZ,        ///< 3 q; u as for LineQuaternion
        KnownToSimbodyOnly  ///< N(q) comes from Simbody
    };

    struct RigidBody {
        SimTK::MobilizedBodyIndex index;
        int parent = -1;  ///< position in m_bodies; −1: Ground
        Mobilizer mobilizer = Mobilizer::Other;
        Turning turning = Turning::None;
        SimTK::Transform X_PF, X_MB;
        SimTK::Real pitch = 0;  ///< of a Screw [m/rad]
        SimTK::MassProperties mass;
        int q0 = 0, nq = 0, u0 = 0, nu = 0;  ///< in the block
        int stateQ0 = 0, stateU0 = 0;        ///< in Simbody's vectors

        SimTK::Transform X_GB;
        SimTK::SpatialVec V, biasA;
        SimTK::SpatialVec H[6];  ///< (ω, v) of B's origin in Ground per speed of its mobilizer
    };

    /** A body with everything outboard of it rigidly attached, about its origin, in Ground. **/
    struct Composite {
        SimTK::Real mass = 0;
        SimTK::Vec3 moment{0};  ///< mass times centre of mass
        SimTK::Mat33 inertia{0};
    };

    struct Frame {
        int body;
        SimTK::Transform X_BF;
    };

    /** @name Derivatives: equations in RigidTreeTangent.cpp **/
    /**@{**/
    /** Quantities of a body about a point at rest. **/
    struct BodyTangent {
        SimTK::Vec3 reference{0};  ///< that point
        SimTK::SpatialVec V, A;
        SimTK::Real mass = 0;  ///< I: mass, first moment of mass, and inertia
        SimTK::Vec3 moment{0};
        SimTK::Mat33 inertia{0};
        SimTK::Mat33 gyration{0};  ///< D: moments; forces are −2 momentum × ν
        SimTK::Vec3 momentum{0};
        SimTK::Mat33 byGravity{0};  ///< I (· × g): moments; forces are −weight × ω
        SimTK::Vec3 weight{0};
        SimTK::SpatialVec force;  ///< F, including all outboard bodies
    };
    struct SpeedTangent {
        SimTK::SpatialVec S, alpha, beta;
        SimTK::Vec3 nu{0};  ///< angular part
    };
    struct ScrewRates;
    static void calcScrewRates(const RigidBody& body, const double* q, const double* u,
                               ScrewRates& rates);
    /** Transforms a screw of a body's mobilizer from F's axes and origin to Ground's axes and the
    reference point. **/
    SimTK::SpatialVec carryFromF(const RigidBody& body, const SimTK::SpatialVec& screw) const;
    void calcTangents(const EvaluationContext& context, const double* q, const double* u,
                      const double* uDot);
    void sizeTree(BasicTreeMatrix<double>& tree) const;
    void formTangent(const NewtonFactors& factors, const EvaluationContext& context,
                     const double* q, const double* u, const double* uDot,
                     BasicTreeMatrix<double>& tree);
    /**@}**/

    static Mobilizer classify(const SimTK::MobilizedBody& mobod);
    static bool hasQuaternion(const RigidBody& body) {
        return body.turning == Turning::Quaternion || body.turning == Turning::LineQuaternion;
    }
    static int numTurningQ(const RigidBody& body) {
        return hasQuaternion(body) ? 4 : body.turning == Turning::None ? 0 : 3;
    }
    static int numTurningU(const RigidBody& body) {
        return numTurningQ(body) - (body.nq - body.nu);
    }
    /** Multiplies by N(q) of a body, according to its turning. **/
    static void multiplyByN(const RigidBody& body, const double* q, const double* u, double* qDot);
    /** All of Simbody's q̇ = N u, N at the State's q; empty if every turning is known here. **/
    std::optional<SimTK::Vector> askForQDot(const EvaluationContext& context,
                                            const double* u) const;
    /** @throws std::invalid_argument if a mobilizer's speeds are not the rates of its
    positions. **/
    void checkVelocities(const SimTK::SimbodyMatterSubsystem& matter,
                         const SimTK::State& state) const;
    /** Classifies each body's q and u by comparison with Simbody's N at an arbitrary state. **/
    void classifyTurning(const SimTK::SimbodyMatterSubsystem& matter, const SimTK::State& state);
    void addBody(const SimTK::SimbodyMatterSubsystem& matter, SimTK::MobilizedBodyIndex index,
                 int parent, const SimTK::State& state);
    bool agreesWithSimbody(const SimTK::SimbodyMatterSubsystem& matter, const SimTK::State& state);
    /** Computes each speed's weight: the largest displacement it causes at a body's centre of mass
    or radius of gyration. **/
    void calcWeights();
    void realizeBody(RigidBody& body, const double* q, const double* u) const;
    void realizeBodyFromSimbody(RigidBody& body, const SimTK::State& state) const;
    /** (ω̇, v̇) of one body's origin, without those of the others. **/
    SimTK::SpatialVec calcAcceleration(int body, const double* uDot) const;
    /** Writes factor·M. **/
    void formMassMatrix(double factor, NewtonSystem::Block& block);
    /** r += Jᵀ F for a force at one body's origin. **/
    void addInTransposed(int body, const SimTK::SpatialVec& F_G, double* r) const;
    /** The same for m_forces at all bodies' origins; overwrites them. **/
    void addInForces(double* r);
    /** displaceQ() for one body whose N(q) is known here. **/
    void displaceQ(const RigidBody& body, const double* delta, double* q) const;

    /** "speed 2 of 6 of mobilized body 3". **/
    std::string describe(const char* what, int index, int RigidBody::*first,
                         int RigidBody::*count) const;

    const SimTK::SimbodyMatterSubsystem& m_matter;
    std::vector<RigidBody> m_bodies;
    std::vector<Root> m_roots;
    std::vector<Frame> m_frameData;
    std::vector<Composite> m_composites;
    std::vector<SimTK::SpatialVec> m_forces, m_motions;  ///< by body, within one pass
    std::vector<BodyTangent> m_tangents;
    std::vector<SpeedTangent> m_speedTangents;
    std::vector<double> m_treeWorkspace;
    bool m_needsSimbody = false;
    bool m_hasUnknownTurning = false;
    Eigen::VectorXd
        m_uWeights;  ///< metres of displacement per unit of each speed's quasi-coordinate
    Eigen::VectorXd m_qWeights;
    int m_stepsBetweenWeights = 1, m_stepsSinceWeights = 0;
};

}  // namespace simflex
