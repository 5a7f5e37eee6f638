#include "simflex/body/ModalMobilizer.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace simflex {
namespace {

using namespace SimTK;

const Real Scale = std::ldexp(1.0, 40);
const Real CarrierMass = std::ldexp(1.0, -80);

class ModalImplementation : public MobilizedBody::Custom::Implementation {
public:
    ModalImplementation(SimbodyMatterSubsystem& matter, int numModes)
        : MobilizedBody::Custom::Implementation(matter, numModes, numModes) {}

    ModalImplementation* clone() const override { return new ModalImplementation(*this); }

    Transform calcMobilizerTransformFromQ(const State&, int, const Real*) const override {
        return Transform();
    }

    SpatialVec multiplyByHMatrix(const State&, int nu, const Real* u) const override {
        Real column[6] = {0, 0, 0, 0, 0, 0};
        std::transform(u, u + nu, column, [](Real value) { return Scale * value; });
        return {Vec3(column[0], column[1], column[2]), Vec3(column[3], column[4], column[5])};
    }

    void multiplyByHTranspose(const State&, const SpatialVec& F, int nu, Real* f) const override {
        for (int i = 0; i < nu; ++i) f[i] = Scale * F[i / 3][i % 3];
    }

    SpatialVec multiplyByHDotMatrix(const State&, int, const Real*) const override {
        return {Vec3(0), Vec3(0)};
    }

    void multiplyByHDotTranspose(const State&, const SpatialVec&, int nu, Real* f) const override {
        std::fill(f, f + nu, 0.0);
    }

    void setQToFitTransform(const State&, const Transform&, int nq, Real* q) const override {
        std::fill(q, q + nq, 0.0);
    }

    void setUToFitVelocity(const State&, const SpatialVec&, int nu, Real* u) const override {
        std::fill(u, u + nu, 0.0);
    }
};

ModalImplementation* makeImplementation(SimbodyMatterSubsystem& matter, int numModes) {
    if (numModes < 1 || numModes > ModalMobilizer::MaxModes)
        throw std::invalid_argument("a modal mobilizer carries 1 to 6 modes, not " +
                                    std::to_string(numModes));
    return new ModalImplementation(matter, numModes);
}

}  // namespace

ModalMobilizer::ModalMobilizer(SimbodyMatterSubsystem& matter, int numModes)
    : MobilizedBody::Custom(matter.Ground(), makeImplementation(matter, numModes), Transform(),
                            Body::Rigid(MassProperties(CarrierMass, Vec3(0), UnitInertia(1))),
                            Transform()) {}

}  // namespace simflex
