#include "DeckParameters.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

constexpr int DeepestBrackets = 100;

bool isNameLetter(char c) {
    return isLetter(c) || isDigit(c) || c == '_';
}

/** An integer, a real number or a text. **/
struct ParameterValue {
    double number = 0;
    bool isWhole = false, isText = false;
    std::string text;
};

using ParameterValues = std::map<std::string, ParameterValue>;

class ParameterExpression {
public:
    ParameterExpression(std::string_view text, const ParameterValues& known, const DeckCard& card,
                        int line)
        : m_text(text), m_known(known), m_card(card), m_line(line) {}

    ParameterValue evaluate() {
        skip();
        ParameterValue value;
        if (m_at < m_text.size() && m_text[m_at] == '\'') {
            const size_t end = m_text.find('\'', m_at + 1);
            if (end == std::string_view::npos) refuse("a text ends without '");
            value.isText = true;
            value.text = m_text.substr(m_at + 1, end - m_at - 1);
            m_at = end + 1;
        } else {
            value = sum();
        }
        skip();
        if (m_at < m_text.size())
            refuse("there is '" + std::string(m_text.substr(m_at)) + "' behind an expression");
        return value;
    }

private:
    [[noreturn]] void refuse(const std::string& why) const {
        refuseCard(m_card, m_card.title + ": " + why, m_line);
    }

    void skip() {
        while (m_at < m_text.size() && isBlank(m_text[m_at])) ++m_at;
    }

    bool take(std::string_view sign) {
        skip();
        if (m_text.substr(m_at, sign.size()) != sign) return false;
        if (sign == "*" && m_text.substr(m_at, 2) == "**") return false;
        m_at += sign.size();
        return true;
    }

    ParameterValue make(double number, bool isWhole) const {
        if (!std::isfinite(number)) refuse("an expression has no finite value");
        return {number, isWhole && number == std::floor(number), false, ""};
    }

    ParameterValue sum() {
        ParameterValue value = product();
        for (;;) {
            const bool isPlus = take("+");
            if (!isPlus && !take("-")) return value;
            const ParameterValue other = product();
            value = make(isPlus ? value.number + other.number : value.number - other.number,
                         value.isWhole && other.isWhole);
        }
    }

    ParameterValue product() {
        ParameterValue value = signedPower();
        for (;;) {
            const bool isTimes = take("*");
            if (!isTimes && !take("/")) return value;
            const ParameterValue other = signedPower();
            const bool areWhole = value.isWhole && other.isWhole;
            if (isTimes) {
                value = make(value.number * other.number, areWhole);
                continue;
            }
            const double quotient = value.number / other.number;
            if (areWhole && std::isfinite(quotient) && quotient != std::floor(quotient))
                refuse(writeGeneral(value.number, 12) + "/" + writeGeneral(other.number, 12) +
                       " of whole numbers is " + writeGeneral(std::floor(quotient), 12) +
                       " for some versions of Abaqus; give one of them a decimal point");
            value = make(quotient, areWhole);
        }
    }

    ParameterValue signedPower() {
        if (++m_depth > DeepestBrackets) refuse("an expression has too many brackets or signs");
        ParameterValue value;
        if (take("-")) {
            value = signedPower();
            value.number = -value.number;
        } else if (take("+")) {
            value = signedPower();
        } else {
            value = operand();
            if (take("**")) {
                const ParameterValue exponent = signedPower();
                value = make(std::pow(value.number, exponent.number),
                             value.isWhole && exponent.isWhole && exponent.number >= 0);
            }
        }
        --m_depth;
        return value;
    }

    ParameterValue operand() {
        skip();
        if (take("(")) {
            const ParameterValue value = sum();
            if (!take(")")) refuse("a bracket is not closed");
            return value;
        }
        size_t end = m_at;
        if (end < m_text.size() && isLetter(m_text[end])) {
            while (end < m_text.size() && isNameLetter(m_text[end])) ++end;
            const std::string name(m_text.substr(m_at, end - m_at));
            m_at = end;
            return take("(") ? call(name) : find(name);
        }
        while (end < m_text.size() && (isDigit(m_text[end]) || m_text[end] == '.' ||
                                       m_text[end] == 'E' || m_text[end] == 'D' ||
                                       ((m_text[end] == '+' || m_text[end] == '-') && end > m_at &&
                                        (m_text[end - 1] == 'E' || m_text[end - 1] == 'D'))))
            ++end;
        std::string text(m_text.substr(m_at, end - m_at));
        if (text.empty()) refuse("a number or name is missing in '" + std::string(m_text) + "'");
        m_at = end;
        const bool isWhole = std::all_of(text.begin(), text.end(), isDigit);
        return make(parseDeckNumber(text, m_card.where(m_line)), isWhole);
    }

