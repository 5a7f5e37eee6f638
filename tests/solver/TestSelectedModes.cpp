// Bodies that keep some modes of a part against the full part with the other modes locked.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/part/ModeSelection.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** A swinging body with a force at its far end. **/
struct Swing {
    explicit Swing(std::shared_ptr<const ReducedBody> part)
        : body(flexible, std::move(part)),
          hinge(flexible, matter.Ground(), body.interface("A"), "hinge") {
        AttachmentForce(flexible, body.interface("B"),
                        SpatialVec(Vec3(1, 2, 3), Vec3(30, -20, 10)));
        AttachmentForce(flexible, body.node(7), SpatialVec(Vec3(0), Vec3(4, 5, -6)));
        ModalDamping(flexible, body, 0.03);
    }

    /** Sets the frame and the given modes in motion; the other modes are zero. **/
    State makeState(const std::vector<int>& modes) {
        State state = system.realizeTopology();
        Vector xi(body.getNumModes(), Real(0)), xiDot = xi;
        for (size_t k = 0; k < modes.size(); ++k) {
            xi[modes[k]] = 5e-3 * std::cos(1.0 + Real(k));
            xiDot[modes[k]] = 0.5 * std::sin(2.0 + Real(k));
        }
        body.setModalCoordinates(state, xi);
        body.setModalSpeeds(state, xiDot);
        const Rotation R(0.7, UnitVec3(1, 2, 3));
        body.setFramePose(state, Transform(R, Vec3(0.1, 0.2, 0.3)));
        body.setFrameVelocity(state, SpatialVec(Vec3(3, -2, 4), Vec3(1, 2, -1)));
        return state;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, Vec3(1, -9.81, 2)};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body;
    Joint::Ball hinge;
};

struct Case {
    const char* name;
    std::function<std::vector<int>(const ReducedBody&)> find;
    std::function<ReducedBody(const ReducedBody&)> select;
};

class SelectedModes : public testing::TestWithParam<Case> {};

TEST_P(SelectedModes, EnergiesMomentumAndAccelerationsAreThoseOfTheFullPartWithTheOthersHeld) {
    for (const double stiffening : {0.0, 1.0}) {
        PointMassPartOptions options;
        options.stiffening = stiffening;
        const auto part = makePointMassPart(options).body;
        const std::vector<int> modes = GetParam().find(*part);
        ASSERT_LT(modes.size(), 11u);
        Swing full(part), selected(std::make_shared<const ReducedBody>(GetParam().select(*part)));
        ASSERT_EQ(selected.body.getNumModes(), int(modes.size()));
        for (int i = 0; i < 11; ++i)
            if (std::find(modes.begin(), modes.end(), i) == modes.end())
                Constraint::ConstantSpeed(
                    full.matter.updMobilizedBody(
                        full.body.getModalMobilizer(i / 6).getMobilizedBodyIndex()),
                    MobilizerUIndex(i % 6), 0);
        std::vector<int> all;
        for (int k = 0; k < int(modes.size()); ++k) all.push_back(k);
        State a = full.makeState(modes), b = selected.makeState(all);
        full.system.realize(a, Stage::Acceleration);
        selected.system.realize(b, Stage::Acceleration);

        const Real T = full.body.calcKineticEnergy(a);
        EXPECT_NEAR(selected.body.calcKineticEnergy(b), T, 1e-13 * T);
        EXPECT_NEAR(selected.body.calcStrainEnergy(b), full.body.calcStrainEnergy(a), 1e-13);
        const SpatialVec momentum = full.body.calcMomentum(a) - selected.body.calcMomentum(b);
        EXPECT_LT(momentum[0].norm() + momentum[1].norm(), 1e-12);
        for (const int node : {1, 9, 16})
            EXPECT_LT(
                (full.body.calcNodeLocation(a, node) - selected.body.calcNodeLocation(b, node))
                    .norm(),
                1e-14);

        // Natively and with BdfIntegrator.
        BdfIntegrator fullBdf(full.system), selectedBdf(selected.system);
        for (BdfIntegrator* integrator : {&fullBdf, &selectedBdf})
            integrator->setProjectInitialState(false);
        fullBdf.initialize(a);
        selectedBdf.initialize(b);
        for (const auto& [uDot, expected] :
             {std::make_pair(b.getUDot(), a.getUDot()),
              std::make_pair(selectedBdf.getUDot(), fullBdf.getUDot())}) {
            const Real size = expected.normInf();
            EXPECT_GT(size, 1);
            const int at = int(selected.body.getFrame().getFirstUIndex(b)),
                      fullAt = int(full.body.getFrame().getFirstUIndex(a));
            for (int i = 0; i < 6; ++i)
                EXPECT_NEAR(uDot[at + i], expected[fullAt + i], 1e-10 * size);
            for (int k = 0; k < int(modes.size()); ++k) {
                const int i = modes[size_t(k)];
                EXPECT_NEAR(
                    uDot[int(selected.body.getModalMobilizer(k / 6).getFirstUIndex(b)) + k % 6],
                    expected[int(full.body.getModalMobilizer(i / 6).getFirstUIndex(a)) + i % 6],
                    1e-10 * size);
            }
        }
        EXPECT_LT((fullBdf.getMultipliers(full.hinge) - selectedBdf.getMultipliers(selected.hinge))
                      .normInf(),
                  1e-10 * fullBdf.getMultipliers(full.hinge).normInf());
    }
}

INSTANTIATE_TEST_SUITE_P(
    All, SelectedModes,
    testing::Values(Case{"List",
                         [](const ReducedBody&) {
                             return std::vector<int>{1, 4, 5, 8, 10};
                         },
                         [](const ReducedBody& part) {
                             return selectModes(part, {1, 4, 5, 8, 10});
                         }},
                    Case{"Lowest",
                         [](const ReducedBody&) { return std::vector<int>{0, 1, 2, 3, 4, 5, 6}; },
                         [](const ReducedBody& part) { return selectLowestModes(part, 7); }},
                    Case{"Band",
                         [](const ReducedBody& part) { return findModesInBand(part, 100, 300); },
                         [](const ReducedBody& part) { return selectModesInBand(part, 100, 300); }},
                    Case{"None", [](const ReducedBody&) { return std::vector<int>{}; },
                         [](const ReducedBody& part) { return selectModes(part, {}); }}),
    [](const testing::TestParamInfo<Case>& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace simflex::test
