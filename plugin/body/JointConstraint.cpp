#include "simflex/body/JointConstraint.h"

#include <algorithm>

namespace simflex {

using namespace SimTK;

namespace {

/** One side of a joint, with the constraint's handles of its bodies and mobilizers. **/
struct Side {
    Attachment attachment;
    ConstrainedBodyIndex body;
    std::vector<MobilizedBodyIndex> carriers;
    int firstMode = 0;  ///< among the constrained q, which follow the order of the carriers
    int numModes = 0;
};

class JointImplementation : public Constraint::Custom::Implementation {
public:
    JointImplementation(const FlexibleBodySubsystem::Guts& guts, SimbodyMatterSubsystem& matter,
                        const JointRecord& joint)
        : Constraint::Custom::Implementation(matter, joint.equations->getNumEquations(), 0, 0),
          m_equations(joint.equations),
          m_subsystem(guts.getMySubsystemIndex()),
          m_index(int(guts.joints().size())) {
        for (const Attachment& frame : joint.frames)
            m_sides.push_back(makeSide(guts, matter, frame));
        // Including Ground makes it the ancestor frame, as JointEquations requires.
        addConstrainedBody(matter.Ground());
    }

    JointImplementation* clone() const override { return new JointImplementation(*this); }

protected:
    void realizeTopology(State& state) const override {
        m_drive = getMatterSubsystem().allocateLazyCacheEntry(state, Stage::Time,
                                                              new Value<DriveAtTime>());
    }

    void calcPositionErrors(const State& state, const Array_<Transform, ConstrainedBodyIndex>& X_AB,
                            const Array_<Real, ConstrainedQIndex>& q,
                            Array_<Real>& errors) const override {
        const Motions motions(m_sides, [&](const Side& side) {
            FrameMotion body;
            body.X = getBodyTransform(X_AB, side.body);
            const std::vector<Real> xi = pick(side, q);
            return calcMotion(state, side, body, xi, std::vector<Real>(xi.size(), 0));
        });
        m_equations->calcErrors(getDrive(state), motions.frames(), errors.begin());
    }

    void calcPositionDotErrors(const State& state,
                               const Array_<SpatialVec, ConstrainedBodyIndex>& V_AB,
                               const Array_<Real, ConstrainedQIndex>& qDot,
                               Array_<Real>& errors) const override {
        const Motions motions(m_sides, [&](const Side& side) {
            FrameMotion body;
            body.X = getBodyTransformFromState(state, side.body);
            body.V = getBodyVelocity(V_AB, side.body);
            return calcMotion(state, side, body, gatherXi(state, side), pick(side, qDot));
        });
        m_equations->calcErrorDots(getDrive(state), motions.frames(), errors.begin());
    }

    void calcPositionDotDotErrors(const State& state,
                                  const Array_<SpatialVec, ConstrainedBodyIndex>& A_AB,
                                  const Array_<Real, ConstrainedQIndex>& qDotDot,
                                  Array_<Real>& errors) const override {
        const Motions motions(m_sides, [&](const Side& side) {
            FrameMotion body;
            body.X = getBodyTransformFromState(state, side.body);
            body.V = getBodyVelocityFromState(state, side.body);
            body.A = getBodyAcceleration(A_AB, side.body);
            const std::vector<Real> xiDotDot = pick(side, qDotDot);
            return calcMotion(state, side, body, gatherXi(state, side),
                              gather(state, side, getMatterSubsystem().getQDot(state)), &xiDotDot);
        });
        m_equations->calcErrorDotDots(getDrive(state), motions.frames(), errors.begin());
    }

