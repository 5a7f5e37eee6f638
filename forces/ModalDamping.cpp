#include "simflex/forces/ModalDamping.h"

#include <cmath>

#include "simflex/body/ForceElement.h"

namespace simflex {

using namespace SimTK;

namespace {

class Element : public ForceElement {
public:
    Element(FlexibleBodyIndex body, Array_<Real> coefficients)
        : m_body(body), m_coefficients(std::move(coefficients)) {}

    void addInModalDamping(FlexibleBodyIndex body, Array_<Real>& damping) const override {
        if (body != m_body) return;
        for (unsigned i = 0; i < damping.size(); ++i) damping[i] += m_coefficients[i];
    }

private:
    FlexibleBodyIndex m_body;
    Array_<Real> m_coefficients;
};

}  // namespace

ModalDamping::ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body, Real ratio)
    : ModalDamping(subsystem, body, Vector(body.getNumModes(), ratio)) {}

ModalDamping::ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                           const Vector& ratios) {
    const ReducedBody& part = body.getPart();
    if (ratios.size() != part.numModes)
        throw std::invalid_argument("ModalDamping of '" + body.getName() +
                                    "': " + std::to_string(ratios.size()) + " ratios for " +
                                    std::to_string(part.numModes) + " modes");
    Array_<Real> coefficients;
    for (int i = 0; i < ratios.size(); ++i) {
        if (!(ratios[i] >= 0) || !std::isfinite(ratios[i]))
            throw std::invalid_argument("ModalDamping of '" + body.getName() +
                                        "': the ratio of mode " + std::to_string(i + 1) + " is " +
                                        std::to_string(ratios[i]) + ", must be 0 or more");
        coefficients.push_back(2 * ratios[i] * std::sqrt(part.omegaSquared[i]));
    }
    subsystem.adoptForceElement(
        std::make_unique<Element>(body.getIndex(), std::move(coefficients)));
}

}  // namespace simflex
