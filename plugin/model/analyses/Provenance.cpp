#include "simflex/model/analyses/Provenance.h"

#include <filesystem>
#include <fstream>
#include <vector>

#include "simflex/base/Hash.h"

namespace simflex {
namespace model {
namespace {

namespace fs = std::filesystem;

std::string sumNumbers(const ReducedBody& part) {
    Hash hash;
    hash.add(part.mass);
    hash.add(part.omegaSquared);
    hash.add(part.Phi);
    hash.add(part.mesh.positions);
    return hash.getText();
}

std::string calcFileChecksum(const std::string& path) {
    Hash hash;
    std::ifstream in(path, std::ios::binary);
    std::vector<char> block(1 << 16);
    while (in.read(block.data(), std::streamsize(block.size())) || in.gcount() > 0)
        hash.addBytes(block.data(), size_t(in.gcount()));
    return hash.getText();
}

bool isFile(const ModelValue& value) {
    const std::string text = value.getText();
    if (text.empty() || text.size() > 4000) return false;
    std::error_code ignored;
    return fs::is_regular_file(value.getFilePath(), ignored);
}

/** @param visit  (scalar that names a file) **/
template <class Visit>
void forEachFile(const ModelValue& value, const Visit& visit) {
    if (value.isMap()) {
        for (const std::string& key : value.getKeys()) forEachFile(value.get(key), visit);
    } else if (value.isList()) {
        for (int k = 0; k < value.getSize(); ++k) forEachFile(value.at(k), visit);
    } else if (value.isScalar() && isFile(value)) {
        visit(value);
    }
}

}  // namespace

InputChecksums calcInputChecksums(const Model& model) {
    InputChecksums sums;
    std::map<const ReducedBody*, std::string> ofParts;
    for (const Model::BodyEntry& body : model.getBodies()) {
        if (!body.flexible) continue;
        std::string& sum = ofParts[&body.flexible->getPart()];
        if (sum.empty()) sum = sumNumbers(body.flexible->getPart());
        sums["the part of body '" + body.name + "'"] = sum;
    }
    const auto addFile = [&](const ModelValue& file) {
        sums["the file '" + file.getText() + "'"] = calcFileChecksum(file.getFilePath());
    };
    for (const std::string& section : model.getFile().getKeys()) {
        if (section == "parts" || section == "output" || section == "pictures") continue;
        const ModelValue entries = model.getFile().get(section);
        if (section != "bodies") {
            forEachFile(entries, addFile);
            continue;
        }
        for (const std::string& body : entries.getKeys())
            for (const std::string& key : entries.get(body).getKeys())
                if (key != "part") forEachFile(entries.get(body).get(key), addFile);
    }
    return sums;
}

std::string findChangedInput(const InputChecksums& then, const InputChecksums& now) {
    for (const auto& [what, sum] : now) {
        const auto found = then.find(what);
        if (found == then.end() || found->second != sum) return what + " has changed since";
    }
    return "";
}

void collectFiles(const ModelValue& value, std::set<std::string>& paths) {
    forEachFile(value, [&](const ModelValue& file) { paths.insert(file.getFilePath()); });
}

}  // namespace model
}  // namespace simflex
