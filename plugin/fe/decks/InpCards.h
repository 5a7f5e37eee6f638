#pragma once
/** @file
The cards of a CalculiX (Abaqus-style) input deck, with *INCLUDE resolved. Internal to fe.

A card is a keyword line `*KEYWORD, PARAMETER=VALUE, …` with the data lines below it. As in ccx,
blanks are removed and letters converted to upper case; `**` begins a comment. Names may be quoted.
Files may be UTF-8 or UTF-16, with line ends LF, CR LF or CR. **/

#include <map>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "simflex/base/Progress.h"

namespace simflex {

/** A data line, split at its commas. **/
struct DeckLine {
    int line = 0;
    std::vector<std::string> fields;  ///< blanks trimmed, upper case
    bool continues = false;           ///< ended in a comma
};

/** One keyword with its parameters and data. **/
struct DeckCard {
    std::string keyword;                            ///< without star and blanks: "SOLIDSECTION"
    std::string title;                              ///< as written: "*SOLID SECTION"
    std::map<std::string, std::string> parameters;  ///< without blanks; value empty for a flag
    std::string file;
    int line = 0;
    std::vector<DeckLine> data;

    /** Sets the title "*SOLID SECTION" and its keyword. **/
    void setTitle(const std::string& text);

    bool has(const std::string& parameter) const { return parameters.count(parameter) > 0; }

    /** Returns the parameter's value. @throws std::invalid_argument naming file and line if
    absent. **/
    const std::string& get(const std::string& parameter) const;

    /** Returns "FILE:LINE: " of the keyword or of a data line, for messages. **/
    std::string where() const { return where(line); }
    std::string where(int atLine) const;
};

/** What *INCLUDE does: in a deck that another program wrote, which may do what a stranger's script
wants, it is refused, since it would read files that the script may not. **/
enum class DeckIncludes { Read, Refused };

/** Reads all cards of a deck and of the files it includes, in order.
@throws std::runtime_error for a file that cannot be read or a recursive include.
@throws std::invalid_argument for an include that is refused.
@throws Cancelled if progress requests it. **/
std::vector<DeckCard> readDeckCards(const std::string& path, const ProgressCallback& progress = {},
                                    DeckIncludes includes = DeckIncludes::Read);

/** Phase of reading decks, the share of it spent on reading their cards, and how often it is
reported. **/
constexpr const char* ReadingDeck = "reading the deck";
constexpr double ReadingCards = 0.6;
constexpr int DeckLinesPerReport = 20000;

/** Keyword of a card that holds text before the first card. **/
constexpr const char* TextBeforeCards = "TEXTBEFORECARDS";

/** Keyword of a card with a note from a reader of another format: its title. **/
constexpr const char* NoteCard = "NOTE";
DeckCard makeNoteCard(const std::string& text);

/** Converts 1.5-3 to 1.5e-3: inserts the exponent letter before a sign that neither begins the
number nor follows an exponent letter. **/
std::string withExponentLetter(std::string_view number);

/** Parses a number as ccx does (also D exponents or exponents without letter).
@throws std::invalid_argument that begins with `where`. **/
double parseDeckNumber(const std::string& field, const std::string& where);

/** Parses an integer. @throws std::invalid_argument that begins with `where`. **/
int parseDeckInteger(const std::string& field, const std::string& where);

/** As above for a field of a data line; its location is formatted only for an error. **/
double parseDeckNumber(const std::string& field, const DeckCard& card, const DeckLine& data);
int parseDeckInteger(const std::string& field, const DeckCard& card, const DeckLine& data);

/** Returns whether a field is a number rather than the name of a set. **/
bool isDeckNumber(const std::string& field);

/** Returns the number in a field of a data line.
@throws std::invalid_argument naming the card, its line and `what`, if it is missing. **/
double readDeckNumber(const DeckCard& card, const DeckLine& data, size_t field, const char* what);

/** @throws std::invalid_argument with file, line (by default the card's) and reason. **/
[[noreturn]] void refuseCard(const DeckCard& card, const std::string& why, int line = 0);

/** Writes a card in deck format. **/
void writeCard(std::ostream& out, const DeckCard& card);

}  // namespace simflex
