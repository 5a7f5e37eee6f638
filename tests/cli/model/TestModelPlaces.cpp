/** @file
Places, rotations and frames of models. **/

#include <algorithm>

#include "BuiltModel.h"
#include "simflex/model/builders/Placement.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;

class ModelPlaces : public BuiltModelTest {
protected:
    static Transform poseOf(const Model& model, const std::string& frame) {
        const State state = model.makeInitialState();
        return model.findFrame(frame).calcMotion(state).X;
    }
    static double distance(const Transform& a, const Transform& b) {
        return (a.p() - b.p()).norm() + (a.R().asMat33() - b.R().asMat33()).norm();
    }
    const std::string brick = "mass: 1, inertia: [0.1, 0.1, 0.1]";
};

TEST_F(ModelPlaces, EveryFormOfRotationIsSimbodys) {
    const auto model =
        build("bodies:\n  a: {" + brick + ", place: {rotation: [0.1, -20*deg, 2]}}\n" + "  b: {" +
              brick + ", place: {rotation: {axis: y, angle: 30*deg}}}\n" + "  c: {" + brick +
              ", place: {rotation: {axis: [1, 1, 0], angle: pi/3}}}\n" + "  d: {" + brick +
              ", place: {rotation: {quaternion: [2, 0, 0, -1]}}}\n");
    const double degree = Pi / 180;
    Rotation a(BodyRotationSequence, 0.1, XAxis, -20 * degree, YAxis, 2, ZAxis);
    EXPECT_LT(distance(poseOf(*model, "a"), a), 1e-14);
    EXPECT_LT(distance(poseOf(*model, "b"), Rotation(30 * degree, YAxis)), 1e-14);
    EXPECT_LT(distance(poseOf(*model, "c"), Rotation(Pi / 3, UnitVec3(1, 1, 0))), 1e-14);
    EXPECT_LT(distance(poseOf(*model, "d"), Rotation(-2 * std::atan(0.5), ZAxis)), 1e-14);
    EXPECT_THAT(messageOf("bodies:\n  d: {" + brick + ", place: {rotation: {angle: 1}}}\n"),
                HasSubstr("with axis"));
    EXPECT_THAT(messageOf("bodies:\n  d: {" + brick +
                          ", place: {rotation: {axis: [0, 0, 0], angle: 1}}}\n"),
                HasSubstr("not a direction"));
    EXPECT_THAT(
        messageOf("bodies:\n  d: {" + brick + ", place: {rotation: {quaternion: [0, 0, 0, 0]}}}\n"),
        HasSubstr("not a rotation"));
}

TEST_F(ModelPlaces, PositionOfAFlexibleBodyIsThatOfItsPartsCoordinates) {
    const auto model = build(
        "bodies: {a: {part: bar, place: {position: [1, 2, 3], rotation: {axis: z, angle: "
        "90*deg}}}}");
    const Transform X_GP(Rotation(Pi / 2, ZAxis), Vec3(1, 2, 3));
    EXPECT_LT(distance(poseOf(*model, "a"), X_GP), 1e-14);
    const auto part = makeBar();
    const auto& c = part->centerOfMass;
    const Model::BodyEntry& a = model->getBodies()[0];
    const State state = model->makeInitialState();
    EXPECT_LT(distance(a.flexible->getFramePose(state), X_GP * Transform(Vec3(c[0], c[1], c[2]))),
              1e-14);
    EXPECT_LT(distance(a.flexible->getFramePose(state) * a.X_BP, X_GP), 1e-14);
    const auto& s = part->getInterface("B").position;
    EXPECT_LT(
        (poseOf(*model, "a.B").p() - X_GP * Vec3(c[0] + s[0], c[1] + s[1], c[2] + s[2])).norm(),
        1e-14);
}

