#include "InpCards.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string_view>

#include "IncludeLimit.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;

std::string withoutBlanks(std::string text) {
    text.erase(std::remove_if(text.begin(), text.end(), isBlank), text.end());
    return text;
}

std::string bareName(const std::string& text) {
    std::string name = withoutBlanks(text);
    name.erase(std::remove(name.begin(), name.end(), '"'), name.end());
    return name;
}

DeckCard parseKeyword(const std::string& text, const std::string& file, int line) {
    DeckCard card;
    card.file = file;
    card.line = line;
    const std::vector<std::string> fields = splitAt(text, ',');
    card.title = upperCase(trimBlanks(fields[0]));
    card.keyword = withoutBlanks(card.title).substr(1);
    for (size_t i = 1; i < fields.size(); ++i) {
        if (trimBlanks(fields[i]).empty()) continue;
        const size_t equals = fields[i].find('=');
        const std::string name = upperCase(withoutBlanks(fields[i].substr(0, equals)));
        std::string value(equals == std::string::npos
                              ? std::string_view()
                              : trimBlanks(std::string_view(fields[i]).substr(equals + 1)));
        if (name != "INPUT") value = upperCase(bareName(value));  // file names are case-sensitive
        card.parameters[name] = value;
    }
    // Of a material or of layers both are one card.
    if (card.keyword == "SHELLGENERALSECTION" && (card.has("MATERIAL") || card.has("COMPOSITE")))
        card.keyword = "SHELLSECTION";
    return card;
}

/** Reads text without a byte order mark; in UTF-16 non-ASCII characters become '?'. **/
std::string readPlainText(std::istream& in) {
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (text.compare(0, 3, "\xEF\xBB\xBF") == 0) return text.substr(3);
    const bool isLittle = text.compare(0, 2, "\xFF\xFE") == 0;
    if (!isLittle && text.compare(0, 2, "\xFE\xFF") != 0) return text;
    std::string plain;
    for (size_t k = 2; k + 1 < text.size(); k += 2) {
        const char low = text[isLittle ? k : k + 1], high = text[isLittle ? k + 1 : k];
        plain += high == 0 && static_cast<unsigned char>(low) < 128 ? low : '?';
    }
    return plain;
}

/** Iterates over lines ending in LF, CR LF or CR. **/
class Lines {
public:
    explicit Lines(std::string text) : m_text(std::move(text)) {}

    bool next() {
        if (m_at >= m_text.size()) return false;
        if (m_at > m_feed || m_feed == 0) m_feed = std::min(m_text.find('\n', m_at), m_text.size());
        const size_t end = std::min(
            m_feed, m_at + std::min(std::string_view(m_text).substr(m_at, m_feed - m_at).find('\r'),
                                    m_text.size()));
        m_line = std::string_view(m_text).substr(m_at, end - m_at);
        m_at = end + (m_text.compare(end, 2, "\r\n") == 0 ? 2 : 1);
        ++m_number;
        return true;
    }
    bool nextUnlessKeyword() { return m_at < m_text.size() && m_text[m_at] != '*' && next(); }

    std::string_view line() const { return m_line; }
    int number() const { return m_number; }
    double share() const { return double(m_at) / double(m_text.size()); }  ///< fraction read

private:
    const std::string m_text;
    size_t m_at = 0, m_feed = 0;  ///< position of the next LF, once known
    std::string_view m_line;
    int m_number = 0;
};

class CardReader {
public:
    CardReader(const ProgressCallback& progress, DeckIncludes includes)
        : m_progress(progress), m_areIncludesRead(includes == DeckIncludes::Read) {}

    std::vector<DeckCard> cards;

    void read(const fs::path& path, const std::string& includedFrom, int depth) {
        std::ifstream in = openInputFile(path);
        if (!in.is_open())
            throw std::runtime_error(includedFrom + "cannot read deck '" + path.string() + "'");
        const std::string mistake = m_includes.enter(depth);
        if (!mistake.empty()) throw std::runtime_error(includedFrom + "*" + mistake);
        Lines lines(readPlainText(in));
        while (lines.next()) {
            report(lines);
            std::string_view text = trimBlanks(lines.line());
            if (text.empty() || text.substr(0, 2) == "**") continue;
            if (text[0] != '*') {
                addData(text, path.string(), lines.number());
                continue;
            }
            const int keywordLine = lines.number();
            std::string keyword(text);
            // A keyword line that ends in a comma is continued only if it has parameters.
            const bool hasParameters = std::count(keyword.begin(), keyword.end(), ',') > 1;
            while (keyword.back() == ',' && hasParameters && lines.nextUnlessKeyword()) {
                report(lines);
                keyword += trimBlanks(lines.line());
            }
            DeckCard card = parseKeyword(keyword, path.string(), keywordLine);
            if (card.keyword == "INCLUDE") {
                if (!m_areIncludesRead)
                    refuseCard(card,
                               "*INCLUDE: a mesh that another program wrote includes no file");
                read(resolve(card, path), card.where(), depth + 1);
            } else {
                cards.push_back(std::move(card));
            }
        }
    }

private:
    void report(const Lines& lines) {
        if (++m_numLines % DeckLinesPerReport == 0)
            reportProgress(m_progress, ReadingDeck, ReadingCards * lines.share());
    }

