// The planar slider-crank that SUNDIALS' IDA solves in stabilised index-2 form, rebuilt with rigid
// bodies and joints.
//
// Crank 0.5 m, rotating about the origin; rod 1 m, between the crank's pin and a block that slides
// along x. The rod's centre of mass is at the block; moments of inertia 1 and 2 kg m², 1 kg for rod
// and block together. A spring (1 N/m, free length 1 m) with a damper (1 N s/m) between the
// midpoints of crank and rod; a constant force of 1 N along x on the rod, 1 m beyond the block
// (consistent with the example's generalized force −F sin p on the rod's angle). Initially at rest,
// crank upright.

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/solver/BdfIntegrator.h"

namespace simflex {
namespace {

using namespace SimTK;

constexpr Real CrankLength = 0.5, RodLength = 1;

/** A row of IDA's table. **/
struct Line {
    Real time, crank, block, rod;  // [s], [rad], [m], [rad]
};

// SUNDIALS 6.4.1, examples/ida/serial/idaSlCrank_dns.out: columns t, y1, y2, y3, as printed.
constexpr Line Table[] = {
    {0.25, 1.5548e+00, 8.7406e-01, -5.2352e-01}, {0.50, 1.5069e+00, 8.9855e-01, -5.2242e-01},
    {0.75, 1.4270e+00, 9.4063e-01, -5.1765e-01}, {1.00, 1.3154e+00, 1.0015e+00, -5.0497e-01},
    {1.25, 1.1731e+00, 1.0811e+00, -4.7909e-01}, {1.50, 1.0016e+00, 1.1765e+00, -4.3472e-01},
    {1.75, 8.0288e-01, 1.2804e+00, -3.6792e-01}, {2.00, 5.7904e-01, 1.3803e+00, -2.7715e-01},
    {2.25, 3.3326e-01, 1.4590e+00, -1.6430e-01}, {2.50, 7.2238e-02, 1.4980e+00, -3.6096e-02},
    {2.75, -1.9245e-01, 1.4862e+00, 9.5777e-02}, {3.00, -4.4711e-01, 1.4272e+00, 2.1790e-01},
    {3.25, -6.8090e-01, 1.3377e+00, 3.2019e-01}, {3.50, -8.8750e-01, 1.2374e+00, 3.9819e-01},
    {3.75, -1.0634e+00, 1.1424e+00, 4.5228e-01}, {4.00, -1.2064e+00, 1.0623e+00, 4.8609e-01},
    {4.25, -1.3150e+00, 1.0017e+00, 5.0491e-01}, {4.50, -1.3883e+00, 9.6149e-01, 5.1404e-01},
    {4.75, -1.4265e+00, 9.4088e-01, 5.1761e-01}, {5.00, -1.4300e+00, 9.3903e-01, 5.1790e-01},
    {5.25, -1.3992e+00, 9.5560e-01, 5.1514e-01}, {5.50, -1.3346e+00, 9.9087e-01, 5.0765e-01},
    {5.75, -1.2371e+00, 1.0451e+00, 4.9204e-01}, {6.00, -1.1080e+00, 1.1176e+00, 4.6386e-01},
    {6.25, -9.4916e-01, 1.2048e+00, 4.1858e-01}, {6.50, -7.6277e-01, 1.2999e+00, 3.5273e-01},
    {6.75, -5.5125e-01, 1.3910e+00, 2.6497e-01}, {7.00, -3.1828e-01, 1.4626e+00, 1.5711e-01},
    {7.25, -7.0713e-02, 1.4981e+00, 3.5334e-02}, {7.50, 1.8041e-01, 1.4879e+00, -8.9839e-02},
    {7.75, 4.2223e-01, 1.4349e+00, -2.0636e-01}, {8.00, 6.4422e-01, 1.3536e+00, -3.0500e-01},
    {8.25, 8.3984e-01, 1.2619e+00, -3.8145e-01}, {8.50, 1.0053e+00, 1.1745e+00, -4.3582e-01},
    {8.75, 1.1380e+00, 1.1008e+00, -4.7113e-01}, {9.00, 1.2363e+00, 1.0456e+00, -4.9189e-01},
    {9.25, 1.2992e+00, 1.0105e+00, -5.0257e-01}, {9.50, 1.3266e+00, 9.9533e-01, -5.0655e-01},
    {9.75, 1.3185e+00, 9.9977e-01, -5.0542e-01}, {10.00, 1.2757e+00, 1.0236e+00, -4.9881e-01},
};

/** Returns the uncertainty of a printed value: half a unit of its fifth digit, and 1e-5 for IDA's
own error (its tolerance is 1e-6 per step; the mechanism's single equation in the crank's angle,
solved to 1e-12, differs from the table by half a unit and at most 5e-6 more). **/
Real allowance(Real printed) {
    return 0.5e-4 * std::pow(10, std::floor(std::log10(std::abs(printed)))) + 1e-5;
}

/** Assembly of the mechanism. **/
enum class Assembly {
    FreeBodies,     ///< three free bodies, three pins and a slide: 20 equations, 17 independent
    ClosedByAPin,   ///< two trees, one pin between them: 5 equations, 2 independent
    ClosedByABall,  ///< two trees, one ball between them: 3 equations, 2 independent
};

class SliderCrank {
public:
    explicit SliderCrank(Assembly assembly)
        : m_matter(m_system), m_forces(m_system), m_flexible(m_system, m_matter) {
        // Only the moments about z matter; the others are arbitrary and nonzero.
        const Body::Rigid crankBody(MassProperties(1, Vec3(0), Inertia(0.5, 0.8, 1)));
        const Body::Rigid rodBody(MassProperties(0.6, Vec3(0), Inertia(1.2, 1.5, 2)));
        const Body::Rigid blockBody(MassProperties(0.4, Vec3(0), Inertia(0.1, 0.1, 0.1)));
        const MobilizedBody& ground = m_matter.Ground();
        if (assembly == Assembly::FreeBodies) {
            m_crank = MobilizedBody::Free(m_matter.Ground(), crankBody);
            m_rod = MobilizedBody::Free(m_matter.Ground(), rodBody);
            m_block = MobilizedBody::Free(m_matter.Ground(), blockBody);
            Joint::Pin(m_flexible, ground, m_crank, "bearing");
            Joint::Pin(m_flexible, m_block, m_rod, "gudgeon pin");
            Joint::Slider(m_flexible, ground, m_block, "guide");
        } else {
            m_crank = MobilizedBody::Pin(m_matter.Ground(), crankBody);
            m_block = MobilizedBody::Slider(m_matter.Ground(), blockBody);
            m_rod = MobilizedBody::Pin(m_block, rodBody);
        }
        const Attachment pin(m_crank, Transform(Vec3(CrankLength, 0, 0)));
        const Attachment bigEnd(m_rod, Transform(Vec3(-RodLength, 0, 0)));
        if (assembly == Assembly::ClosedByABall)
            Joint::Ball(m_flexible, pin, bigEnd, "crank pin");
        else
            Joint::Pin(m_flexible, pin, bigEnd, "crank pin");

        const Vec3 middleOfCrank(CrankLength / 2, 0, 0), middleOfRod(-RodLength / 2, 0, 0);
        Force::TwoPointLinearSpring(m_forces, m_crank, middleOfCrank, m_rod, middleOfRod, 1, 1);
        Force::TwoPointLinearDamper(m_forces, m_crank, middleOfCrank, m_rod, middleOfRod, 1);
        AttachmentForce(m_flexible, Attachment(m_rod, Transform(Vec3(RodLength, 0, 0))),
                        SpatialVec(Vec3(0), Vec3(1, 0, 0)));

        m_start = m_system.realizeTopology();
        const Rotation crankTurn(Pi / 2, ZAxis), rodTurn(-std::asin(CrankLength), ZAxis);
        const Vec3 position(std::cos(std::asin(CrankLength)), 0, 0);
        m_crank.setQToFitTransform(m_start, Transform(crankTurn));
        m_block.setQToFitTransform(m_start, Transform(position));
        m_rod.setQToFitTransform(m_start, assembly == Assembly::FreeBodies
                                              ? Transform(rodTurn, position)
                                              : Transform(rodTurn));
    }

