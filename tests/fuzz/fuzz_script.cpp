/** @file
Gmsh scripts: the names of the files that they read. **/

#include <set>

#include "Fuzz.h"
#include "simflex/fe/GmshPart.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 2);
    const std::string path = fuzz::getFolder().write("part.geo", files[0]);
    fuzz::getFolder().write("more.geo", files[1]);
    const std::vector<std::string> names = listScriptFiles(path);
    if (names.empty() || names[0] != path) fuzz::fail("a script does not read itself");
    if (std::set<std::string>(names.begin(), names.end()).size() != names.size())
        fuzz::fail("a file is named twice");
    return 0;
}
