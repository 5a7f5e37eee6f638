/** @file
Names and corners of the solids of a STEP file. **/

#include "../../plugin/fe/StepSolids.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string path = fuzz::getFolder().write(
        "part.step", std::string(reinterpret_cast<const char*>(data), size));
    fuzz::accepts([&] { readStepSolids(path); });
    return 0;
}