    const MultibodySystem& getSystem() const { return m_system; }
    const State& getStart() const { return m_start; }

    /** Returns the columns of IDA's table. **/
    Line measure(const State& state) const {
        const auto angle = [&](const MobilizedBody& body) {
            const Rotation& R = body.getBodyRotation(state);
            return std::atan2(R[1][0], R[0][0]);
        };
        return {state.getTime(), angle(m_crank), m_block.getBodyOriginLocation(state)[0],
                angle(m_rod)};
    }

private:
    MultibodySystem m_system;
    SimbodyMatterSubsystem m_matter;
    GeneralForceSubsystem m_forces;
    FlexibleBodySubsystem m_flexible;
    MobilizedBody m_crank, m_rod, m_block;
    State m_start;
};

void expectIdasTable(
    Assembly assembly, int redundant,
    BdfIntegrator::Formulation formulation = BdfIntegrator::Formulation::StabilizedIndex2) {
    const SliderCrank mechanism(assembly);
    BdfIntegrator integrator(mechanism.getSystem());
    integrator.setAccuracy(1e-8);
    integrator.setMaximumOrder(5);
    integrator.setFormulation(formulation);
    integrator.initialize(mechanism.getStart());
    for (const Line& expected : Table) {
        integrator.stepTo(expected.time);
        const Line found = mechanism.measure(integrator.getState());
        EXPECT_NEAR(found.crank, expected.crank, allowance(expected.crank)) << expected.time;
        EXPECT_NEAR(found.block, expected.block, allowance(expected.block)) << expected.time;
        EXPECT_NEAR(found.rod, expected.rod, allowance(expected.rod)) << expected.time;
        EXPECT_EQ(integrator.getStatistics().redundantConstraints, redundant) << expected.time;
    }
}

TEST(IdaSliderCrank, FreeBodiesWithThreeRedundantEquationsMoveAsInIda) {
    expectIdasTable(Assembly::FreeBodies, 3);
}
TEST(IdaSliderCrank, TreesClosedByAPinWithThreeRedundantEquationsMoveAsInIda) {
    expectIdasTable(Assembly::ClosedByAPin, 3);
}
TEST(IdaSliderCrank, TreesClosedByABallWithOneRedundantEquationMoveAsInIda) {
    expectIdasTable(Assembly::ClosedByABall, 1);
}
TEST(IdaSliderCrank, Index3MovesAsInIda) {
    expectIdasTable(Assembly::FreeBodies, 3, BdfIntegrator::Formulation::Index3);
}

}  // namespace
}  // namespace simflex
