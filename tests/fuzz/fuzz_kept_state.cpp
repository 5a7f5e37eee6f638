/** @file
States kept by the prompt. An accepted one is finite and survives a round trip. **/

#include <cmath>

#include "Fuzz.h"
#include "simflex/model/file/ModelReader.h"
#include "simflex/model/session/KeptState.h"

using namespace simflex;

namespace {

constexpr const char* kModel =
    "simflex: 1\n"
    "bodies:\n"
    "  a: {mass: 1, inertia: [1, 1, 1]}\n"
    "  b: {mass: 1, inertia: [1, 1, 1], place: {position: [1, 0, 0]}}\n"
    "joints:\n"
    "  pin: {type: pin, between: [ground, a]}\n"
    "  ball: {type: ball, between: [a, b]}\n";

const Model& getModel() {
    static const Model model(readModel(ModelText{fuzz::getFolder() / "model.yaml", kModel, {}}));
    return model;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Model& model = getModel();
    const std::string path = fuzz::getFolder().write(
        "kept.state", std::string(reinterpret_cast<const char*>(data), size));
    SimTK::State state;
    if (!fuzz::accepts([&] { state = model::readKeptState(path, model); })) return 0;
    for (int i = 0; i < state.getNY(); ++i)
        if (!std::isfinite(state.getY()[i])) fuzz::fail("a value is not finite");
    model::writeKeptState(path, model, state);
    const SimTK::State same = model::readKeptState(path, model);
    for (int i = 0; i < state.getNY(); ++i)
        if (same.getY()[i] != state.getY()[i]) fuzz::fail("a state that was written is another");
    return 0;
}
