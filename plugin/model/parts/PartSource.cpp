#include "simflex/model/parts/PartSource.h"

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/ModelSource.h"
#include "simflex/fe/NodeSelection.h"
#include "simflex/model/builders/ModelGeometry.h"
#include "simflex/model/builders/ModelSystem.h"
#include "simflex/model/file/ModelTexts.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/parts/FileLock.h"
#include "simflex/model/parts/PartCache.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace model {

namespace fs = std::filesystem;

namespace {

/** Number of additional normal modes of a finer part. **/
constexpr int FurtherModes = 24;

struct Request {
    SourceOptions source;
    ReductionOptions reduction;
    PartKey key;
};

std::string readMaterial(const ModelValue& value) {
    if (!value.isMap()) return value.getText();
    return "E=" + writeGeneral(value.get("youngs_modulus").getNumber()) +
           ",nu=" + writeGeneral(value.get("poissons_ratio").getNumber()) +
           ",rho=" + writeGeneral(value.get("density").getNumber());
}

std::string readFile(const ModelValue& value) {
    const std::string path = value.getFilePath();
    if (!isInputFile(path)) failMissingFile(value);
    return path;
}

void readMatrices(const ModelValue& value, SourceOptions& source) {
    source.path = readFile(value.get("stiffness"));
    source.massMatrix = readFile(value.get("mass"));
    source.nodes = readFile(value.get("nodes"));
    if (value.has("dofs")) source.dofs = readFile(value.get("dofs"));
    if (value.has("stiffness_name")) source.stiffnessName = value.get("stiffness_name").getText();
    if (value.has("mass_name")) source.massName = value.get("mass_name").getText();
}

void readGeometry(const ModelValue& part, SourceOptions& source) {
    source.path = readFile(part.get("geometry"));
    if (!part.has("material") && !part.has("materials"))
        part.fail("a geometry needs its material: material: steel");
    if (part.has("material")) source.material = readMaterial(part.get("material"));
    withPlace(part.get("material"), [&] { parseMaterials(source.material); });
    const ModelValue materials = part.get("materials");
    for (const std::string& name : materials.getKeys()) {
        const std::string material = readMaterial(materials.get(name));
        withPlace(materials.get(name), [&] { parseMaterial(material); });
        source.material += ";" + name + "=" + material;
    }
    if (part.has("solids")) source.gmsh.solids = part.get("solids").getTexts();
    if (part.has("mesh_size")) source.gmsh.meshSize = part.get("mesh_size").getNumber();
    if (part.has("order")) source.gmsh.order = part.get("order").getInteger();
    if (part.has("thickness")) source.gmsh.thickness = part.get("thickness").getNumber();
    if (part.has("length_unit")) source.gmsh.lengthUnit = part.get("length_unit").getNumber();
    const ModelValue settings = part.get("settings");
    for (const std::string& name : settings.getKeys())
        source.gmsh.settings.emplace_back(name, settings.get(name).getNumber());
}

InterfaceOptions readInterface(const ModelValue& value) {
    InterfaceOptions interface;
    interface.name = value.getName();
    if (!value.isMap()) {
        interface.nodes = value.getText();
        return interface;
    }
    interface.nodes = value.get("nodes").getText();
    if (value.has("tie") && value.get("tie").getText() == "distributing")
        interface.tie = TieType::Distributing;
    if (value.has("master")) {
        const SimTK::Vec3 p = value.get("master").getVec3();
        interface.master = {p[0], p[1], p[2]};
    }
    return interface;
}

void readLoadPoints(const ModelValue& value, std::vector<LoadPoint>& points) {
    if (!value.isGiven()) return;
    for (int i = 0; i < value.getSize(); ++i) {
        const ModelValue item = value.isMap() ? value : value.at(i);
        LoadPoint point;
        point.nodes = item.isMap() ? item.get("nodes").getText() : item.getText();
        if (item.has("axes")) point.axes = item.get("axes").getText();
        points.push_back(point);
        if (value.isMap()) return;
    }
}

std::optional<StressOptions> readStress(const ModelValue& value) {
    if (!value.isGiven()) return {};
    StressOptions stress;
    const std::vector<std::string> texts = value.getTexts();
    if (texts.size() == 1) {
        if (texts[0] == "none") return {};
        if (texts[0] == "skin") return stress;
    }
    stress.nodes = StressOptions::Nodes::All;
    if (texts.size() == 1 && texts[0] == "all") return stress;
    stress.nodes = StressOptions::Nodes::Sets;
    stress.sets = texts;
    return stress;
}

ReductionOptions readReduction(const ModelValue& part, ModelOptions::Bodies bodies) {
    ReductionOptions reduction;
    reduction.name = part.getName();
    const ModelValue interfaces = part.get("interfaces");
    for (const std::string& name : interfaces.getKeys())
        reduction.interfaces.push_back(readInterface(interfaces.get(name)));
    readLoadPoints(part.get("load_points"), reduction.loadPoints);
    if (part.has("modes")) reduction.numModes = part.get("modes").getInteger();
    if (part.has("up_to")) reduction.highestFrequency = part.get("up_to").getNumber();
    if (part.has("inertia_relief"))
        reduction.hasInertiaRelief = part.get("inertia_relief").getBool();
    if (part.has("at_frequency")) {
        const ModelValue frequencies = part.get("at_frequency");
        reduction.frequencies = frequencies.isScalar() ? std::vector{frequencies.getNumber()}
                                                       : frequencies.getNumbers();
    }
    if (part.has("stiffening") && part.get("stiffening").getBool()) reduction.hasStiffening = true;
    reduction.stress = readStress(part.get("stress"));
    if (bodies == ModelOptions::Bodies::Finer) reduction.numFurtherModes = FurtherModes;
    return reduction;
}

void addToKey(const Request& request, PartKey& key) {
    const SourceOptions& source = request.source;
    for (const std::string& file : {source.path, source.massMatrix, source.nodes, source.dofs})
        if (file.empty())
            key.add(std::string());
        else
            key.addFile(file);
    for (const std::string& text :
         {source.stiffnessName, source.massName, source.material, source.units})
        key.add(text);
    if (source.gmsh.thickness > 0) {
        key.add(std::string("thickness"));
        key.add(source.gmsh.thickness);
    }
    if (source.calculix.leavesContactOut) key.add(std::string("without contact"));
    for (const std::string& name : source.calculix.derivatives) key.add("derivative " + name);
    for (const double number :
         {source.gmsh.meshSize, double(source.gmsh.order), source.gmsh.lengthUnit})
        key.add(number);
    for (const std::string& solid : source.gmsh.solids) key.add("solid " + solid);
    key.add(double(source.gmsh.settings.size()));
    for (const auto& [name, value] : source.gmsh.settings) key.add(name), key.add(value);

    const ReductionOptions& reduction = request.reduction;
    key.add(double(reduction.interfaces.size()));
    for (const InterfaceOptions& interface : reduction.interfaces) {
        key.add(interface.name);
        key.add(interface.nodes);
        key.add(double(interface.tie == TieType::Distributing));
        key.add(double(bool(interface.master)));
        if (interface.master)
            for (const double x : *interface.master) key.add(x);
    }
    key.add(double(reduction.loadPoints.size()));
    for (const LoadPoint& point : reduction.loadPoints) key.add(point.nodes), key.add(point.axes);
    key.add(double(reduction.numModes));
    key.add(reduction.highestFrequency.value_or(0));
    key.add(double(reduction.hasStiffening));
    if (reduction.hasInertiaRelief) key.add(std::string("inertia relief"));
    for (const double hertz : reduction.frequencies) {
        key.add(std::string("frequency"));
        key.add(hertz);
    }
    if (reduction.numFurtherModes > 0) {
        key.add(std::string("further modes"));
        key.add(double(reduction.numFurtherModes));
    }
    key.add(reduction.stress ? double(1 + int(reduction.stress->nodes)) : 0.0);
    if (reduction.stress) {
        key.add(double(reduction.stress->sets.size()));
        for (const std::string& set : reduction.stress->sets) key.add(set);
    }
}

Request readRequest(const ModelValue& part, ModelOptions::Bodies bodies) {
    Request request;
    SourceOptions& source = request.source;
    if (part.has("without_contact"))
        source.calculix.leavesContactOut = part.get("without_contact").getBool();
    if (part.has("derivatives")) source.calculix.derivatives = part.get("derivatives").getTexts();
    if (part.has("deck"))
        source.path = readFile(part.get("deck"));
    else if (part.has("geometry"))
        readGeometry(part, source);
    else
        readMatrices(part.get("matrices"), source);
    if (part.has("units")) {
        source.units = part.get("units").getText();
        withPlace(part.get("units"), [&] { findUnitSystem(source.units); });
    }
    request.reduction = readReduction(part, bodies);
    const ReductionOptions& reduction = request.reduction;
    if ((reduction.hasStiffening || reduction.stress) && part.has("matrices"))
        part.get(reduction.hasStiffening ? "stiffening" : "stress")
            .fail("it needs the elements of a deck or geometry, and matrices are without them");
    withPlace(part, [&] { addToKey(request, request.key); });
    return request;
}

/** Checks node names before minutes of assembling and factoring. **/
void checkNodes(const ModelValue& value, const Mesh& mesh) {
    const ModelValue nodes = value.isMap() ? value.get("nodes") : value;
    try {
        selectNodes(mesh, nodes.getText());
    } catch (const std::invalid_argument& error) {
        std::vector<std::string> sets;
        for (const auto& set : mesh.nodeSets) sets.push_back(set.first);
        const std::string nearest = findNearestName(nodes.getText(), sets);
        nodes.fail(error.what() + (nearest.empty() ? "" : " Did you mean '" + nearest + "'?"));
    }
}

void checkAllNodes(const ModelValue& part, const Mesh& mesh) {
    const ModelValue interfaces = part.get("interfaces"), points = part.get("load_points");
    for (const std::string& name : interfaces.getKeys()) checkNodes(interfaces.get(name), mesh);
    if (!points.isGiven()) return;
    if (points.isMap()) return checkNodes(points, mesh);
    for (int i = 0; i < points.getSize(); ++i) checkNodes(points.at(i), mesh);
}

PartCache::Kept reduceModel(const FeModel& model, const ReductionOptions& options,
                            const ProgressCallback& progress,
                            const std::function<void(const std::string&)>& note) {
    std::vector<std::string> warnings = model.warnings;
    for (const std::string& warning : listInterfaceWarnings(model, options))
        warnings.push_back(warning);
    ReducedBody body = reduce(model, options, progress);
    if (const std::string equal = describeEqualModes(body, options); !equal.empty()) note(equal);
    return {std::move(body), warnings};
}

PartCache::Kept runReduction(const ModelValue& part, Request& request,
                             const ModelOptions& options) {
    const std::string name = request.reduction.name;
    const auto note = [&](const std::string& text) {
        options.listener.tellNote("part '" + name + "': " + text);
    };
    const ProgressCallback progress = [&](const std::string& phase, double fraction) {
        return options.listener.tellProgress(name + ": " + phase, fraction);
    };
    SourceOptions& source = request.source;
    source.calculix.note = note;
    source.calculix.progress = progress;
    source.gmsh.allowsScripts = options.code.scripts;
    if (isCalculixDeck(source)) checkAllNodes(part, readCalculixMesh(source.path));
    const FeModel model = readModelSource(source);
    checkAllNodes(part, model.mesh);
    return reduceModel(model, request.reduction, progress, note);
}

constexpr auto Wait = std::chrono::milliseconds(50);

/** Waits until no other process reduces the same part. **/
void waitFor(FileLock& lock, const std::string& part, const ModelOptions& options) {
    const std::string what = "waiting for another run that reduces part '" + part + "'";
    bool isTold = false;
    while (lock.tryToHold() == FileLock::State::Busy) {
        if (!options.listener.tellProgress(what, 0)) throw Cancelled();
        if (!options.listener.progress && !isTold) options.listener.tellNote(what);
        isTold = true;
        std::this_thread::sleep_for(Wait);
    }
}

}  // namespace

