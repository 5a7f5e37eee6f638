#include "simflex/model/analyses/Provenance.h"

#include <fstream>
#include <vector>

#include "simflex/base/Hash.h"
#include "simflex/model/schema/Schema.h"

namespace simflex {
namespace model {
namespace {

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

/** The files that a value names, as the schema says where files are named.
@param visit      (scalar that names one)
@param looksInto  (key of a map): whether it counts **/
template <class Visit, class LooksInto>
void forEachFile(const ModelValue& value, const std::vector<SchemaForm>& forms, const Visit& visit,
                 const LooksInto& looksInto) {
    using Kind = SchemaForm::Kind;
    for (const SchemaForm& form : forms) {
        if (form.kind == Kind::File && value.isScalar()) {
            visit(value);
        } else if (form.kind == Kind::List && value.isList()) {
            for (int k = 0; k < value.getSize(); ++k)
                forEachFile(value.at(k), form.items, visit, looksInto);
        } else if (form.kind == Kind::Entries && value.isMap()) {
            for (const std::string& name : value.getKeys())
                forEachFile(value.get(name), form.items, visit, looksInto);
        } else if (form.kind == Kind::Map && value.isMap()) {
            for (const SchemaKey& key : form.keys)
                if (value.has(key.name) && looksInto(key.name))
                    forEachFile(value.get(key.name), key.forms, visit, looksInto);
        }
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
    forEachFile(model.getFile(), {getModelSchema()}, addFile,
                [](const std::string& key) { return key != "parts" && key != "part"; });
    return sums;
}

std::string findChangedInput(const InputChecksums& then, const InputChecksums& now) {
    if (then.empty()) return "";  // not known: an older simflex wrote them
    for (const auto& [what, sum] : now) {
        const auto found = then.find(what);
        if (found == then.end() || found->second != sum) return what + " has changed since";
    }
    return "";
}

void collectFiles(const ModelValue& model, std::set<std::string>& paths) {
    forEachFile(
        model, {getModelSchema()},
        [&](const ModelValue& file) { paths.insert(file.getFilePath()); },
        [](const std::string&) { return true; });
}

}  // namespace model
}  // namespace simflex
