#include "simflex/fe/CalculixDeck.h"

#include <fstream>
#include <stdexcept>

#include "BeamMatrices.h"
#include "CalculixRun.h"
#include "DeckModel.h"

namespace simflex {
namespace {

/** Has ccx assemble all but the solids of beams. **/
void assembleByCalculix(const DeckModel& deck, const std::string& program,
                        const ProgressCallback& progress, FeModel& model) {
    const std::string job = "part";
    const TemporaryFolder folder;
    {
        std::ofstream out(folder.path() / (job + ".inp"));
        deck.writeClean(out);
        if (!out.flush())
            throw std::runtime_error("cannot write to " + folder.path().string() +
                                     "; is the disk full?");
    }
    std::vector<char> expected(size_t(deck.mesh.numNodes()), 0);
    for (const auto& [type, solids] : deck.solids)
        for (const auto& solid : solids)
            for (const int node : solid.nodes)
                if (type != kBeamSolid) expected[size_t(deck.mesh.indexOf(node))] = 1;
    runCalculix(program, folder.path(), job, progress);
    readCalculixMatrices(folder.path(), job, expected, model, progress);
}

}  // namespace

FeModel readCalculixDeck(const std::string& path, const CalculixOptions& options) {
    reportProgress(options.progress, "reading the deck", 0);
    DeckModel deck = DeckModel::fromCards(path, readDeckCards(path));
    if (options.note)
        for (const std::string& note : deck.notes) options.note(note);

    const std::string program = chooseCalculixProgram(options.program);
    FeModel model;
    model.source = path;
    model.program = readCalculixVersion(program);
    model.mesh = deck.mesh;
    model.constraints = deck.constraints;
    model.notes = deck.notes;

    try {
        if (deck.isForCalculix()) {
            assembleByCalculix(deck, program, options.progress, model);
        } else {
            model.K = SymmetricMatrix::fromEntries(3 * model.mesh.numNodes(), {}, {}, {});
            model.m = SymmetricMatrix::fromEntries(model.mesh.numNodes(), {}, {}, {});
        }
        addBeamMatrices(deck, model);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(path + ": " + error.what());
    } catch (const Cancelled&) {
        throw;
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(path + ": " + error.what());
    }
    reportProgress(options.progress, "checking K and M", 0);
    model.validate();
    return model;
}

Mesh readCalculixMesh(const std::string& path) {
    return DeckModel::fromCards(path, readDeckCards(path)).mesh;
}

}  // namespace simflex