    void addData(std::string_view text, const std::string& file, int line) {
        if (cards.empty()) {  // as in ccx, which continues at the first keyword
            DeckCard before;
            before.keyword = TextBeforeCards;
            before.title = "text before the first keyword";
            before.file = file;
            before.line = line;
            cards.push_back(std::move(before));
        }
        DeckLine data;
        data.line = line;
        data.continues = text.back() == ',';
        if (data.continues) text.remove_suffix(1);
        data.fields.reserve(size_t(std::count(text.begin(), text.end(), ',')) + 1);
        for (size_t begin = 0;;) {
            const size_t comma = text.find(',', begin);
            std::string field = upperCase(trimBlanks(text.substr(begin, comma - begin)));
            if (!field.empty() && (isLetter(field[0]) || field[0] == '"')) field = bareName(field);
            data.fields.push_back(std::move(field));
            if (comma == std::string_view::npos) break;
            begin = comma + 1;
        }
        cards.back().data.push_back(std::move(data));
    }

    static fs::path resolve(const DeckCard& card, const fs::path& from) {
        std::string name = card.get("INPUT");
        name.erase(std::remove(name.begin(), name.end(), '"'), name.end());
        const fs::path beside = from.parent_path() / name;
        return fs::exists(beside) ? beside : fs::exists(name) ? fs::path(name) : beside;
    }

    const ProgressCallback& m_progress;
    const bool m_areIncludesRead;
    IncludeLimit m_includes;
    long m_numLines = 0;  ///< of all files
};

/** Inserts blanks as in manuals. **/
std::string writtenOut(const std::string& parameter) {
    static const std::map<std::string, std::string> Blanks = {{"REFNODE", "REF NODE"},
                                                              {"ROTNODE", "ROT NODE"},
                                                              {"OLDSET", "OLD SET"},
                                                              {"CHANGENUMBER", "CHANGE NUMBER"},
                                                              {"ELEMENTSHIFT", "ELEMENT SHIFT"},
                                                              {"SHIFTNODES", "SHIFT NODES"}};
    const auto found = Blanks.find(parameter);
    return found == Blanks.end() ? parameter : found->second;
}

/** Returns the remedy for numbers not separated by commas. **/
std::string commaCure(const std::string& field) {
    return field.find_first_of(" \t;") == std::string::npos ? ""
                                                            : "; numbers are divided by commas";
}

}  // namespace

void DeckCard::setTitle(const std::string& text) {
    title = text;
    keyword.clear();
    std::copy_if(text.begin(), text.end(), std::back_inserter(keyword),
                 [](char c) { return c != ' ' && c != '*'; });
}

std::string DeckCard::where(int atLine) const {
    return file + ":" + std::to_string(atLine) + ": ";
}

const std::string& DeckCard::get(const std::string& parameter) const {
    const auto found = parameters.find(parameter);
    if (found == parameters.end() || found->second.empty())
        throw std::invalid_argument(where() + title + " needs " + writtenOut(parameter) + "=…");
    return found->second;
}

std::vector<DeckCard> readDeckCards(const std::string& path, const ProgressCallback& progress,
                                    DeckIncludes includes) {
    CardReader reader(progress, includes);
    reader.read(path, "", 0);
    return std::move(reader.cards);
}

DeckCard makeNoteCard(const std::string& text) {
    DeckCard card;
    card.keyword = NoteCard;
    card.title = text;
    return card;
}

std::string withExponentLetter(std::string_view number) {
    std::string text(number);
    for (size_t k = 1; k < text.size(); ++k)
        if ((text[k] == '+' || text[k] == '-') && (isDigit(text[k - 1]) || text[k - 1] == '.')) {
            text.insert(k, "e");
            break;
        }
    return text;
}

double parseDeckNumber(const std::string& field, const std::string& where) {
    double value = 0;
    if (!readNumber(field, value) && !readNumber(withExponentLetter(field), value))
        throw std::invalid_argument(where + "'" + field + "' is not a finite number" +
                                    commaCure(field));
    return value;
}

int parseDeckInteger(const std::string& field, const std::string& where) {
    int value = 0;
    double number = 0;
    if (readInteger(field, value)) return value;
    if (!readNumber(field, number) || number != std::floor(number))
        throw std::invalid_argument(where + "'" + field + "' is not a whole number" +
                                    commaCure(field));
    if (std::abs(number) > std::numeric_limits<int>::max())
        throw std::invalid_argument(where + field + " is too large: numbers of nodes and " +
                                    "elements go up to 2147483647; renumber them");
    return int(number);
}

double parseDeckNumber(const std::string& field, const DeckCard& card, const DeckLine& data) {
    double value = 0;
    return readNumber(field, value) ? value : parseDeckNumber(field, card.where(data.line));
}

int parseDeckInteger(const std::string& field, const DeckCard& card, const DeckLine& data) {
    int value = 0;
    return readInteger(field, value) ? value : parseDeckInteger(field, card.where(data.line));
}

bool isDeckNumber(const std::string& field) {
    return !field.empty() && (isDigit(field[0]) || field[0] == '-' || field[0] == '+');
}

double readDeckNumber(const DeckCard& card, const DeckLine& data, size_t field, const char* what) {
    if (field >= data.fields.size() || data.fields[field].empty())
        refuseCard(card, card.title + std::string(" needs ") + what, data.line);
    return parseDeckNumber(data.fields[field], card.where(data.line));
}

void refuseCard(const DeckCard& card, const std::string& why, int line) {
    throw std::invalid_argument(card.where(line ? line : card.line) + why);
}

void writeCard(std::ostream& out, const DeckCard& card) {
    out << card.title;
    for (const auto& [parameter, value] : card.parameters)
        out << ", " << parameter << (value.empty() ? "" : "=" + value);
    out << "\n";
    for (const DeckLine& data : card.data) {
        for (size_t i = 0; i < data.fields.size(); ++i) out << (i ? "," : "") << data.fields[i];
        out << (data.continues ? ",\n" : "\n");
    }
}

}  // namespace simflex
