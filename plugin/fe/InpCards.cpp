#include "InpCards.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr int DeepestInclude = 20;

std::string trimmed(const std::string& text) {
    const auto begin = text.find_first_not_of(" \t\r");
    if (begin == std::string::npos) return "";
    return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

std::string withoutBlanks(std::string text) {
    text.erase(std::remove_if(text.begin(), text.end(), isBlank), text.end());
    return text;
}

std::vector<std::string> splitAtCommas(const std::string& text) {
    std::vector<std::string> fields;
    size_t begin = 0;
    while (true) {
        const size_t comma = text.find(',', begin);
        fields.push_back(trimmed(text.substr(begin, comma - begin)));
        if (comma == std::string::npos) return fields;
        begin = comma + 1;
    }
}

DeckCard parseKeyword(const std::string& text, const std::string& file, int line) {
    DeckCard card;
    card.file = file;
    card.line = line;
    const auto fields = splitAtCommas(text);
    card.title = upperCase(fields[0]);
    card.keyword = withoutBlanks(card.title).substr(1);
    for (size_t i = 1; i < fields.size(); ++i) {
        if (fields[i].empty()) continue;
        const size_t equals = fields[i].find('=');
        const std::string name = upperCase(withoutBlanks(fields[i].substr(0, equals)));
        std::string value =
            equals == std::string::npos ? "" : trimmed(fields[i].substr(equals + 1));
        if (name != "INPUT") {  // file names keep their case
            value = upperCase(withoutBlanks(value));
            value.erase(std::remove(value.begin(), value.end(), '"'), value.end());
        }
        card.parameters[name] = value;
    }
    return card;
}

class CardReader {
public:
    std::vector<DeckCard> cards;

    void read(const fs::path& path, const std::string& includedFrom, int depth) {
        std::ifstream in(path);
        // A device may have no end.
        if (!in || fs::is_directory(path) || (depth > 0 && !fs::is_regular_file(path)))
            throw std::runtime_error(includedFrom + "cannot read deck '" + path.string() + "'");
        if (depth > DeepestInclude)
            throw std::runtime_error(includedFrom + "*INCLUDE goes " + std::to_string(depth) +
                                     " files deep; does a file include itself?");
        std::string text;
        for (int line = 1; std::getline(in, text); ++line) {
            text = trimmed(text);
            if (text.empty() || text.compare(0, 2, "**") == 0) continue;
            if (text[0] != '*') {
                addData(text, path.string(), line);
                continue;
            }
            const int keywordLine = line;
            for (std::string more; text.back() == ',' && in.peek() != '*' && isKeywordOpen(text);) {
                if (!std::getline(in, more)) break;
                ++line;
                text += trimmed(more);
            }
            DeckCard card = parseKeyword(text, path.string(), keywordLine);
            if (card.keyword == "INCLUDE") {
                read(resolve(card, path), card.where(), depth + 1);
            } else {
                cards.push_back(std::move(card));
            }
        }
    }

private:
    /** A keyword line that ends in a comma goes on below only if it has parameters. **/
    static bool isKeywordOpen(const std::string& text) {
        return std::count(text.begin(), text.end(), ',') > 1;
    }

    void addData(const std::string& text, const std::string& file, int line) {
        if (cards.empty())
            throw std::invalid_argument(file + ":" + std::to_string(line) +
                                        ": data before the first keyword");
        DeckLine data;
        data.line = line;
        data.continues = text.back() == ',';
        data.fields = splitAtCommas(upperCase(text));
        if (data.continues) data.fields.pop_back();
        cards.back().data.push_back(std::move(data));
    }

    static fs::path resolve(const DeckCard& card, const fs::path& from) {
        std::string name = card.get("INPUT");
        name.erase(std::remove(name.begin(), name.end(), '"'), name.end());
        const fs::path beside = from.parent_path() / name;
        return fs::exists(beside) ? beside : fs::exists(name) ? fs::path(name) : beside;
    }
};

}  // namespace

std::string DeckCard::where(int atLine) const {
    return file + ":" + std::to_string(atLine) + ": ";
}

const std::string& DeckCard::get(const std::string& parameter) const {
    const auto found = parameters.find(parameter);
    if (found == parameters.end() || found->second.empty())
        throw std::invalid_argument(where() + title + " needs " + parameter + "=…");
    return found->second;
}

std::vector<DeckCard> readDeckCards(const std::string& path) {
    CardReader reader;
    reader.read(path, "", 0);
    return std::move(reader.cards);
}

double parseDeckNumber(const std::string& field, const std::string& where) {
    double value = 0;
    if (!readNumber(field, value))
        throw std::invalid_argument(where + "'" + field + "' is not a finite number");
    return value;
}

int parseDeckInteger(const std::string& field, const std::string& where) {
    int value = 0;
    if (!readInteger(field, value))
        throw std::invalid_argument(where + "'" + field + "' is not a whole number");
    return value;
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
