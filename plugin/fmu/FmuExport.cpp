#include "simflex/fmu/FmuExport.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/ZipFile.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "simflex/base/AsciiText.h"
#include "simflex/base/Hash.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/base/TemporaryFolder.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/fmi/FmuDescription.h"
#include "simflex/fmu/LibraryCopy.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/parts/PartBuilder.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex {

using namespace model;
using fmu::Manifest;

namespace fs = std::filesystem;

namespace {

using Causality = FmuVariable::Causality;

bool isWordCharacter(char c) {
    return isLetter(c) || isDigit(c) || c == '_';
}

/** Returns the names in a formula, without components: "tip" for "tip.x". **/
std::set<std::string> findNames(const std::string& formula) {
    std::set<std::string> names;
    for (size_t i = 0; i < formula.size();) {
        const size_t begin = i;
        while (i < formula.size() && isWordCharacter(formula[i])) ++i;
        if (i == begin) {
            ++i;
            continue;
        }
        const bool isComponent = begin > 0 && formula[begin - 1] == '.';
        if (!isComponent && !isDigit(formula[begin]))
            names.insert(formula.substr(begin, i - begin));
    }
    return names;
}

void visitScalars(const ModelValue& value, const std::function<void(const ModelValue&)>& visit) {
    if (value.isScalar()) visit(value);
    for (int i = 0; value.isList() && i < value.getSize(); ++i) visitScalars(value.at(i), visit);
    for (const std::string& key : value.getKeys()) visitScalars(value.get(key), visit);
}

/** Returns the parameters that a value depends on, directly or through others. **/
std::set<std::string> findParameters(const ModelValue& file, const ModelValue& value) {
    const ModelValue parameters = file.get("parameters");
    std::set<std::string> found;
    std::function<void(const ModelValue&)> visit = [&](const ModelValue& scalar) {
        for (const std::string& name : findNames(scalar.getNode().scalar))
            if (parameters.has(name) && found.insert(name).second) visit(parameters.get(name));
    };
    visitScalars(value, visit);
    return found;
}

/** Returns the inputs that a probe depends on directly; nothing: possibly all of them. **/
std::optional<std::vector<std::string>> findInputs(const ModelValue& file,
                                                   const ModelValue& probe) {
    // Positions and velocities depend on no inputs; forces and accelerations may.
    for (const char* kind :
         {"position", "velocity", "orientation", "angular_velocity", "coordinate", "rate",
          "distance", "distance_rate", "displacement", "function"})
        if (probe.has(kind)) return std::vector<std::string>();
    const char* formula = probe.has("expression") ? "expression" : "state";
    if (!probe.has(formula)) return {};
    std::set<std::string> inputs;
    for (const std::string& name : findNames(probe.get(formula).getText())) {
        if (file.get("inputs").has(name)) inputs.insert(name);
        if (file.get("states").has(name)) return {};
        if (!file.get("probes").has(name) || name == probe.getName()) continue;
        const auto further = findInputs(file, file.get("probes").get(name));
        if (!further) return {};
        inputs.insert(further->begin(), further->end());
    }
    return std::vector<std::string>(inputs.begin(), inputs.end());
}

std::string makeIdentifier(const std::string& path) {
    std::string identifier = fs::path(path).stem().string();
    for (char& c : identifier)
        if (!isWordCharacter(c)) c = '_';
    return identifier.empty() || isDigit(identifier[0]) ? "model_" + identifier : identifier;
}

/** Returns a name without special characters of YAML and archives. **/
std::string makePlainName(int number, const std::string& name) {
    std::string plain = std::to_string(number) + '-' + name;
    for (char& c : plain)
        if (!isWordCharacter(c) && c != '.' && c != '-') c = '_';
    return plain;
}

void addContents(const std::string& path, Hash& sum) {
    std::ifstream file = openInputFile(path);
    sum.add(std::string(std::istreambuf_iterator<char>(file), {}));
}

class Packer {
public:
    Packer(const ModelText& text, const FmuExportOptions& options)
        : m_options(options), m_text(text), m_file(readModel(text)) {}

    FmuExportReport pack(const std::string& path) {
        checkReplaceable(path, "PK", "FMU");
        const ModelOptions modelOptions = makeModelOptions();
        const Session session(m_text, modelOptions);
        listVariables(session);
        ZipWriter zip(path);
        m_manifest.model = fs::path(m_text.path).filename().string();
        if (m_manifest.model.empty()) m_manifest.model = "model.yaml";
        Hash sum;
        sum.add(m_text.text);
        addParts(modelOptions, zip, sum);
        addFiles(zip, sum);
        m_manifest.settings = m_text.settings;
        for (const std::string& setting : m_manifest.settings) {
            sum.add(setting);
            if (setting.find('\n') != std::string::npos)
                throw std::runtime_error("a setting of several lines cannot be kept in an FMU: " +
                                         setting);
        }
        sum.add(std::string(SIMFLEX_VERSION));
        m_manifest.token = "{simflex-" + sum.getText() + "}";
        const FmuDescription description = describe(session);
        zip.add("modelDescription.xml", writeFmuDescription(description));
        zip.add("resources/" + m_manifest.model, m_text.text);
        zip.add(std::string("resources/") + Manifest::FileName, m_manifest.write());
        const std::string folder =
            m_options.version == 3 ? "binaries/x86_64-linux/" : "binaries/linux64/";
        const std::vector<fmu::LibraryFile> libraries =
            fmu::findLibraries(m_options.library, description.identifier, m_options.isThin);
        for (const fmu::LibraryFile& library : libraries) {
            zip.addFile(folder + library.name, library.path);
            const double done = double(++m_report.numLibraries) / double(libraries.size());
            if (!m_options.listener.tellProgress("packing libraries", done)) throw Cancelled();
        }
        zip.finish(Durability::ProcessEnd);
        m_report.bytes = double(fs::file_size(path));
        m_report.parameters = m_manifest.parameters;
        m_report.inputs = m_manifest.inputs;
        m_report.outputs = m_manifest.outputs;
        return m_report;
    }

private:
    ModelOptions makeModelOptions() const {
        ModelOptions options;
        options.code = m_options.code;
        options.listener = m_options.listener;
        return options;
    }

