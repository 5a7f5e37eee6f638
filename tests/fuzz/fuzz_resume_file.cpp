/** @file
Files kept by an interrupted reduction. A damaged or truncated file is ignored: the part is
bit-identical. **/

#include "Fuzz.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/reduction/Reduction.h"

using namespace simflex;

namespace {

constexpr const char* kNames[] = {"matrices", "factor", "constraint modes", "normal modes"};
constexpr const char* kDeck =
    "*NODE, NSET=ALL\n"
    "1,0,0,0\n2,0.1,0,0\n3,0.2,0,0\n4,0.3,0,0.02\n5,0.4,0,0\n"
    "*ELEMENT, TYPE=B32R, ELSET=BEAM\n1,1,2,3\n2,3,4,5\n"
    "*NSET, NSET=LEFT\n1\n*NSET, NSET=RIGHT\n5\n"
    "*MATERIAL, NAME=METAL\n*ELASTIC\n70e9, 0.3\n*DENSITY\n2700\n"
    "*BEAM SECTION, ELSET=BEAM, MATERIAL=METAL, SECTION=RECT\n0.02, 0.01\n0, 1, 0\n";

struct Base {
    ReducedBody body;
    std::vector<std::string> files;  ///< of kNames
};

ReducedBody run(const ReductionCheckpoint& checkpoint) {
    CalculixOptions calculix;
    calculix.checkpoint = &checkpoint;
    ReductionOptions options;
    options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
    options.numModes = 16;
    options.checkpoint = &checkpoint;
    return reduce(readCalculixDeck(fuzz::getFolder() / "beam.inp", calculix), options);
}

std::string pathOf(const char* name) {
    return fuzz::getFolder() / ("kept/" + std::string(name));
}

const Base& getBase() {
    static const Base base = [] {
        fuzz::getFolder().write("beam.inp", kDeck);
        Base made;
        made.body = run(ReductionCheckpoint(fuzz::getFolder() / "kept", 0));
        for (const char* name : kNames) {
            std::ifstream in(pathOf(name), std::ios::binary);
            made.files.emplace_back(std::istreambuf_iterator<char>(in),
                                    std::istreambuf_iterator<char>());
            if (made.files.back().empty()) fuzz::fail(std::string("nothing is kept as ") + name);
        }
        return made;
    }();
    return base;
}

}  // namespace

/** One byte chooses the file, one whether it is truncated; then positions (2 bytes) and values.
Every second position is near the beginning, where the sizes are. **/
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Base& base = getBase();
    if (size < 2) return 0;
    for (size_t k = 0; k < std::size(kNames); ++k)
        fuzz::getFolder().write("kept/" + std::string(kNames[k]), base.files[k]);
    const size_t chosen = data[0] % std::size(kNames);
    std::string bytes = base.files[chosen];
    for (size_t k = 2; k + 2 < size; k += 3) {
        const size_t at = 256u * data[k] + data[k + 1];
        bytes[at % (k % 2 ? bytes.size() : std::min<size_t>(bytes.size(), 100))] =
            char(data[k + 2]);
    }
    if (data[1] % 2) bytes.resize(bytes.size() * data[1] / 256);
    fuzz::getFolder().write("kept/" + std::string(kNames[chosen]), bytes);

    std::vector<std::string> notes;
    const ReductionCheckpoint checkpoint(fuzz::getFolder() / "kept", 0,
                                         [&](const std::string& note) { notes.push_back(note); });
    const ReducedBody body = run(checkpoint);
    size_t numResumed = 0;
    for (const std::string& note : notes) numResumed += note.compare(0, 12, "resumed from") == 0;
    if (numResumed != std::size(kNames) - (bytes != base.files[chosen]))
        fuzz::fail("a damaged file was accepted, or a whole one was not");
    if (body.omegaSquared != base.body.omegaSquared || body.Phi != base.body.Phi ||
        body.I1 != base.body.I1 || body.N != base.body.N)
        fuzz::fail("a damaged file changed the part");
    return 0;
}
