/** @file
Arrays of MATLAB and NumPy as a model. Accepted data survive a round trip. **/

#include "Fuzz.h"
#include "simflex/fe/ArrayMatrices.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const fuzz::Folder& folder = fuzz::getFolder();
    const std::string text(reinterpret_cast<const char*>(data), size);
    const bool isMat = text.compare(0, 6, "MATLAB") == 0;
    const std::string path = folder.write(isMat ? "model.mat" : "model.npz", text);
    FeModel model;
    if (!fuzz::accepts([&] { model = readArrayMatrices(path); })) return 0;
    for (const char* name : {"again.npz", "again.mat"}) {
        writeArrayMatrices(model, folder / name);
        const FeModel same = readArrayMatrices(folder / name);
        if (same.K.values != model.K.values || same.m.values != model.m.values ||
            same.mesh.positions != model.mesh.positions)
            fuzz::fail("a model that was written reads back as another");
    }
    return 0;
}
