/** @file
Surfaces of rigid bodies: the file name's extension, then the file. A body of such a shape has a
positive, finite mass. **/

#include <cmath>

#include "../../plugin/model/Model.h"
#include "../../plugin/model/file/ModelReader.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::vector<std::string> files = fuzz::splitFiles(data, size, 2);
    const std::string ending = files[0].substr(0, 3);
    if (ending != "obj" && ending != "stl" && ending != "vtp") return 0;
    fuzz::getFolder().write("surface." + ending, files[1]);
    ModelText text;
    text.path = fuzz::getFolder() / "model.yaml";
    text.text = "simflex: 1\nbodies: {a: {density: 1000, shape: {mesh: surface." + ending + "}}}\n";
    fuzz::accepts([&] {
        const Model model(readModel(text), {});
        const SimTK::State state = model.makeInitialState();
        model.getSystem().realize(state, SimTK::Stage::Position);
        const double mass = model.getSystem().getMatterSubsystem().calcSystemMass(state);
        if (!(mass > 0) || !std::isfinite(mass)) fuzz::fail("a mass that is none");
    });
    return 0;
}
