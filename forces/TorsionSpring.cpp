#include "simflex/forces/TorsionSpring.h"

#include "simflex/body/TurnState.h"
#include "simflex/forces/ElementParameters.h"

namespace simflex {

using namespace SimTK;

namespace {

class TorsionSpringElement : public ForceElement {
public:
    TorsionSpringElement(const Attachment& F, const Attachment& M, Real stiffness, Real damping,
                         Real freeAngle, int turns)
        : m_stiffness(stiffness), m_damping(damping), m_freeAngle(freeAngle), m_turns(turns) {
        m_attachments.push_back(F);
        m_attachments.push_back(M);
    }

    void addInForces(const ElementInputs& now, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        const Turn turn(frames);
        const Vec3 torque =
            -(m_stiffness * calcTwist(now, turn) + m_damping * turn.rate) * turn.direction;
        forces_G[0][0] -= torque;
        forces_G[1][0] += torque;
    }

    Real calcPotentialEnergy(const ElementInputs& now,
                             const Array_<FrameMotion>& frames) const override {
        return 0.5 * m_stiffness * square(calcTwist(now, Turn(frames)));
    }

    Real calcPower(const ElementInputs&, const Array_<FrameMotion>& frames,
                   const Array_<SpatialVec>&) const override {
        return -m_damping * square(Turn(frames).rate);
    }

    bool hasRange() const override { return true; }
    std::string describeOutOfRange(const Array_<FrameMotion>& frames, Real) const override {
        constexpr Real Nearest = 0.1;  // [rad]
        const Vec3 x = ~frames[0].X.R() * Vec3(frames[1].X.R().x());
        if (!(std::hypot(x[0], x[1]) < std::sin(Nearest))) return {};
        return "is tilted until the x axis of its second frame is along the z axis of the first, "
               "about which it then has no angle: its torque means nothing there";
    }

    int getNumJacobianTerms() const override { return 1; }

    void calcJacobian(const ElementInputs&, const Array_<FrameMotion>& frames, Real gamma,
                      Array_<Real>&, Array_<SpatialVec>& directions) const override {
        const Vec3 d = std::sqrt(gamma * m_stiffness + m_damping) * Turn(frames).direction;
        directions[0] = SpatialVec(-d, Vec3(0));
        directions[1] = SpatialVec(d, Vec3(0));
    }

private:
    struct Turn {
        explicit Turn(const Array_<FrameMotion>& frames) {
            // x of M in F = (a, b, c): θ = atan2(b, a), θ̇ = direction·ω in F.
            const Rotation& R_GF = frames[0].X.R();
            const Vec3 x = ~R_GF * Vec3(frames[1].X.R().x());
            const Real squared = square(x[0]) + square(x[1]);
            angle = std::atan2(x[1], x[0]);
            // M's x axis has no angle where it lies along F's z axis.
            direction = squared > 0 ? R_GF * Vec3(-x[2] * x[0] / squared, -x[2] * x[1] / squared, 1)
                                    : Vec3(0);
            rate = ~direction * (frames[1].V[0] - frames[0].V[0]);
        }
        Real angle, rate;
        Vec3 direction;  ///< ∂θ̇/∂ω, in Ground
    };

    /** θ − θ₀ **/
    Real calcTwist(const ElementInputs& now, const Turn& turn) const {
        return TurnState::followTurns(now.states[m_turns], turn.angle) - m_freeAngle;
    }

    Real m_stiffness, m_damping, m_freeAngle;
    int m_turns;  ///< number of the state that counts the turns
};

}  // namespace

TorsionSpring::TorsionSpring(FlexibleBodySubsystem& subsystem, const Attachment& F,
                             const Attachment& M, Real stiffness, Real damping, Real freeAngle,
                             const std::string& name) {
    const std::string who = nameElement("TorsionSpring", F, M, name);
    checkNotNegative(who, "stiffness", stiffness);
    checkNotNegative(who, "damping", damping);
    checkFinite(who, "free angle", freeAngle);
    const int turns = subsystem.adoptState(std::make_unique<TurnState>(
        "turns of force " + who, JointCoordinate::makeAngleAboutZ(), F, M, freeAngle));
    adoptNamed(subsystem,
               std::make_unique<TorsionSpringElement>(F, M, stiffness, damping, freeAngle, turns),
               name);
}

}  // namespace simflex