    void addInPositionConstraintForces(const State& state, const Array_<Real>& multipliers,
                                       Array_<SpatialVec, ConstrainedBodyIndex>& bodyForces,
                                       Array_<Real, ConstrainedQIndex>& qForces) const override {
        const Motions motions(m_sides, [&](const Side& side) {
            FrameMotion body;
            body.X = getBodyTransformFromState(state, side.body);
            const std::vector<Real> xi = gatherXi(state, side);
            return calcMotion(state, side, body, xi, std::vector<Real>(xi.size(), 0));
        });
        const size_t rows = size_t(m_equations->getNumEquations());
        std::vector<SpatialVec> D(m_sides.size() * rows);
        m_equations->calcJacobian(getDrive(state), motions.frames(), D.data());
        for (size_t side = 0; side < m_sides.size(); ++side) {
            SpatialVec force(Vec3(0), Vec3(0));
            for (size_t k = 0; k < rows; ++k) force += multipliers[int(k)] * D[side * rows + k];
            addInSideForce(state, m_sides[side], force, bodyForces, qForces);
        }
    }

private:
    struct DriveAtTime {
        Real time = NaN;
        JointEquations::Drive drive;
    };

    /** Cached in the State until its time changes. **/
    const JointEquations::Drive& getDrive(const State& state) const {
        const SimbodyMatterSubsystem& matter = getMatterSubsystem();
        // Simbody 3.7 treats the cache entry as current in a copy of a State whose time was set
        // last.
        auto& kept = Value<DriveAtTime>::updDowncast(matter.updCacheEntry(state, m_drive)).upd();
        if (!matter.isCacheValueRealized(state, m_drive) || kept.time != state.getTime() ||
            m_equations->isLock()) {
            const Subsystem& subsystem = matter.getSystem().getSubsystem(m_subsystem);
            kept.drive =
                dynamic_cast<const FlexibleBodySubsystem::Guts&>(subsystem.getSubsystemGuts())
                    .calcDrive(state, m_index);
            kept.time = state.getTime();
            matter.markCacheValueRealized(state, m_drive);
        }
        return kept.drive;
    }

    /** Motions of all sides. **/
    class Motions {
    public:
        template <class CalcMotion>
        Motions(const std::vector<Side>& sides, CalcMotion calc) {
            for (const Side& side : sides) m_motions.push_back(calc(side));
            for (const FrameMotion& motion : m_motions) m_frames.push_back(&motion);
        }
        JointEquations::Frames frames() const { return m_frames.data(); }

    private:
        std::vector<FrameMotion> m_motions;
        std::vector<const FrameMotion*> m_frames;
    };

    Side makeSide(const FlexibleBodySubsystem::Guts& guts, SimbodyMatterSubsystem& matter,
                  const Attachment& attachment) {
        Side side{attachment,
                  addConstrainedBody(matter.getMobilizedBody(attachment.getMobilizedBodyIndex())),
                  {},
                  0,
                  0};
        if (!attachment.isFlexible()) return side;
        const FlexibleBodyRecord& body = guts.body(attachment.getFlexibleBodyIndex());
        // Only the first of several sides on a body adds its modes.
        const auto known = std::find_if(m_sides.begin(), m_sides.end(), [&](const Side& other) {
            return other.attachment.isFlexible() &&
                   other.attachment.getFlexibleBodyIndex() == attachment.getFlexibleBodyIndex();
        });
        side.carriers = body.carriers;
        side.numModes = body.numModes();
        side.firstMode = known == m_sides.end() ? m_numModes : known->firstMode;
        if (known != m_sides.end()) return side;
        for (MobilizedBodyIndex carrier : body.carriers)
            addConstrainedMobilizer(matter.getMobilizedBody(carrier));
        m_numModes += side.numModes;
        return side;
    }

    /** Returns the side's modes from all constrained coordinates. **/
    static std::vector<Real> pick(const Side& side, const Array_<Real, ConstrainedQIndex>& values) {
        const Real* const first = values.cbegin() + side.firstMode;
        return std::vector<Real>(first, first + side.numModes);
    }

