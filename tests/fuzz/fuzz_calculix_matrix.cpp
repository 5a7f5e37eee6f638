/** @file
What CalculiX stores: equations, K and M. What is accepted has all of the mesh's degrees of freedom.
**/

#include <cmath>

#include "../../plugin/fe/calculix/CalculixRun.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 3);
    const fuzz::Folder& folder = fuzz::getFolder();
    folder.write("part.dof", files[0]);
    folder.write("part.sti", files[1]);
    folder.write("part.mas", files[2]);
    FeModel model;
    model.mesh.nodeNumbers = {1, 2, 7};
    model.mesh.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const bool isAccepted = fuzz::accepts(
        [&] {
            readCalculixMatrices(folder.path(), "part", {1, 1, 0}, model, {});
        },
        fuzz::Names::Anything);  // the deck is named by those who call it
    if (!isAccepted) return 0;
    if (model.K.size != 9 || model.m.size != 3) fuzz::fail("a matrix of another size");
    for (const SymmetricMatrix* A : {&model.K, &model.m})
        for (const double value : A->values)
            if (!std::isfinite(value)) fuzz::fail("an entry is not finite");
    return 0;
}
