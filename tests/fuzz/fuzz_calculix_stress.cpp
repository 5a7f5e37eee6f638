/** @file
Stresses that CalculiX prints. What is accepted has a stress for each integration point; a stand-in
for the program hands over the text. **/

#include "../../plugin/fe/calculix/GeometricStiffness.h"
#include "Fuzz.h"
#include "simflex/fe/CalculixDeck.h"

using namespace simflex;

namespace {

constexpr const char* kDeck =
    "*NODE, NSET=ALL\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n"
    "*ELEMENT, TYPE=C3D8, ELSET=BLOCK\n7,1,2,3,4,5,6,7,8\n"
    "*MATERIAL, NAME=METAL\n*ELASTIC\n70e9, 0.3\n*DENSITY\n2700\n"
    "*SOLID SECTION, ELSET=BLOCK, MATERIAL=METAL\n";

struct Setup {
    Setup() {
        const fuzz::Folder& folder = fuzz::getFolder();
        model.source = folder.write("block.inp", kDeck);
        model.mesh = readCalculixMesh(model.source);
        options.program = folder.write(
            "ccx", "#!/bin/sh\nexec cp '" + (folder / "stress.dat") + "' \"$1.dat\"\n");
        options.numProcesses = 1;
        std::filesystem::permissions(options.program, std::filesystem::perms::owner_all);
        load.name = "push";
        load.force.assign(24, 0);
    }
    FeModel model;
    PrestressOptions options;
    PrestressLoad load;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Setup setup;
    fuzz::getFolder().write("stress.dat", std::string(reinterpret_cast<const char*>(data), size));
    int numTaken = 0;
    const bool isAccepted = fuzz::accepts([&] {
        calcGeometricStiffness(setup.model, {setup.load}, setup.options,
                               [&](int, const SymmetricMatrix& A) {
                                   ++numTaken;
                                   if (A.size != 8) fuzz::fail("a matrix of another size");
                               });
    });
    if (numTaken != isAccepted)
        fuzz::fail("a matrix of a refused file, or none of an accepted one");
    return 0;
}