    ParameterValue find(const std::string& name) const {
        const auto found = m_known.find(name);
        if (found == m_known.end()) refuse("there is no parameter " + name + " before it");
        if (found->second.isText) refuse("parameter " + name + " is a text, no number");
        return found->second;
    }

    ParameterValue call(const std::string& name) {
        std::vector<ParameterValue> given;
        do given.push_back(sum());
        while (take(","));
        if (!take(")")) refuse("a bracket is not closed");
        const double x = given[0].number;
        if (given.size() > 1 && (name == "MAX" || name == "MIN")) {
            ParameterValue value = given[0];
            for (const ParameterValue& other : given)
                if (name == "MAX" ? other.number > value.number : other.number < value.number)
                    value = other;
            return value;
        }
        if (given.size() != 1) refuse(name + " has too many numbers");
        if (name == "ABS") return make(std::abs(x), given[0].isWhole);
        if (name == "INT") return make(std::trunc(x), true);
        if (name == "FLOAT") return make(x, false);
        static const std::map<std::string, double (*)(double)> Functions = {
            {"ACOS", std::acos}, {"ASIN", std::asin},   {"ATAN", std::atan}, {"COS", std::cos},
            {"EXP", std::exp},   {"LOG10", std::log10}, {"LOG", std::log},   {"SIN", std::sin},
            {"SQRT", std::sqrt}, {"TAN", std::tan}};
        const auto found = Functions.find(name);
        if (found == Functions.end()) refuse("there is no function " + name);
        return make(found->second(x), false);
    }

    const std::string_view m_text;
    const ParameterValues& m_known;
    const DeckCard& m_card;
    const int m_line;
    size_t m_at = 0;
    int m_depth = 0;
};

void readParameters(const DeckCard& card, ParameterValues& known, std::vector<DeckCard>& notes) {
    for (const auto& [parameter, value] : card.parameters)
        refuseCard(card,
                   card.title + " with " + parameter + " is not known to simflex; it knows none");
    for (const DeckLine& data : card.data) {
        std::string text;
        for (const std::string& field : data.fields) text += (text.empty() ? "" : ",") + field;
        text = text.substr(0, text.find('#'));
        if (trimBlanks(text).empty()) continue;
        const size_t equals = text.find('=');
        const std::string name(trimBlanks(std::string_view(text).substr(0, equals)));
        if (equals == std::string::npos || name.empty() || !isLetter(name[0]) ||
            !std::all_of(name.begin(), name.end(), isNameLetter))
            refuseCard(card, card.title + " needs lines 'name = expression'", data.line);
        const ParameterValue value =
            ParameterExpression(std::string_view(text).substr(equals + 1), known, card, data.line)
                .evaluate();
        known[name] = value;
        notes.push_back(
            makeNoteCard(card.where(data.line) + "parameter " + name + " is " +
                         (value.isText ? "'" + value.text + "'" : writeGeneral(value.number, 12))));
    }
}

/** Replaces <NAME> by values. **/
void replaceNames(const ParameterValues& known, const DeckCard& card, int line,
                  std::string& field) {
    for (size_t open = field.find('<'); open != std::string::npos;
         open = field.find('<', open + 1)) {
        const size_t close = field.find('>', open);
        if (close == std::string::npos) return;
        const std::string name =
            upperCase(trimBlanks(std::string_view(field).substr(open + 1, close - open - 1)));
        const auto found = known.find(name);
        if (found == known.end())
            refuseCard(card, "there is no parameter " + name + " before it", line);
        const ParameterValue& value = found->second;
        field.replace(open, close - open + 1,
                      value.isText ? value.text : writeGeneral(value.number));
    }
}

}  // namespace

void applyParameters(std::vector<DeckCard>& cards) {
    const auto isParameters = [](const DeckCard& card) { return card.keyword == "PARAMETER"; };
    if (std::none_of(cards.begin(), cards.end(), isParameters)) return;
    ParameterValues known;
    std::vector<DeckCard> result;
    for (DeckCard& card : cards) {
        if (isParameters(card)) {
            readParameters(card, known, result);
            continue;
        }
        for (auto& [parameter, value] : card.parameters)
            replaceNames(known, card, card.line, value);
        for (DeckLine& data : card.data)
            for (std::string& field : data.fields) replaceNames(known, card, data.line, field);
        result.push_back(std::move(card));
    }
    cards = std::move(result);
}

}  // namespace simflex
