#include "BuiltModel.h"

#include "simflex/part/ReducedBodyFile.h"
#include "support/PointMassPart.h"

namespace simflex::test {

using namespace SimTK;

namespace {

std::shared_ptr<const ReducedBody> makePart(unsigned seed, double stiffening) {
    PointMassPartOptions options;
    options.seed = seed;
    options.numModes = 7;
    options.stiffening = stiffening;
    auto part = std::make_shared<ReducedBody>(*makePointMassPart(options).body);
    part->mesh.nodeSets["END"] = {0, 4, 8, 12};
    return part;
}

}  // namespace

std::shared_ptr<const ReducedBody> BuiltModelTest::makeBar() {
    return makePart(5, 0);
}

std::shared_ptr<const ReducedBody> BuiltModelTest::makeStiffenedBar() {
    return makePart(6, 0.01);
}

void BuiltModelTest::SetUp() {
    writeReducedBody(folder / "bar.h5", *makeBar());
    writeReducedBody(folder / "stiffened.h5", *makeStiffenedBar());
    options.cacheFolder = folder / "cache";
    options.listener.note = [this](const std::string& note) { notes.push_back(note); };
    options.listener.warn = [this](const std::string& warning) { warnings.push_back(warning); };
}

std::unique_ptr<Model> BuiltModelTest::build(const std::string& text) {
    ModelText model;
    model.path = folder / "model.yaml";
    model.text = "simflex: 1\n";
    if (text.find("parts:") == std::string::npos)
        model.text += "parts: {bar: {file: bar.h5}, stiffened: {file: stiffened.h5}}\n";
    model.text += text;
    return std::make_unique<Model>(readModel(model), options);
}

std::string BuiltModelTest::messageOf(const std::string& text) {
    try {
        build(text);
    } catch (const ModelError& error) {
        return error.what();
    }
    return "";
}

double compareAccelerations(const MultibodySystem& a, State stateA, const MultibodySystem& b,
                            State stateB) {
    EXPECT_EQ(stateA.getNQ(), stateB.getNQ());
    EXPECT_EQ(stateA.getNU(), stateB.getNU());
    if (stateA.getNQ() != stateB.getNQ() || stateA.getNU() != stateB.getNU()) return Infinity;
    Random::Uniform random(-1, 1);
    random.setSeed(4);
    for (int i = 0; i < stateA.getNU(); ++i) stateA.updU()[i] = 0.3 * random.getValue();
    for (int i = 0; i < stateA.getNQ(); ++i) stateA.updQ()[i] += 1e-3 * random.getValue();
    stateB.updQ() = stateA.getQ();
    stateB.updU() = stateA.getU();
    stateA.setTime(0.37);
    stateB.setTime(0.37);
    a.realize(stateA, Stage::Acceleration);
    b.realize(stateB, Stage::Acceleration);
    const Vector difference = stateA.getUDot() - stateB.getUDot();
    EXPECT_GT(stateB.getUDot().normInf(), 0);
    return difference.normInf() / stateB.getUDot().normInf();
}

}  // namespace simflex::test
