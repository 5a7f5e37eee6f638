/** @file
Abaqus' matrices in both formats, with the nodes of a deck. **/

#include "Fuzz.h"
#include "simflex/fe/AbaqusMatrices.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 3);
    const fuzz::Folder& folder = fuzz::getFolder();
    const std::string K = folder.write("stif.mtx", files[0]),
                      M = folder.write("mass.mtx", files[1]),
                      nodes = folder.write("job.inp", files[2]);
    fuzz::accepts([&] { readAbaqusMatrices(K, M, nodes).validate(); });
    return 0;
}
