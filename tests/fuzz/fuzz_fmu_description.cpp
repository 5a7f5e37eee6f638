/** @file
Descriptions of FMUs: each variable of an accepted one is found by name. **/

#include "../../plugin/fmi/FmuDescription.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string path = fuzz::getFolder().write(
        "modelDescription.xml", std::string(reinterpret_cast<const char*>(data), size));
    FmuDescription description;
    const bool isAccepted =
        fuzz::accepts([&] { description = readFmuDescription(path); }, fuzz::Names::Anything);
    if (!isAccepted) return 0;
    for (const FmuVariable& variable : description.variables)
        if (description.find(variable.name) == nullptr) fuzz::fail("a variable is not found");
    if (description.find("no such variable \t") != nullptr) fuzz::fail("a variable is made up");
    return 0;
}
