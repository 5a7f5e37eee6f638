#pragma once
/** @file
The cards of a CalculiX (Abaqus-style) input deck, with *INCLUDE resolved. Internal to fe.

A card is a keyword line `*KEYWORD, PARAMETER=VALUE, …` with the data lines below it. As ccx does,
blanks are dropped and letters made upper case; `**` begins a comment. Names may stand in quotes.
Files may be UTF-8 or UTF-16, lines end in LF, CR LF or CR. **/

#include <map>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "simflex/base/Progress.h"

namespace simflex {

/** One data line, split at its commas. **/
struct DeckLine {
    int line = 0;
    std::vector<std::string> fields;  ///< blanks trimmed, upper case
    bool continues = false;           ///< the line ended in a comma
};

/** One keyword with its parameters and data. **/
struct DeckCard {
    std::string keyword;                            ///< without the star, no blanks: "SOLIDSECTION"
    std::string title;                              ///< as people write it: "*SOLID SECTION"
    std::map<std::string, std::string> parameters;  ///< without blanks; value empty for a flag
    std::string file;
    int line = 0;
    std::vector<DeckLine> data;

    /** "*SOLID SECTION", and its keyword. **/
    void setTitle(const std::string& text);

    bool has(const std::string& parameter) const { return parameters.count(parameter) > 0; }

    /** The parameter's value. @throws std::invalid_argument naming file and line if absent. **/
    const std::string& get(const std::string& parameter) const;

    /** "FILE:LINE: " for messages, of the keyword or of one data line. **/
    std::string where() const { return where(line); }
    std::string where(int atLine) const;
};

/** All cards of a deck and of the files it includes, in order.
@throws std::runtime_error for a file that cannot be read or an include that includes itself.
@throws Cancelled if progress asks to stop. **/
std::vector<DeckCard> readDeckCards(const std::string& path, const ProgressCallback& progress = {});

/** The phase in which decks are read, and the part of it that reading their cards takes. **/
constexpr const char* ReadingDeck = "reading the deck";
constexpr double ReadingCards = 0.6;

/** The keyword of a card that holds what stands before the first one. **/
constexpr const char* TextBeforeCards = "TEXTBEFORECARDS";

/** The keyword of a card by which a reader of another format tells what it did: its title. **/
constexpr const char* NoteCard = "NOTE";
DeckCard makeNoteCard(const std::string& text);

/** 1.5-3 is 1.5e-3: a sign that neither begins the number nor follows an exponent's letter. **/
std::string withExponentLetter(std::string_view number);

/** A number as ccx reads it (exponents of D or without letter, too).
@throws std::invalid_argument that begins with `where`. **/
double parseDeckNumber(const std::string& field, const std::string& where);

/** A whole number. @throws std::invalid_argument that begins with `where`. **/
int parseDeckInteger(const std::string& field, const std::string& where);

/** The same of a field of a data line, whose place is written out for a message alone. **/
double parseDeckNumber(const std::string& field, const DeckCard& card, const DeckLine& data);
int parseDeckInteger(const std::string& field, const DeckCard& card, const DeckLine& data);

/** Whether a field is a number rather than the name of a set. **/
bool isDeckNumber(const std::string& field);

/** The number in a field of a data line.
@throws std::invalid_argument that names the card, its line and `what` it needs, when missing. **/
double readDeckNumber(const DeckCard& card, const DeckLine& data, size_t field, const char* what);

/** @throws std::invalid_argument: file and line (the card's own unless one is given), and why. **/
[[noreturn]] void refuseCard(const DeckCard& card, const std::string& why, int line = 0);

/** Writes a card as a deck holds it. **/
void writeCard(std::ostream& out, const DeckCard& card);

}  // namespace simflex
