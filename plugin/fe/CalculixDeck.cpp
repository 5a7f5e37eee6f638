#include "simflex/fe/CalculixDeck.h"

#include <fstream>
#include <stdexcept>

#include "CalculixRun.h"
#include "DeckModel.h"

namespace simflex {

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

    const std::string job = "part";
    TemporaryFolder folder;
    {
        std::ofstream out(folder.path() / (job + ".inp"));
        deck.writeClean(out);
        if (!out.flush())
            throw std::runtime_error("cannot write to " + folder.path().string() +
                                     "; is the disk full?");
    }
    try {
        runCalculix(program, folder.path(), job, options.progress);
        readCalculixMatrices(folder.path(), job, model, options.progress);
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