TEST_F(ModelPlaces, MatedFramesMeetWhateverTheOrder) {
    const auto model = build(R"(
bodies:
  last: {part: bar, place: {frame: A, at: middle.B, position: [0.01, 0, 0], rotation: {axis: x, angle: 20*deg}}}
  middle: {part: stiffened, place: {frame: nose, at: first}}
  first: {mass: 1, inertia: [0.1, 0.1, 0.1], place: {frame: {on: first, position: [0, 0, 0.2]}, at: door}}
frames:
  door: {on: ground, position: [1, 0, 0], rotation: [0, 0, 1]}
  nose: {on: middle, node: 7, rotation: [0, 1, 0]}
  outer: {on: first, position: [1, 1, 1]}
  inner: {on: outer, position: [0, 0, 1]}
)");
    EXPECT_LT(distance(poseOf(*model, "door"), Transform(Rotation(1, ZAxis), Vec3(1, 0, 0))),
              1e-15);
    EXPECT_LT(distance(poseOf(*model, "first") * Vec3(0, 0, 0.2), poseOf(*model, "door") * Vec3(0)),
              1e-14);
    EXPECT_LT(distance(poseOf(*model, "nose"), poseOf(*model, "first")), 1e-13);
    EXPECT_LT(
        distance(poseOf(*model, "last.A"),
                 poseOf(*model, "middle.B") * Transform(Rotation(Pi / 9, XAxis), Vec3(0.01, 0, 0))),
        1e-13);
    EXPECT_LT(distance(poseOf(*model, "inner"), poseOf(*model, "first") * Transform(Vec3(1, 1, 2))),
              1e-14);
    EXPECT_EQ(model->getBodies()[0].name, "last");
}

TEST_F(ModelPlaces, PlacesInACircleAreNamed) {
    EXPECT_THAT(messageOf("bodies:\n  a: {" + brick + ", place: {at: b}}\n  b: {" + brick +
                          ", place: {at: c}}\n  c: {" + brick + ", place: {at: a}}\n"),
                AllOf(HasSubstr("model.yaml:4:"), HasSubstr("a -> b -> c -> a")));
    EXPECT_THAT(messageOf("bodies:\n  a: {" + brick + ", place: {at: a}}\n"),
                HasSubstr("frame of its own"));
    EXPECT_THAT(messageOf("bodies:\n  a: {" + brick + ", place: {frame: ground, at: ground}}\n"),
                HasSubstr("`frame` is one of the body's own"));
    EXPECT_THAT(messageOf("frames: {a: {on: b}, b: {on: a}}\nbodies:\n  c: {" + brick +
                          ", place: {at: a}}\n"),
                HasSubstr("a -> b -> a"));
}

TEST_F(ModelPlaces, MobilizersPutTheirBodiesWhereTheyArePlacedOrSayThatTheyCannot) {
    const auto model = build(
        "bodies:\n  a: {" + brick +
        ", mobilizer: {type: pin, inboard: {position: [1, 0, 0]}}, place: {position: [1, 0, 0], "
        "rotation: [0, 0, 0.4]}}\n  b: {" +
        brick + ", mobilizer: {type: weld, parent: a, inboard: {position: [0, 2, 0]}}}\n");
    EXPECT_LT(distance(poseOf(*model, "a"), Transform(Rotation(0.4, ZAxis), Vec3(1, 0, 0))), 1e-14);
    EXPECT_LT(distance(poseOf(*model, "b"),
                       Transform(Rotation(0.4, ZAxis), Vec3(1, 0, 0)) * Transform(Vec3(0, 2, 0))),
              1e-14);
    EXPECT_THAT(messageOf("bodies:\n  a: {" + brick +
                          ", mobilizer: {type: pin}, place: {position: [1, 0, 0]}}\n"),
                AllOf(HasSubstr("bodies.a.place"), HasSubstr("type pin"), HasSubstr("1.0")));
}

