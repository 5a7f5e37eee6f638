/** @file
Matrix Market: K, M and the node table. Accepted data survive a round trip. **/

#include "Fuzz.h"
#include "simflex/fe/MatrixMarket.h"
#include "simflex/fe/UnitSystem.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 4);
    const fuzz::Folder& folder = fuzz::getFolder();
    const std::string K = folder.write("K.mtx", files[0]), M = folder.write("M.mtx", files[1]),
                      nodes = folder.write("nodes.csv", files[2]);
    MatrixMarketOptions options;
    if (!files[3].empty()) options.dofs = folder.write("part.dof", files[3]);
    FeModel model;
    if (!fuzz::accepts([&] { model = readMatrixMarket(K, M, nodes, options); })) return 0;
    fuzz::accepts([&] { checkUnits(model); });
    writeMatrixMarket(model, folder / "again");
    const FeModel same = readMatrixMarket(folder / "again_K.mtx", folder / "again_M.mtx",
                                          folder / "again_nodes.inp");
    if (same.K.values != model.K.values || same.m.values != model.m.values ||
        same.mesh.positions != model.mesh.positions)
        fuzz::fail("a model that was written reads back as another");
    return 0;
}
