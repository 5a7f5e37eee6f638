// The slider-crank of the source paper: energy, rigid limit, reactions, threads, formulations.

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/forces/AttachmentForce.h"
#include "solver/SliderCrankModel.h"

namespace simflex {
namespace {

using namespace SimTK;
using test::FlexibleSliderCrank;
using test::RigidSliderCrank;
using test::SliderCrankOptions;

/** Returns |kinetic + potential − work| at the end, relative to the work done. **/
Real calcEnergyError(
    const SliderCrankOptions& options, Real accuracy, Real time,
    BdfIntegrator::Formulation formulation = BdfIntegrator::Formulation::StabilizedIndex2) {
    FlexibleSliderCrank model(options);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(accuracy);
    integrator.setFormulation(formulation);
    integrator.initialize(model.state);
    model.system.realize(integrator.getState(), Stage::Dynamics);
    const Real start = model.flexible.calcEnergy(integrator.getState());
    integrator.stepTo(time);
    model.system.realize(integrator.getState(), Stage::Dynamics);
    return std::abs(model.flexible.calcEnergy(integrator.getState()) - start -
                    integrator.getWork()) /
           std::abs(integrator.getWork());
}

TEST(SliderCrank, EnergyMinusWorkOfLoadsVanishesWithAccuracy) {
    std::vector<Real> errors;
    for (Real accuracy : {1e-5, 1e-6, 1e-7, 1e-8})
        errors.push_back(calcEnergyError({}, accuracy, 0.08));
    for (size_t i = 1; i < errors.size(); ++i)
        EXPECT_LT(errors[i], errors[i - 1] / 2.5) << "at level " << i;
    EXPECT_LT(errors.back(), 1e-3);
}

TEST(SliderCrank, EnergyBalanceHoldsInIndex3Too) {
    const Real coarse = calcEnergyError({}, 1e-6, 0.06, BdfIntegrator::Formulation::Index3);
    const Real fine = calcEnergyError({}, 1e-8, 0.06, BdfIntegrator::Formulation::Index3);
    EXPECT_LT(fine, coarse / 6);
}

TEST(SliderCrank, WorkOfAPrescribedRotationBalancesEnergy) {
    SliderCrankOptions options;
    // Smooth run-up to 60 rad/s within 0.05 s.
    options.angle = [start = options.startAngle](Real t) {
        const Real T = 0.05, w = 60, x = std::min(t / T, Real(1)), past = std::max(t - T, Real(0));
        const Real angle = w * T * (x * x * x - 0.5 * x * x * x * x) + w * past;
        const Real rate = w * (3 * x * x - 2 * x * x * x),
                   acceleration = w / T * (6 * x - 6 * x * x);
        return Vec3(start + angle, rate, acceleration);
    };
    const Real coarse = calcEnergyError(options, 1e-6, 0.08),
               fine = calcEnergyError(options, 1e-8, 0.08);
    EXPECT_LT(fine, coarse / 6);
    EXPECT_LT(fine, 2e-3);

    FlexibleSliderCrank model(options);
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.state);
    integrator.stepTo(0.08);
    const FrameMotion shaft = model.crank.interface("shaft").calcMotion(integrator.getState());
    EXPECT_NEAR(shaft.V[0][2], 60, 1e-9);
}

TEST(SliderCrank, StiffPartsMoveAsRigidOnesInSimbody) {
    const Real time = 0.1;
    SliderCrankOptions options;
    // Damping does not affect the rigid limit; this value keeps BDF5 (stable within 51.8° of the
    // negative axis) stable.
    options.dampingRatio = 0.7;
    RigidSliderCrank rigid(options);
    const State end = rigid.integrate(time);
    const Real rigidPosition = rigid.slider.getOneQ(end, 0);
    const Real travel = test::CrankLength;

    std::vector<Real> differences;
    for (Real factor : {1e2, 1e3, 1e4}) {
        options.stiffnessFactor = factor;
        FlexibleSliderCrank model(options);
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(1e-12);
        integrator.setMaximumOrder(5);
        integrator.initialize(model.state);
        integrator.stepTo(time);
        const State& state = integrator.getState();
        differences.push_back(std::abs(model.getSliderPosition(state) - rigidPosition) / travel);

        // In-plane forces of the main bearing; the rigid mechanism has no out-of-plane forces for
        // comparison.
        Vector_<SpatialVec> reactions;
        rigid.matter.calcMobilizerReactionForces(end, reactions);
        const Vec3 bearing =
            model.mainBearing.calcForceOnM(state, integrator.getMultipliers(model.mainBearing))[1];
        const Real scale = reactions[rigid.crank.getMobilizedBodyIndex()][1].norm();
        const Real allowed = 1e-2 / factor;
        EXPECT_NEAR(bearing[0], reactions[rigid.crank.getMobilizedBodyIndex()][1][0],
                    allowed * scale)
            << factor;
        EXPECT_NEAR(bearing[1], reactions[rigid.crank.getMobilizedBodyIndex()][1][1],
                    allowed * scale)
            << factor;
    }
    EXPECT_NEAR(differences[0] / differences[1], 10, 1);
    EXPECT_NEAR(differences[1] / differences[2], 10, 1);
    EXPECT_LT(differences[2], 1e-5);
}

// Three pins and a slide close a planar loop in space: of their 15 equations on 13 speeds,
// 12 are independent.
TEST(SliderCrank, RigidPartsWithThreeRedundantEquationsMoveAsInSimbody) {
    const Real time = 0.1;
    const SliderCrankOptions options;
    RigidSliderCrank rigid(options);
    const State end = rigid.integrate(time);

    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);
    const auto properties = [&](const MobilizedBody& body) {
        return Body::Rigid(body.getBodyMassProperties(rigid.state));
    };
    MobilizedBody::Free crank(matter.Ground(), properties(rigid.crank)),
        rod(matter.Ground(), properties(rigid.rod));
    MobilizedBody::Slider slider(matter.Ground(), Transform(), properties(rigid.slider),
                                 Transform());
    const Joint::Pin mainBearing(flexible, matter.Ground(), crank, "main bearing");
    const Joint::Pin crankPin(flexible, Attachment(crank, Transform(Vec3(test::CrankLength, 0, 0))),
                              rod, "crank pin");
    const Joint::Pin gudgeonPin(flexible, Attachment(rod, Transform(Vec3(test::RodLength, 0, 0))),
                                slider, "gudgeon pin");
    AttachmentForce(flexible, crank,
                    [&](Real t) { return SpatialVec(Vec3(0, 0, options.torque(t)), Vec3(0)); });
    State state = system.realizeTopology();
    rigid.system.realize(rigid.state, Stage::Position);
    crank.setQToFitTransform(state, rigid.crank.getBodyTransform(rigid.state));
    rod.setQToFitTransform(state, rigid.rod.getBodyTransform(rigid.state));
    slider.setOneQ(state, 0, rigid.slider.getOneQ(rigid.state, 0));

    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-11);
    integrator.setMaximumOrder(5);
    integrator.initialize(state);
    EXPECT_EQ(integrator.getStatistics().redundantConstraints, 3);
    // Each redundancy closes the loop, so all three pins are listed.
    const std::vector<std::string> redundant = integrator.getRedundantConstraints();
    ASSERT_EQ(redundant.size(), 3u);
    for (const std::string& line : redundant) {
        EXPECT_NE(line.find("equation "), std::string::npos) << line;
        EXPECT_NE(line.find(" follows from '"), std::string::npos) << line;
    }
    integrator.stepTo(time);
    EXPECT_EQ(integrator.getStatistics().redundantConstraints, 3);
    const State& ours = integrator.getState();
    EXPECT_NEAR(slider.getOneQ(ours, 0), rigid.slider.getOneQ(end, 0), 1e-6 * test::CrankLength);

    // In-plane forces are unique, even with redundant equations.
    Vector_<SpatialVec> reactions;
    rigid.matter.calcMobilizerReactionForces(end, reactions);
    const auto expectSameForce = [&](const Joint& joint, const MobilizedBody& body) {
        const Vec3 found = joint.calcForceOnM(ours, integrator.getMultipliers(joint))[1];
        const Vec3 expected = reactions[body.getMobilizedBodyIndex()][1];
        for (int axis : {0, 1})
            EXPECT_NEAR(found[axis], expected[axis], 1e-4 * expected.norm()) << joint.getName();
    };
    expectSameForce(mainBearing, rigid.crank);
    expectSameForce(crankPin, rigid.rod);

    // Multipliers are the minimum-norm ones, as in Simbody's own solve.
    State native = ours;
    system.realize(native, Stage::Acceleration);
    BdfIntegrator again(system);
    again.initialize(ours);
    const Vector found = again.getMultipliers(), theirs = native.getMultipliers();
    EXPECT_LT((found - theirs).norm(), 1e-6 * theirs.norm());
}

