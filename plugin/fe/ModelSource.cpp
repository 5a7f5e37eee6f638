#include "simflex/fe/ModelSource.h"

#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/InputFile.h"
#include "simflex/fe/AbaqusMatrices.h"
#include "simflex/fe/ArrayMatrices.h"
#include "simflex/fe/MatrixMarket.h"
#include "simflex/part/ArrayFile.h"

namespace simflex {
namespace {

enum class Kind { Deck, MatrixMarket, AbaqusMatrices, NastranDmig, Arrays, Gmsh };

bool isMatrixMarket(const std::string& path) {
    std::ifstream in = openInputFile(path);
    std::string word;
    in >> word;
    return lowerCase(word) == "%%matrixmarket";
}

Kind findKind(const std::string& path) {
    const std::string suffix = lowerCase(std::filesystem::path(path).extension().string());
    for (const char* deck : {".inp", ".bdf", ".nas", ".dat", ".cdb"})
        if (suffix == deck) return Kind::Deck;
    if (suffix == ".mtx") return isMatrixMarket(path) ? Kind::MatrixMarket : Kind::AbaqusMatrices;
    if (suffix == ".pch") return Kind::NastranDmig;
    if (isArrayFile(path)) return Kind::Arrays;
    for (const char* gmsh : {".msh", ".unv", ".geo", ".step", ".stp", ".brep", ".iges", ".igs"})
        if (suffix == gmsh) return Kind::Gmsh;
    throw std::invalid_argument(
        "'" + path + "' ends in " + (suffix.empty() ? "nothing" : "'" + suffix + "'") +
        "; simflex reads .inp (CalculiX or Abaqus deck), .bdf, .nas and .dat (Nastran bulk data), "
        ".cdb (Ansys), "
        ".mtx (Matrix Market or Abaqus matrices), .pch "
        "(Nastran DMIG), .mat (MATLAB), .npz (NumPy), .msh, .unv, .geo, .step, .stp, .brep, .iges "
        "and .igs (Gmsh)");
}

/** Refuses options that do not apply to the source, and requires those it needs. **/
void checkOptions(const SourceOptions& options, Kind kind) {
    const bool isMatrix = kind != Kind::Deck && kind != Kind::Gmsh && kind != Kind::Arrays;
    const bool isMtx = isMatrix && kind != Kind::NastranDmig;
    const auto need = [&](const std::string& value, const char* option, const char* what) {
        if (value.empty())
            throw std::invalid_argument(options.path + ": it needs " + option + " (" + what + ")");
    };
    const auto forbid = [&](bool isGiven, const char* option, const char* of) {
        if (isGiven)
            throw std::invalid_argument(options.path + ": " + option + " belongs to " + of);
    };
    if (isMtx) need(options.massMatrix, "--mass-matrix", "the file of the mass matrix");
    if (isMatrix) need(options.nodes, "--nodes", "where the nodes are: table, deck or bulk data");
    if (kind == Kind::Gmsh)
        need(options.material, "--material", "a name, or E=…,nu=…,rho=… in SI units");
    forbid(!isMatrix && !options.massMatrix.empty(), "--mass-matrix", ".mtx and .pch");
    forbid(!isMatrix && !options.nodes.empty(), "--nodes", ".mtx and .pch");
    forbid(kind != Kind::MatrixMarket && !options.dofs.empty(), "--dofs", "Matrix Market files");
    forbid(kind != Kind::Deck && options.calculix.hasCalculixShells, "--calculix-shells", "decks");
    forbid(kind != Kind::Deck && options.calculix.leavesContactOut, "--without-contact", "decks");
    if (kind != Kind::Deck && kind != Kind::Gmsh && !options.calculix.derivatives.empty())
        throw std::invalid_argument(options.path + ": derivative by '" +
                                    options.calculix.derivatives[0] +
                                    "': matrices do not say what they are made of; --derivative "
                                    "belongs to decks and geometry");
    forbid(kind != Kind::Gmsh && !options.material.empty(), "--material",
           "Gmsh meshes; in a deck the material is *ELASTIC and *DENSITY");
    forbid(kind != Kind::Gmsh &&
               (options.gmsh.meshSize > 0 || options.gmsh.order || options.gmsh.lengthUnit > 0 ||
                options.gmsh.thickness > 0 || !options.gmsh.settings.empty() ||
                !options.gmsh.solids.empty() || !options.gmsh.keepDeck.empty()),
           "an option of the mesh", "Gmsh meshes and geometry");
    forbid(kind == Kind::Gmsh && options.units != "m-kg-s", "--units",
           "decks and matrices; of geometry give --length-unit");
}

FeModel readKind(const SourceOptions& options, Kind kind) {
    const ProgressCallback& progress = options.calculix.progress;
    switch (kind) {
        case Kind::Deck:
            return readCalculixDeck(options.path, options.calculix);
        case Kind::MatrixMarket: {
            MatrixMarketOptions market;
            market.dofs = options.dofs;
            market.progress = progress;
            return readMatrixMarket(options.path, options.massMatrix, options.nodes, market);
        }
        case Kind::AbaqusMatrices:
            return readAbaqusMatrices(options.path, options.massMatrix, options.nodes, progress);
        case Kind::NastranDmig: {
            NastranDmigOptions dmig;
            dmig.stiffnessName = options.stiffnessName;
            dmig.massName = options.massName;
            dmig.massFile = options.massMatrix;
            dmig.progress = progress;
            return readNastranDmig(options.path, options.nodes, dmig);
        }
        case Kind::Arrays:
            return readArrayMatrices(options.path, progress);
        case Kind::Gmsh:
            break;
    }
    GmshOptions gmsh = options.gmsh;
    for (const NamedMaterial& named : parseMaterials(options.material))
        if (named.name.empty())
            gmsh.material = named.material;
        else
            gmsh.materials.push_back(named);
    gmsh.calculix = options.calculix;
    return readGmshPart(options.path, gmsh);
}

}  // namespace

bool isCalculixDeck(const SourceOptions& options) {
    return findKind(options.path) == Kind::Deck && options.units == "m-kg-s";
}

FeModel readModelSource(const SourceOptions& options) {
    const Kind kind = findKind(options.path);
    checkOptions(options, kind);
    const UnitSystem& units = findUnitSystem(options.units);
    FeModel model;
    try {
        model = readKind(options, kind);
    } catch (const std::bad_alloc&) {
        throw std::runtime_error("there is not enough memory for the part '" + options.path + "'");
    }
    // Decks have already reported their notes.
    const bool isTold = kind == Kind::Deck || kind == Kind::Gmsh;
    const size_t numNotes = isTold ? model.notes.size() : 0,
                 numWarnings = isTold ? model.warnings.size() : 0;
    if (units.name != "m-kg-s") convertToSI(model, units);
    const std::string suffix = lowerCase(std::filesystem::path(options.path).extension().string());
    const bool isStated =
        suffix == ".step" || suffix == ".stp" || suffix == ".iges" || suffix == ".igs";
    for (std::string& warning :
         kind == Kind::Gmsh
             ? checkGeometryUnits(model, {options.gmsh.lengthUnit, isStated, options.gmsh.meshSize})
             : checkUnits(model))
        model.warnings.push_back(std::move(warning));
    if (options.calculix.note)
        for (size_t k = numNotes; k < model.notes.size(); ++k)
            options.calculix.note(model.notes[k]);
    if (options.calculix.warn)
        for (size_t k = numWarnings; k < model.warnings.size(); ++k)
            options.calculix.warn(model.warnings[k]);
    return model;
}

}  // namespace simflex