ReducedBody reducePart(const ModelValue& value, const ModelOptions& options) {
    Request request = readRequest(value, options.bodies);
    const PartCache cache(options.cacheFolder, options.listener.note);
    const auto warn = [&](const PartCache::Kept& kept) {
        for (const std::string& warning : kept.warnings)
            options.listener.tellWarning("part '" + value.getName() + "': " + warning);
    };
    const auto take = [&](PartCache::Kept kept) {
        options.listener.tellNote("part '" + value.getName() + "' is taken from the cache");
        warn(kept);
        kept.part.name = value.getName();
        return std::move(kept.part);
    };
    // The second search, below, reports a damaged entry.
    if (auto kept = PartCache(options.cacheFolder, {}).find(request.key))
        return take(std::move(*kept));
    FileLock lock(cache.prepareLock(request.key));
    waitFor(lock, value.getName(), options);
    if (auto kept = cache.find(request.key)) return take(std::move(*kept));
    try {
        PartCache::Kept made = runReduction(value, request, options);
        warn(made);
        cache.keep(request.key, made);
        return std::move(made.part);
    } catch (const Cancelled&) {
        throw;
    } catch (const ModelError&) {
        throw;
    } catch (const std::runtime_error& error) {
        value.fail(error.what());
    } catch (const std::logic_error& error) {
        value.fail(error.what());
    }
}

}  // namespace model
}  // namespace simflex