TEST_F(ModelPlaces, FramesTypedAtAPromptAreFoundOrProposed) {
    const auto model = build("bodies: {boom: {part: bar}}\nframes: {tip: {on: boom.B}}\n");
    EXPECT_EQ(model->findFrame("boom.A").getName(), "boom.A");
    EXPECT_EQ(model->findFrame("ground").getName(), "ground");
    EXPECT_EQ(model->findFrame("tip").getName(), "boom.B");
    try {
        model->findFrame("bom.A");
        ADD_FAILURE() << "found";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr("'bom.A'"), HasSubstr("boom.A")));
    }
}

/** Each body stands 1 m along x from the next one of the file. **/
TEST_F(ModelPlaces, ChainsMayBeAsLongAsTheFileInEitherOrder) {
    constexpr int Count = 8000;
    for (const bool isForward : {true, false})
        for (const std::string kind : {"place: {position: [1, 0, 0], at: ",
                                       "mobilizer: {type: weld, inboard: {position: [1, 0, 0]}, "
                                       "parent: "}) {
            std::string bodies = "bodies:\n";
            for (int k = 0; k < Count; ++k) {
                const int i = isForward ? k : Count - 1 - k;
                bodies += "  b" + std::to_string(i) + ": {" + brick;
                if (i > 0) bodies += ", " + kind + "b" + std::to_string(i - 1) + "}";
                bodies += "}\n";
            }
            ModelText text;
            text.text += bodies;
            const model::ModelValue file = readModel(text);
            const model::ModelFrames frames(file, {});
            const model::Placement placement(file, frames);
            const int last = isForward ? Count - 1 : 0;
            EXPECT_EQ(placement.getPose(last).p(), Vec3(Count - 1, 0, 0)) << kind;
            std::vector<int> order = placement.getOrder();
            if (!isForward) std::reverse(order.begin(), order.end());
            EXPECT_TRUE(std::is_sorted(order.begin(), order.end())) << kind;
        }
}

TEST_F(ModelPlaces, AnglesBeyondAWholeTurnAreWarnedOfAsDegrees) {
    const std::string degrees =
        "angles are in radians, and 90 is more than a whole turn: degrees "
        "are written 90*deg";
    const std::string body = "bodies:\n  a: {" + brick + ", place: {rotation: ";
    for (const std::string rotation : {"[90, 0, 0]", "[0, 45*2, 0]", "{axis: x, angle: 90}"}) {
        warnings.clear();
        build(body + rotation + "}}\n");
        EXPECT_THAT(warnings, ::testing::ElementsAre(HasSubstr(degrees))) << rotation;
        warnings.clear();
        build("bodies:\n  a: {" + brick + "}\nframes: {f: {on: a, rotation: " + rotation +
              "}}\njoints: {j: {type: ball, between: [ground, {on: a, rotation: " + rotation +
              "}]}}\n");
        EXPECT_THAT(warnings, ::testing::ElementsAre(HasSubstr("frames.f.rotation"),
                                                     HasSubstr("joints.j.between.1.rotation")))
            << rotation;
    }
    warnings.clear();
    build(body + "[90*deg, -360*deg, 2*pi]}}\n");
    build(body + "{quaternion: [90, 0, 0, 1]}}}\n");
    EXPECT_THAT(warnings, ::testing::IsEmpty());
}

TEST_F(ModelPlaces, AnAccuracyAsCoarseAsTheModelIsWarnedOf) {
    const std::string bar = "bodies: {a: {part: bar}}\n",  // about 0.4 m
        ball = "bodies: {a: {mass: 1, inertia: [0.1, 0.1, 0.1]}}\n";
    for (const std::string& body : {bar, ball}) {
        build(body + "solver: {accuracy: 1e-3}\n");
        EXPECT_THAT(warnings, ::testing::IsEmpty()) << body;
        build(body + "solver: {accuracy: 1}\n");
        EXPECT_THAT(warnings, ::testing::ElementsAre(HasSubstr("the accuracy of 1 m is "))) << body;
        warnings.clear();
    }
}

}  // namespace
}  // namespace simflex::test
