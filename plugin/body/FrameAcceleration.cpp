#include "simflex/body/FrameAcceleration.h"

#include "simflex/body/FlexibleBodySubsystemGuts.h"

namespace simflex {

using namespace SimTK;

namespace {

FrameMotion calcFlexibleMotion(const FlexibleBodySubsystem::Guts& guts, const State& state,
                               const Vector& uDot, const SpatialVec& A_GB,
                               const Attachment& attachment) {
    const FlexibleBodyRecord& record = guts.body(attachment.getFlexibleBodyIndex());
    const Eigen::VectorXd xi = guts.getXi(state, record), xiDot = guts.getXiDot(state, record);
    std::vector<double> xiDotDot;
    for (const MobilizedBodyIndex carrier : record.carriers) {
        const MobilizedBody& mobod = guts.getMatter().getMobilizedBody(carrier);
        const int first = int(mobod.getFirstUIndex(state)), count = mobod.getNumU(state);
        for (int k = 0; k < count; ++k)
            xiDotDot.push_back(uDot.size() > 0 ? uDot[first + k] : Real(0));
    }
    const FrameAtXi frame(attachment.getFlexibleFrame(), xi.data(),
                          guts.getFrameOrder(state, record));
    const BodyFrame body = guts.getBodyFrame(state, record);
    FrameMotion motion = frame.calcMotion(body, xiDot.data());
    motion.A =
        frame.calcAcceleration(body, xiDot.data(), ~body.R_GB * A_GB[0], A_GB[1], xiDotDot.data());
    return motion;
}

}  // namespace

std::vector<FrameMotion> calcFrameMotions(const FlexibleBodySubsystem& subsystem,
                                          const State& state, const Vector& uDot,
                                          const std::vector<Attachment>& attachments) {
    const FlexibleBodySubsystem::Guts& guts = subsystem.getGuts();
    const SimbodyMatterSubsystem& matter = guts.getMatter();
    Vector_<SpatialVec> A_GB;
    matter.calcBodyAccelerationFromUDot(state, uDot, A_GB);
    std::vector<FrameMotion> motions;
    for (const Attachment& attachment : attachments) {
        const MobilizedBodyIndex index = attachment.getMobilizedBodyIndex();
        if (attachment.isFlexible()) {
            motions.push_back(calcFlexibleMotion(guts, state, uDot, A_GB[int(index)], attachment));
            continue;
        }
        const MobilizedBody& mobod = matter.getMobilizedBody(index);
        FrameMotion motion;
        motion.X = mobod.getBodyTransform(state);
        motion.V = mobod.getBodyVelocity(state);
        motion.A = A_GB[int(index)];
        motions.push_back(shiftMotion(motion, attachment.getFrame()));
    }
    return motions;
}

}  // namespace simflex
