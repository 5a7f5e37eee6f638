#include "simflex/forces/TwoPointSpringDamper.h"

#include "simflex/forces/ElementParameters.h"

namespace simflex {

using namespace SimTK;

namespace {

class SpringDamperElement : public ForceElement {
public:
    SpringDamperElement(const Attachment& first, const Attachment& second, Real stiffness,
                        Real damping, Real freeLength)
        : m_stiffness(stiffness), m_damping(damping), m_freeLength(freeLength) {
        m_attachments.push_back(first);
        m_attachments.push_back(second);
    }

    void addInForces(const ElementInputs&, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        const Line line(frames);
        const Vec3 pull =
            (m_stiffness * (line.length - m_freeLength) + m_damping * line.rate) * line.direction;
        forces_G[0][1] += pull;
        forces_G[1][1] -= pull;
    }

    Real calcPotentialEnergy(const ElementInputs&,
                             const Array_<FrameMotion>& frames) const override {
        return 0.5 * m_stiffness * square(Line(frames).length - m_freeLength);
    }

    Real calcPower(const ElementInputs&, const Array_<FrameMotion>& frames,
                   const Array_<SpatialVec>&) const override {
        return -m_damping * square(Line(frames).rate);
    }

    bool hasRange() const override { return m_freeLength > 0; }
    std::string describeOutOfRange(const Array_<FrameMotion>& frames, Real) const override {
        constexpr Real Coincident = 1e-6;  // of the free length
        if (!(Line(frames).length < Coincident * m_freeLength)) return {};
        return "has both ends in one place, where its force has no direction: place them apart";
    }

    /** Along the line, and across it since the pull turns with the line. **/
    int getNumJacobianTerms() const override { return 3; }

    void calcJacobian(const ElementInputs&, const Array_<FrameMotion>& frames, Real gamma,
                      Array_<Real>& signs, Array_<SpatialVec>& directions) const override {
        const Line line(frames);
        const Real tension = m_stiffness * (line.length - m_freeLength) + m_damping * line.rate;
        const Real across = line.length > 0 ? gamma * tension / line.length : 0;
        const Rotation axes(UnitVec3(line.length > 0 ? line.direction : Vec3(1, 0, 0)), XAxis);
        const Real factors[3] = {gamma * m_stiffness + m_damping, across, across};
        for (int i = 0; i < 3; ++i) {
            signs[i] = factors[i] < 0 ? -1 : 1;
            const Vec3 d = std::sqrt(std::abs(factors[i])) * Vec3(axes.col(i));
            directions[2 * i] = SpatialVec(Vec3(0), -d);
            directions[2 * i + 1] = SpatialVec(Vec3(0), d);
        }
    }

private:
    struct Line {
        explicit Line(const Array_<FrameMotion>& frames) {
            const Vec3 apart = frames[1].X.p() - frames[0].X.p();
            length = apart.norm();
            direction = length > 0 ? apart / length : Vec3(0);
            rate = ~direction * (frames[1].V[1] - frames[0].V[1]);
        }
        Real length, rate;
        Vec3 direction;  ///< from the first point to the second
    };

    Real m_stiffness, m_damping, m_freeLength;
};

}  // namespace

TwoPointSpringDamper::TwoPointSpringDamper(FlexibleBodySubsystem& subsystem,
                                           const Attachment& first, const Attachment& second,
                                           Real stiffness, Real damping, Real freeLength,
                                           const std::string& name) {
    const std::string who = nameElement("TwoPointSpringDamper", first, second, name);
    checkNotNegative(who, "stiffness", stiffness);
    checkNotNegative(who, "damping", damping);
    checkNotNegative(who, "free length", freeLength);
    adoptNamed(subsystem,
               std::make_unique<SpringDamperElement>(first, second, stiffness, damping, freeLength),
               name);
}

}  // namespace simflex
