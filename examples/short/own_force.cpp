// A user-defined force element: air drag at a frame of any body, with its terms of the Newton
// matrix.
#include "Simbody.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/ForceElement.h"
#include "simflex/solver/RadauIntegrator.h"
using namespace SimTK;
using namespace simflex;

/** F = −c |v| v at the attachment's origin. **/
class Drag : public ForceElement {
public:
    Drag(const Attachment& frame, Real c) : m_c(c) { m_attachments.push_back(frame); }

    void addInForces(const ElementInputs&, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        const Vec3& v = frames[0].V[1];
        forces_G[0][1] -= m_c * v.norm() * v;
    }

    // −∂F/∂v = c |v| (1 + n nᵀ) with n along v: a term for each axis, and one along n.
    int getNumJacobianTerms() const override { return 4; }
    void calcJacobian(const ElementInputs&, const Array_<FrameMotion>& frames, Real, Array_<Real>&,
                      Array_<SpatialVec>& directions) const override {
        const Vec3& v = frames[0].V[1];
        const Real root = std::sqrt(m_c * v.norm());
        for (int axis = 0; axis < 3; ++axis) {
            directions[axis] = SpatialVec(Vec3(0), Vec3(0));
            directions[axis][1][axis] = root;
        }
        directions[3] =
            SpatialVec(Vec3(0), v.norm() > 0 ? Vec3(std::sqrt(m_c / v.norm()) * v) : Vec3(0));
    }

private:
    Real m_c;  // [kg/m]
};

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Slider sled(matter.Ground(),
                               Body::Rigid(MassProperties(2, Vec3(0), UnitInertia(1))));
    flexible.adoptForceElement(std::make_unique<Drag>(Attachment(sled), 0.5));

    State state = system.realizeTopology();
    sled.setRate(state, 10);
    RadauIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(1);
    // v = v₀/(1 + c v₀ t/m)
    std::printf("%.3f m/s, exactly %.3f\n", sled.getRate(integrator.getState()), 10 / 3.5);
}