    /** Returns the side's modes from all coordinates of the State. **/
    std::vector<Real> gather(const State& state, const Side& side, const Vector& values) const {
        if (side.numModes == 0) return {};
        const SimbodyMatterSubsystem& matter = getMatterSubsystem();
        const MobilizedBody& last = matter.getMobilizedBody(side.carriers.back());
        const int begin = matter.getMobilizedBody(side.carriers.front()).getFirstQIndex(state);
        const int end = last.getFirstQIndex(state) + last.getNumQ(state);
        // They are usually contiguous.
        if (end - begin == side.numModes)
            return std::vector<Real>(&values[begin], &values[begin] + side.numModes);
        std::vector<Real> gathered;
        gathered.reserve(size_t(side.numModes));
        for (const MobilizedBodyIndex carrier : side.carriers) {
            const MobilizedBody& mobod = matter.getMobilizedBody(carrier);
            const int first = int(mobod.getFirstQIndex(state)), count = mobod.getNumQ(state);
            for (int k = 0; k < count; ++k) gathered.push_back(values[first + k]);
        }
        return gathered;
    }

    std::vector<Real> gatherXi(const State& state, const Side& side) const {
        return gather(state, side, getMatterSubsystem().getQ(state));
    }

    /** Motion of the side's frame from that of its body; with accelerations if `xiDotDot` is
    given. **/
    static FrameMotion calcMotion(const State& state, const Side& side, const FrameMotion& body,
                                  const std::vector<Real>& xi, const std::vector<Real>& xiDot,
                                  const std::vector<Real>* xiDotDot = nullptr) {
        if (!side.attachment.isFlexible()) return shiftMotion(body, side.attachment.getFrame());
        const FrameAtXi frame(side.attachment.getFlexibleFrame(), xi.data(),
                              side.attachment.getFrameOrder(state));
        const BodyFrame bodyFrame{body.X.R(), body.X.p(), ~body.X.R() * body.V[0], body.V[1]};
        FrameMotion motion = frame.calcMotion(bodyFrame, xiDot.data());
        if (xiDotDot)
            motion.A = frame.calcAcceleration(bodyFrame, xiDot.data(), ~body.X.R() * body.A[0],
                                              body.A[1], xiDotDot->data());
        return motion;
    }

    void addInSideForce(const State& state, const Side& side, const SpatialVec& force,
                        Array_<SpatialVec, ConstrainedBodyIndex>& bodyForces,
                        Array_<Real, ConstrainedQIndex>& qForces) const {
        const Rotation& R = getBodyRotationFromState(state, side.body);
        if (!side.attachment.isFlexible()) {
            const Vec3 r = R * side.attachment.getFrame().p();
            bodyForces[side.body] += SpatialVec(force[0] + r % force[1], force[1]);
            return;
        }
        const std::vector<Real> xi = gatherXi(state, side);
        const FrameAtXi frame(side.attachment.getFlexibleFrame(), xi.data(),
                              side.attachment.getFrameOrder(state));
        std::vector<Real> modal(side.numModes, 0);
        Vec3 torque_B(0), force_G(0);
        addInFrameForce(frame.getTangent(), frame.getPose(), R, force, torque_B, force_G,
                        modal.data());
        bodyForces[side.body] += SpatialVec(R * torque_B, force_G);
        for (int i = 0; i < side.numModes; ++i)
            qForces[ConstrainedQIndex(side.firstMode + i)] += modal[size_t(i)];
    }

    std::shared_ptr<const JointEquations> m_equations;
    SubsystemIndex m_subsystem;
    JointIndex m_index;
    std::vector<Side> m_sides;
    int m_numModes = 0;  ///< of all sides
    mutable CacheEntryIndex m_drive;
};

}  // namespace

ConstraintIndex addJointConstraint(const FlexibleBodySubsystem::Guts& guts,
                                   SimbodyMatterSubsystem& matter, const JointRecord& joint) {
    return Constraint::Custom(new JointImplementation(guts, matter, joint)).getConstraintIndex();
}

}  // namespace simflex
