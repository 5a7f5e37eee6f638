/** @file
Nastran's DMIG entries and grids in small, large and free field. **/

#include "Fuzz.h"
#include "simflex/fe/NastranDmig.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 2);
    const fuzz::Folder& folder = fuzz::getFolder();
    const std::string punch = folder.write("part.pch", files[0]),
                      grids = folder.write("part.bdf", files[1]);
    fuzz::accepts([&] { readNastranDmig(punch, grids).validate(); });
    return 0;
}
