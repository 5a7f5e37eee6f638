/** @file
MBDyn's modal data. An accepted file is a valid part, which can be written and read again. **/

#include "Fuzz.h"
#include "simflex/part/MbdynFem.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const fuzz::Folder& folder = fuzz::getFolder();
    const std::string path =
        folder.write("part.fem", std::string(reinterpret_cast<const char*>(data), size));
    ReducedBody body;
    if (!fuzz::accepts([&] { body = readMbdynFem(path); })) return 0;
    body.validate();
    writeMbdynFem(folder / "again.fem", body);
    return 0;
}