    void listVariables(const Session& session) {
        const std::set<std::string> ofParts = findParameters(m_file, m_file.get("parts"));
        for (const std::string& name : m_file.get("parameters").getKeys())
            (ofParts.count(name) ? m_report.fixed : m_manifest.parameters).push_back(name);
        for (const Model::InputEntry& input : session.getModel().getInputs())
            m_manifest.inputs.push_back(input.name);
        m_manifest.outputs = fmu::listOutputs(session.getProbes());
    }

    /** Adds the parts as reduced now. **/
    void addParts(const ModelOptions& modelOptions, ZipWriter& zip, Hash& sum) {
        const TemporaryFolder folder;
        int number = 0;
        for (const auto& [name, part] : makeParts(m_file, modelOptions)) {
            const std::string file = "parts/" + makePlainName(++number, name + ".h5"),
                              path = folder.path() / "part.h5";
            writeReducedBody(path, *part);
            zip.addFile("resources/" + file, path);
            addContents(path, sum);
            m_text.set("parts." + name, "{file: " + file + "}");
        }
    }

    /** Adds the files that the model reads: tables, meshes of bodies. **/
    void addFiles(ZipWriter& zip, Hash& sum) {
        int number = 0;
        visitScalars(m_file, [&](const ModelValue& scalar) {
            const SchemaForm* form = scalar.getNode().form;
            const std::string path = scalar.getPath();
            if (!form || form->kind != SchemaForm::Kind::File || path.compare(0, 6, "parts.") == 0)
                return;
            const std::string source = scalar.getFilePath(),
                              name =
                                  "files/" + makePlainName(++number, fs::path(source).filename());
            zip.addFile("resources/" + name, source);
            addContents(source, sum);
            m_text.set(path, name);
        });
    }

    FmuDescription describe(const Session& session) const {
        FmuDescription description;
        description.version = m_options.version;
        description.name = session.getTitle();
        description.text =
            m_file.get("description").isGiven() ? m_file.get("description").getText() : "";
        description.token = m_manifest.token;
        description.identifier = makeIdentifier(m_text.path);
        description.tool = std::string("simflex ") + SIMFLEX_VERSION;
        description.canKeepState = description.canSerializeState = true;
        description.hasDerivatives = true;
        description.canInterpolateInputs = true;
        const ModelValue analyses = m_file.get("analyses");
        for (const std::string& name : analyses.getKeys()) {
            const ModelValue analysis = analyses.get(name);
            if (analysis.get("type").getText() != "transient" || description.stopTime) continue;
            if (analysis.has("duration"))
                description.stopTime = analysis.get("duration").getNumber();
            if (analysis.has("interval"))
                description.stepSize = analysis.get("interval").getNumber();
        }
        const auto add = [&](const std::string& name, Causality causality) -> FmuVariable& {
            FmuVariable variable;
            variable.name = name;
            variable.causality = causality;
            variable.reference = unsigned(description.variables.size());
            description.variables.push_back(variable);
            return description.variables.back();
        };
        const bool isTaken = m_file.get("probes").has("time") || m_file.get("inputs").has("time");
        FmuVariable& time = add(isTaken ? "t" : "time", Causality::Independent);
        time.unit = "s";
        for (const std::string& name : m_manifest.parameters)
            add("parameters." + name, Causality::Parameter).start =
                m_file.get("parameters").get(name).getNumber();
        for (const Model::InputEntry& input : session.getModel().getInputs()) {
            FmuVariable& variable = add(input.name, Causality::Input);
            variable.unit = input.unit;
            variable.start = session.get("inputs." + input.name)[0];
        }
        size_t index = 0;
        for (const Probe& probe : session.getProbes())
            for (size_t i = 0; i < probe.columns.size(); ++i) {
                FmuVariable& variable = add(m_manifest.outputs[index++], Causality::Output);
                variable.unit = probe.unit;
                variable.dependencies = findInputs(m_file, m_file.get("probes").get(probe.name));
            }
        return description;
    }

    FmuExportOptions m_options;
    ModelText m_text;
    ModelValue m_file;
    Manifest m_manifest;
    FmuExportReport m_report;
};

}  // namespace

FmuExportReport exportFmu(const ModelText& text, const std::string& path,
                          const FmuExportOptions& options) {
    if (options.version != 2 && options.version != 3)
        throw std::invalid_argument("FMUs are written of FMI 2 and 3, not " +
                                    std::to_string(options.version));
    return Packer(text, options).pack(path);
}

}  // namespace simflex
