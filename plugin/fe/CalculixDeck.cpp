#include "simflex/fe/CalculixDeck.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>

#include "simflex/base/Archive.h"
#include "simflex/base/Hash.h"
#include "simflex/fe/decks/DeckBuilder.h"
#include "simflex/fe/decks/DeckElements.h"
#include "simflex/fe/decks/DesignParameters.h"
#include "simflex/fe/elements/ElementAssembly.h"

namespace simflex {
namespace {

/** Assembling program; changes if the same deck gives other matrices. **/
constexpr const char* Program = "simflex, elements of 2026, revision 2";

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

/** Adds the contents of the deck besides FeModel::elements. **/
void addOthers(const DeckModel& deck, FeModel& model) {
    addHingedElements(deck, model);
    addPointMasses(deck, model);
    addSprings(deck, model);
}

/** Returns K and m of these only, on the nodes of the deck. **/
FeModel makeBeside(const DeckModel& deck) {
    FeModel model;
    model.source = deck.path;
    model.mesh.nodeNumbers = deck.mesh.nodeNumbers;
    model.mesh.positions = deck.mesh.positions;
    model.K = SymmetricMatrix::fromEntries(3 * model.mesh.numNodes(), {}, {}, {});
    model.m = SymmetricMatrix::fromEntries(model.mesh.numNodes(), {}, {}, {});
    addOthers(deck, model);
    return model;
}

/** Assembles K and m of the complete deck. **/
void assemble(const DeckModel& deck, const ProgressCallback& progress, FeModel& model) {
    assembleElements(*model.elements, model.mesh, model.K, model.m, progress);
    addOthers(deck, model);
}

/** See DesignParameter::variants. **/
FeModel makeVariant(DeckModel deck) {
    FeModel model = makeBeside(deck);
    model.elements = std::make_shared<const FeElements>(makeElements(deck));
    model.constraints = std::move(deck.constraints);
    return model;
}

void visitMatrix(Archive& archive, SymmetricMatrix& A) {
    archive.visit(A.columnStarts, A.rows, A.values);
    A.size = int(A.columnStarts.size()) - 1;
}

/** Hash of all cards that the matrices depend on. **/
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
    std::vector<DeckCard> cards =
        readModelCards(path, options.progress,
                       options.refusesIncludes ? DeckIncludes::Refused : DeckIncludes::Read);
    reportProgress(options.progress, ReadingDeck, ReadingCards);
    Hash hash;
    if (options.checkpoint) hash = hashCards(cards);
    std::vector<DeckCard> ofVariants;
    if (!options.derivatives.empty()) ofVariants = cards;
    const auto build = [&](std::vector<DeckCard> some) {
        return buildDeckModel(
            path, std::move(some),
            options.leavesContactOut ? ContactUse::LeftOut : ContactUse::Refused,
            options.hasCalculixShells ? ShellUse::CalculixSolids : ShellUse::Shells,
            options.progress);
    };
    DeckModel deck = build(std::move(cards));
    if (options.hasCalculixShells) hash.add(std::string("CalculiX's shells"));
    if (options.note)
        for (const std::string& note : deck.notes) options.note(note);
    if (options.warn)
        for (const std::string& warning : deck.warnings) options.warn(warning);

    FeModel model;
    model.source = path;
    model.program = Program;
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
        FeElements elements = makeElements(deck);
        if (elements.beside.hasSprings || elements.beside.hasHinged)
            elements.beside.K = makeBeside(deck).K;
        model.elements = std::make_shared<const FeElements>(std::move(elements));
        if (!options.checkpoint || !options.checkpoint->load("matrices", hash.get(), visit)) {
            const auto start = std::chrono::steady_clock::now();
            assemble(deck, options.progress, model);
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
    model.parameters = makeDesignParameters(ofVariants, options.derivatives, model,
                                            [&](std::vector<DeckCard> some) {
                                                reportProgress(options.progress, "derivatives", -1);
                                                return makeVariant(build(std::move(some)));
                                            });
    return model;
}

Mesh readCalculixMesh(const std::string& path) {
    return buildDeckModel(path, readModelCards(path)).mesh;
}

}  // namespace simflex
