#include "simflex/fe/CalculixDeck.h"

#include <chrono>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "CalculixRun.h"
#include "DeckModel.h"

namespace simflex {
namespace {

void putMatrix(CheckpointWriter& out, const SymmetricMatrix& A) {
    out.put(A.columnStarts);
    out.put(A.rows);
    out.put(A.values);
}

void getMatrix(CheckpointReader& in, SymmetricMatrix& A) {
    in.get(A.columnStarts);
    in.get(A.rows);
    in.get(A.values);
    A.size = int(A.columnStarts.size()) - 1;
}

/** Of all that the matrices depend on. **/
std::uint64_t calcKey(const DeckModel& deck, const FeModel& model) {
    std::ostringstream text;
    deck.writeClean(text);
    ContentHash hash;
    hash.add(text.str());
    hash.add(model.program);
    hash.add(model.mesh.nodeNumbers);
    return hash.get();
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
    const std::uint64_t key = options.checkpoint ? calcKey(deck, model) : 0;
    const auto start = std::chrono::steady_clock::now();
    try {
        if (!options.checkpoint ||
            !options.checkpoint->load("matrices", key, [&](CheckpointReader& in) {
                getMatrix(in, model.K);
                getMatrix(in, model.m);
            })) {
            runCalculix(program, folder.path(), job, options.progress);
            readCalculixMatrices(folder.path(), job, model, options.progress);
            const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
            if (options.checkpoint)
                options.checkpoint->save("matrices", key, spent.count(),
                                         [&](CheckpointWriter& out) {
                                             putMatrix(out, model.K);
                                             putMatrix(out, model.m);
                                         });
        }
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