TEST(SliderCrank, ResultsAreTheSameToTheBitForAnyNumberOfThreads) {
    std::vector<Vector> ends;
    for (int threads : {1, 2, 4}) {
        FlexibleSliderCrank model;
        BdfIntegrator integrator(model.system);
        integrator.setNumThreads(threads);
        integrator.initialize(model.state);
        integrator.stepTo(0.01);
        const State& state = integrator.getState();
        Vector all(state.getNQ() + state.getNU() + integrator.getMultipliers().size());
        all(0, state.getNQ()) = state.getQ();
        all(state.getNQ(), state.getNU()) = state.getU();
        all(state.getNQ() + state.getNU(), integrator.getMultipliers().size()) =
            integrator.getMultipliers();
        ends.push_back(all);
    }
    for (int i = 0; i < ends[0].size(); ++i) {
        EXPECT_EQ(ends[0][i], ends[1][i]);
        EXPECT_EQ(ends[0][i], ends[2][i]);
    }
}

TEST(SliderCrank, ArrowDenseAndBothFormulationsAgree) {
    std::vector<Real> positions;
    for (auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense})
        for (auto formulation :
             {BdfIntegrator::Formulation::StabilizedIndex2, BdfIntegrator::Formulation::Index3}) {
            FlexibleSliderCrank model;
            BdfIntegrator integrator(model.system);
            integrator.setAccuracy(1e-8);
            integrator.setBlockForm(form);
            integrator.setFormulation(formulation);
            integrator.initialize(model.state);
            integrator.stepTo(0.03);
            positions.push_back(model.getSliderPosition(integrator.getState()));
            EXPECT_LT(integrator.getLargestConstraintError(), 1e-9);
        }
    for (Real position : positions) EXPECT_NEAR(position, positions[0], 2e-7);
}

}  // namespace
}  // namespace simflex
