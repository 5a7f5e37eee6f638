#include "simflex/forces/ContactStop.h"

#include "simflex/forces/ElementParameters.h"

namespace simflex {

using namespace SimTK;

namespace {

class ContactStopElement : public ForceElement {
public:
    ContactStopElement(const Attachment& F, const Attachment& M, Real stiffness, Real dissipation)
        : m_stiffness(stiffness), m_dissipation(dissipation) {
        m_attachments.push_back(F);
        m_attachments.push_back(M);
    }

    void addInForces(const ElementInputs&, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        const Touch touch(frames);
        const Vec3 push = calcForce(touch) * touch.normal;
        forces_G[1][1] += push;
        forces_G[0] -= SpatialVec(touch.apart % push, push);
    }

    Real calcPotentialEnergy(const ElementInputs&,
                             const Array_<FrameMotion>& frames) const override {
        return 0.5 * m_stiffness * square(std::max(Real(0), Touch(frames).depth));
    }

    Real calcPower(const ElementInputs&, const Array_<FrameMotion>& frames,
                   const Array_<SpatialVec>&) const override {
        const Touch touch(frames);
        return -(calcForce(touch) - m_stiffness * std::max(Real(0), touch.depth)) * touch.rate;
    }

    int getNumJacobianTerms() const override { return 1; }

    void calcJacobian(const ElementInputs&, const Array_<FrameMotion>& frames, Real gamma,
                      Array_<Real>& signs, Array_<SpatialVec>& directions) const override {
        const Touch touch(frames);
        Real factor = 0;
        if (calcForce(touch) > 0)
            factor = m_stiffness *
                     (gamma * (1 + m_dissipation * touch.rate) + m_dissipation * touch.depth);
        signs[0] = factor < 0 ? -1 : 1;
        const Vec3 d = std::sqrt(std::abs(factor)) * touch.normal;
        directions[0] = SpatialVec(-(touch.apart % d), -d);
        directions[1] = SpatialVec(Vec3(0), d);
    }

private:
    struct Touch {
        explicit Touch(const Array_<FrameMotion>& frames)
            : normal(frames[0].X.R().z()), apart(frames[1].X.p() - frames[0].X.p()) {
            depth = -(~normal * apart);
            rate = -(~normal * (frames[1].V[1] - frames[0].V[1] - frames[0].V[0] % apart));
        }
        Vec3 normal, apart;
        Real depth, rate;
    };

    Real calcForce(const Touch& touch) const {
        if (touch.depth <= 0) return 0;
        return std::max(Real(0), m_stiffness * touch.depth * (1 + m_dissipation * touch.rate));
    }

    Real m_stiffness, m_dissipation;
};

}  // namespace

ContactStop::ContactStop(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                         Real stiffness, Real dissipation, const std::string& name) {
    const std::string who = nameElement("ContactStop", F, M, name);
    checkNotNegative(who, "stiffness", stiffness);
    checkNotNegative(who, "dissipation", dissipation);
    if (stiffness == 0) throw std::invalid_argument(who + ": stiffness is zero");
    adoptNamed(subsystem, std::make_unique<ContactStopElement>(F, M, stiffness, dissipation), name);
}

}  // namespace simflex
