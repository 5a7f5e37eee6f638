/** @file
Checkpoints of a run: changed bytes, with or without a matching checksum. An accepted one survives a
round trip. **/

#include <cstring>

#include "Fuzz.h"
#include "FuzzArchive.h"
#include "simflex/model/analyses/RunCheckpoint.h"

using namespace simflex;

namespace {

std::string readBytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::string makeBytes() {
    model::RunCheckpoint checkpoint;
    checkpoint.analysis = "run";
    checkpoint.numRows = 12;
    checkpoint.integrator = "state of the integrator";
    model::writeRunCheckpoint(fuzz::getFolder() / "seed", checkpoint);
    return readBytes(fuzz::getFolder() / "seed");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const std::string whole = makeBytes();
    std::string bytes = whole;
    const unsigned mode = size > 0 ? data[0] : 0;
    for (size_t k = 1; k + 2 < size; k += 3)
        bytes[(256u * data[k] + data[k + 1]) % bytes.size()] = char(data[k + 2]);
    if (mode & 2) bytes.resize(bytes.size() * (mode >> 2) / 64);
    if (mode & 1) fuzz::mendArchive(bytes);

    const std::string path = fuzz::getFolder().write("run.checkpoint", bytes);
    model::RunCheckpoint checkpoint;
    if (!fuzz::accepts([&] { checkpoint = model::readRunCheckpoint(path); })) return 0;
    if (checkpoint.numRows < 0) fuzz::fail("a negative number of rows");
    model::writeRunCheckpoint(path, checkpoint);
    const std::string written = readBytes(path);
    model::RunCheckpoint again = model::readRunCheckpoint(path);
    model::writeRunCheckpoint(path, again);
    if (readBytes(path) != written)
        fuzz::fail("a checkpoint that was written reads back as another");
    return 0;
}
