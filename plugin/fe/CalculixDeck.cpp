#include "simflex/fe/CalculixDeck.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <stdexcept>

#include "simflex/base/Archive.h"
#include "simflex/base/Hash.h"
#include "simflex/fe/calculix/CalculixRun.h"
#include "simflex/fe/decks/DeckBuilder.h"
#include "simflex/fe/decks/IncompatibleModes.h"
#include "simflex/fe/decks/IntegratedSolids.h"

namespace simflex {
namespace {

/** Has ccx assemble all but the solids that are integrated here. **/
void assembleByCalculix(const DeckModel& deck, const std::string& program,
                        const ProgressCallback& progress, FeModel& model) {
    const std::string job = "part";
    const TemporaryFolder folder;
    {
        std::ofstream out(folder.path() / (job + ".inp"));
        out.imbue(std::locale::classic());
        deck.writeClean(out);
        if (!out.flush())
            throw std::runtime_error("cannot write to " + folder.path().string() +
                                     "; is the disk full?");
    }
    std::vector<char> expected(size_t(deck.mesh.numNodes()), 0);
    for (const auto& [type, solids] : deck.solids)
        for (const auto& solid : solids)
            for (const int node : solid.nodes)
                if (!isIntegratedSolid(type)) expected[size_t(deck.mesh.indexOf(node))] = 1;
    std::fill(expected.end() - deck.mesh.numInternalNodes, expected.end(), char(1));
    runCalculix(program, folder.path(), job, progress);
    readCalculixMatrices(folder.path(), job, expected, model, progress);
    turnToInternalNodes(deck, model);
}

void addPointMasses(const DeckModel& deck, FeModel& model) {
    for (const auto& [number, mass] : deck.masses) {
        const auto node = size_t(deck.mesh.indexOf(number));
        const auto first = size_t(model.m.columnStarts[node]);
        const bool hasDiagonal = model.m.columnStarts[node + 1] > std::int64_t(first) &&
                                 model.m.rows[first] == int(node);
        if (!hasDiagonal) {
            model.m.rows.insert(model.m.rows.begin() + std::ptrdiff_t(first), int(node));
            model.m.values.insert(model.m.values.begin() + std::ptrdiff_t(first), 0);
            for (size_t k = node + 1; k < model.m.columnStarts.size(); ++k)
                ++model.m.columnStarts[k];
        }
        model.m.values[first] += mass;
    }
}

/** K and m of the deck's elements. **/
void assemble(const DeckModel& deck, const std::string& program, const ProgressCallback& progress,
              FeModel& model) {
    if (deck.isForCalculix()) {
        assembleByCalculix(deck, program, progress, model);
    } else {
        model.K = SymmetricMatrix::fromEntries(3 * model.mesh.numNodes(), {}, {}, {});
        model.m = SymmetricMatrix::fromEntries(model.mesh.numNodes(), {}, {}, {});
    }
    addIntegratedSolids(deck, model);
    addHingedElements(deck, model);
    addPointMasses(deck, model);
    addSprings(deck, model);
}

void visitMatrix(Archive& archive, SymmetricMatrix& A) {
    archive.visit(A.columnStarts, A.rows, A.values);
    A.size = int(A.columnStarts.size()) - 1;
}

/** Of all in the deck that the matrices depend on. **/
Hash hashCards(const std::vector<DeckCard>& cards) {
    Hash hash;
    for (const DeckCard& card : cards) {
        if (card.keyword == NoteCard) continue;
        hash.add(card.keyword);
        for (const auto& [parameter, value] : card.parameters) hash.add(parameter + "=" + value);
        for (const DeckLine& line : card.data)
            for (const std::string& field : line.fields) hash.add(field);
    }
    return hash;
}

}  // namespace

FeModel readCalculixDeck(const std::string& path, const CalculixOptions& options) {
    reportProgress(options.progress, ReadingDeck, 0);
    std::vector<DeckCard> cards = readModelCards(path, options.progress);
    reportProgress(options.progress, ReadingDeck, ReadingCards);
    Hash hash;
    if (options.checkpoint) hash = hashCards(cards);
    DeckModel deck =
        buildDeckModel(path, std::move(cards),
                       options.leavesContactOut ? ContactUse::LeftOut : ContactUse::Refused);
    if (options.note)
        for (const std::string& note : deck.notes) options.note(note);
    if (options.warn)
        for (const std::string& warning : deck.warnings) options.warn(warning);

    const std::string program = chooseCalculixProgram(options.program);
    FeModel model;
    model.source = path;
    model.program = readCalculixVersion(program);
    hash.add(model.program);
    model.mesh = deck.mesh;
    model.constraints = deck.constraints;
    model.notes = deck.notes;
    model.warnings = deck.warnings;

    const auto visit = [&model](Archive& archive) {
        visitMatrix(archive, model.K);
        visitMatrix(archive, model.m);
    };
    try {
        if (!options.checkpoint || !options.checkpoint->load("matrices", hash.get(), visit)) {
            const auto start = std::chrono::steady_clock::now();
            assemble(deck, program, options.progress, model);
            const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
            if (options.checkpoint)
                options.checkpoint->save("matrices", hash.get(), spent.count(), visit);
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
    return buildDeckModel(path, readModelCards(path)).mesh;
}

}  // namespace simflex
