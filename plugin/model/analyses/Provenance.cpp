#include "simflex/model/analyses/Provenance.h"

#include <fstream>
#include <vector>

#include "simflex/base/Hash.h"
#include "simflex/base/InputFile.h"
#include "simflex/model/schema/Schema.h"

namespace simflex {
namespace model {
namespace {

template <class Matrices>
void addEach(Hash& hash, const Matrices& matrices) {
    for (const std::vector<double>& matrix : matrices) hash.add(matrix);
}

/** Adds everything of a part that a run uses; its origin and report are left out. **/
void addPart(Hash& hash, const ReducedBody& part) {
    hash.add(part.mass);
    for (const double value : part.centerOfMass) hash.add(value);
    for (const double value : part.inertia) hash.add(value);
    hash.add(part.omegaSquared);
    hash.add(part.I1);
    addEach(hash, part.I2);
    addEach(hash, part.N);
    for (const ReducedBody::Interface& interface : part.interfaces) {
        hash.add(interface.name);
        for (const double value : interface.position) hash.add(value);
        hash.add(interface.Phi);
        hash.add(interface.Psi);
        hash.add(interface.nodes);
        hash.add(interface.tie);
        hash.add(interface.weights);
    }
    if (part.stiffening) {
        addEach(hash, part.stiffening->turning);
        for (const auto& matrices : part.stiffening->interfaces) addEach(hash, matrices);
    }
    if (part.modalStress) {
        hash.add(part.modalStress->nodes);
        hash.add(part.modalStress->stress);
        hash.add(part.modalStress->strain);
    }
    hash.add(part.mesh.nodeNumbers);
    hash.add(part.mesh.positions);
    for (const ElementBlock& block : part.mesh.elements) {
        hash.add(block.type);
        hash.add(block.nodes);
        hash.add(block.isShell);
    }
    for (const auto& [name, nodes] : part.mesh.nodeSets) {
        hash.add(name);
        hash.add(nodes);
    }
    hash.add(part.Phi);
    if (part.further) {
        hash.add(part.further->coordinates);
        hash.add(part.further->displacements);
    }
    if (part.finer) addPart(hash, *part.finer);
}

std::string calcFileChecksum(const std::string& path) {
    Hash hash;
    std::ifstream in = openInputFile(path);
    std::vector<char> block(1 << 16);
    while (in.read(block.data(), std::streamsize(block.size())) || in.gcount() > 0)
        hash.addBytes(block.data(), size_t(in.gcount()));
    return hash.getText();
}

/** Visits the files named by a value, according to the schema.
@param visit      (scalar that names a file)
@param looksInto  (key of a map): whether to search the key **/
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

std::string calcPartChecksum(const ReducedBody& part) {
    Hash hash;
    addPart(hash, part);
    return hash.getText();
}

InputChecksums calcInputChecksums(const Model& model) {
    InputChecksums sums;
    std::map<const ReducedBody*, std::string> ofParts;
    for (const Model::BodyEntry& body : model.getBodies()) {
        if (!body.flexible) continue;
        std::string& sum = ofParts[&body.flexible->getPart()];
        if (sum.empty()) sum = calcPartChecksum(body.flexible->getPart());
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
    if (then.empty()) return "";  // written by an older simflex, without checksums
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
