#include "simflex/cli/model/Formula.h"

#include <muParser.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <mutex>

#include "simflex/cli/model/NearestName.h"

namespace simflex {
namespace cli {

namespace {

const std::size_t kMaxLength = 10000;
const int kMaxDepth = 200;  // of parentheses

double calcStep(double t, double t0, double y0, double t1, double y1) {
    if (!(t1 > t0)) return t < t1 ? y0 : y1;
    const double s = std::min(std::max((t - t0) / (t1 - t0), 0.0), 1.0);
    return y0 + (y1 - y0) * s * s * s * (10 + s * (6 * s - 15));
}
double calcRamp(double t, double t0, double y0, double t1, double y1) {
    if (!(t1 > t0)) return t < t1 ? y0 : y1;
    return y0 + (y1 - y0) * std::min(std::max((t - t0) / (t1 - t0), 0.0), 1.0);
}
double calcPulse(double t, double t0, double t1) {
    return t >= t0 && t < t1 ? 1 : 0;
}
double calcIf(double condition, double a, double b) {
    return condition != 0 ? a : b;
}
double calcSign(double x) {
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}
double calcMod(double a, double b) {
    return a - b * std::floor(a / b);
}
double calcMin(const double* values, int count) {
    return *std::min_element(values, values + count);
}
double calcMax(const double* values, int count) {
    return *std::max_element(values, values + count);
}
double calcTable(void* table, double x) {
    return static_cast<const Table*>(table)->calc(x);
}

struct Function {
    const char* name;
    double (*calc)(double);
};
const Function kFunctions[] = {
    {"sin", [](double x) { return std::sin(x); }},
    {"cos", [](double x) { return std::cos(x); }},
    {"tan", [](double x) { return std::tan(x); }},
    {"asin", [](double x) { return std::asin(x); }},
    {"acos", [](double x) { return std::acos(x); }},
    {"atan", [](double x) { return std::atan(x); }},
    {"sinh", [](double x) { return std::sinh(x); }},
    {"cosh", [](double x) { return std::cosh(x); }},
    {"tanh", [](double x) { return std::tanh(x); }},
    {"exp", [](double x) { return std::exp(x); }},
    {"ln", [](double x) { return std::log(x); }},
    {"log", [](double x) { return std::log(x); }},
    {"log10", [](double x) { return std::log10(x); }},
    {"sqrt", [](double x) { return std::sqrt(x); }},
    {"abs", [](double x) { return std::fabs(x); }},
    {"sign", calcSign},
    {"floor", [](double x) { return std::floor(x); }},
    {"ceil", [](double x) { return std::ceil(x); }},
};
const char* const kOtherFunctions[] = {"step", "ramp", "pulse", "if",   "min",
                                       "max",  "mod",  "atan2", "hypot"};

bool isWordCharacter(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
}

/** Refuses what muParser would take in another sense, or would not explain. **/
void checkText(const std::string& text, bool hasDots) {
    if (text.size() > kMaxLength)
        throw FormulaError("the formula has " + std::to_string(text.size()) +
                               " characters; at most " + std::to_string(kMaxLength) + " are read",
                           0);
    if (text.find_first_not_of(" \t\r\n") == std::string::npos)
        throw FormulaError("a number or formula is missing here", 0);
    const std::string allowed = "+-*/^()<>=!&|?:,._ \t\r\n";
    int depth = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        const int position = static_cast<int>(i);
        if (static_cast<unsigned char>(c) >= 128)
            throw FormulaError("a formula has no characters such as this one", position);
        if (!std::isalnum(static_cast<unsigned char>(c)) && allowed.find(c) == std::string::npos)
            throw FormulaError(std::string("'") + c + "' has no meaning in a formula", position);
        if (c == '(' && ++depth > kMaxDepth)
            throw FormulaError(
                "parentheses are nested more than " + std::to_string(kMaxDepth) + " deep",
                position);
        if (c == ')') --depth;
        if (c == '*' && i + 1 < text.size() && text[i + 1] == '*')
            throw FormulaError("write ^ for a power", position);
        if (c == '=') {
            const bool isSecond =
                i > 0 && std::string("<>=!").find(text[i - 1]) != std::string::npos;
            const bool isFirst = i + 1 < text.size() && text[i + 1] == '=';
            if (!isSecond && !isFirst)
                throw FormulaError("a formula assigns nothing; to compare, write ==", position);
            if (isFirst && !isSecond) ++i;
        }
    }
    // "5 mm", "10,5", "3t"
    std::size_t i = 0;
    while (i < text.size()) {
        const bool isNumber = std::isdigit(static_cast<unsigned char>(text[i])) ||
                              (text[i] == '.' && i + 1 < text.size() &&
                               std::isdigit(static_cast<unsigned char>(text[i + 1])));
        if (!isNumber) {
            if (isWordCharacter(text[i])) {
                while (i < text.size() && (isWordCharacter(text[i]) || (hasDots && text[i] == '.')))
                    ++i;
            } else {
                ++i;
            }
            continue;
        }
        const std::size_t begin = i;
        while (i < text.size() &&
               (std::isdigit(static_cast<unsigned char>(text[i])) || text[i] == '.'))
            ++i;
        if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
            std::size_t exponent = i + 1;
            if (exponent < text.size() && (text[exponent] == '+' || text[exponent] == '-'))
                ++exponent;
            if (exponent < text.size() &&
                std::isdigit(static_cast<unsigned char>(text[exponent]))) {
                i = exponent;
                while (i < text.size() && std::isdigit(static_cast<unsigned char>(text[i]))) ++i;
            }
        }
        const std::string number = text.substr(begin, i - begin);
        double value = 0;
        if (!readPlainNumber(number, value))
            throw FormulaError("'" + number + "' is no number", static_cast<int>(begin));
        std::size_t word = text.find_first_not_of(" \t", i);
        if (word != std::string::npos && std::isalpha(static_cast<unsigned char>(text[word]))) {
            std::size_t end = word;
            while (end < text.size() && isWordCharacter(text[end])) ++end;
            const std::string name = text.substr(word, end - word);
            static const std::map<std::string, std::string> units{
                {"mm", "*1e-3"}, {"um", "*1e-6"}, {"cm", "*1e-2"},   {"km", "*1e3"},
                {"m", ""},       {"s", ""},       {"ms", "*1e-3"},   {"us", "*1e-6"},
                {"kg", ""},      {"N", ""},       {"kN", "*1e3"},    {"Pa", ""},
                {"MPa", "*1e6"}, {"GPa", "*1e9"}, {"kPa", "*1e3"},   {"Hz", ""},
                {"rad", ""},     {"deg", "*deg"}, {"rpm", "*pi/30"}, {"Nm", ""},
                {"min", "*60"},  {"h", "*3600"},  {"bar", "*1e5"},   {"kHz", "*1e3"}};
            const auto unit = units.find(name);
            if (unit != units.end() && !(end < text.size() && text[end] == '(')) {
                // "5e-3" rather than "5*1e-3"
                const bool isPower = unit->second.compare(0, 3, "*1e") == 0 &&
                                     number.find_first_of("eE") == std::string::npos;
                throw FormulaError("numbers have no units here, all are SI: write " + number +
                                       unit->second.substr(isPower ? 2 : 0) + " instead of " +
                                       number + " " + name,
                                   static_cast<int>(begin));
            }
            throw FormulaError("an operator is missing between '" + number + "' and '" + name +
                                   "': write " + number + "*" + name,
                               static_cast<int>(word));
        }
    }
}

/** With if(c, a, b) as ((c)?(a):(b)), which does not calculate what is not taken. **/
std::string writeChoices(const std::string& text) {
    std::string result;
    for (std::size_t i = 0; i < text.size();) {
        std::size_t end = i;
        while (end < text.size() && (isWordCharacter(text[end]) || text[end] == '.')) ++end;
        const std::size_t open =
            text.compare(i, end - i, "if") == 0 ? text.find_first_not_of(" \t\r\n", end) : end;
        if (end == i || open >= text.size() || text[open] != '(' || end - i != 2) {
            end = std::max(end, i + 1);
            result += text.substr(i, end - i);
            i = end;
            continue;
        }
        std::vector<std::string> arguments(1);
        int depth = 1;
        for (end = open + 1; end < text.size(); ++end) {
            depth += text[end] == '(' ? 1 : text[end] == ')' ? -1 : 0;
            if (depth == 0) break;
            if (depth == 1 && text[end] == ',')
                arguments.emplace_back();
            else
                arguments.back() += text[end];
        }
        if (depth != 0 || arguments.size() != 3) return text;  // what is wrong is told elsewhere
        for (std::string& argument : arguments) argument = "(" + writeChoices(argument) + ")";
        result += "(" + arguments[0] + "?" + arguments[1] + ":" + arguments[2] + ")";
        i = end + 1;
    }
    return result;
}

std::string describe(const mu::ParserError& error) {
    switch (error.GetCode()) {
        case mu::ecUNEXPECTED_EOF:
            return "the formula ends too early";
        case mu::ecUNEXPECTED_ARG_SEP:
            return "a comma has no meaning here (decimals are written with a point)";
        case mu::ecMISSING_PARENS:
            return "a ')' is missing";
        case mu::ecUNEXPECTED_PARENS:
            return "there is a '" + error.GetToken() + "' too many";
        case mu::ecTOO_MANY_PARAMS:
            return "the function '" + error.GetToken() + "' has too many arguments";
        case mu::ecTOO_FEW_PARAMS:
            return "the function '" + error.GetToken() + "' has too few arguments";
        case mu::ecMISSING_ELSE_CLAUSE:
            return "the ':' of the '?' is missing";
        case mu::ecMISPLACED_COLON:
            return "there is a ':' without its '?'";
        case mu::ecUNEXPECTED_OPERATOR:
            return "an operator '" + error.GetToken() + "' has no meaning here";
        default:
            return "'" + error.GetToken() + "' has no meaning here";
    }
}

}  // namespace

struct Formula::Evaluator {
    mu::Parser parser;
    std::vector<double> values;
};
struct Formula::Pool {
    std::mutex mutex;
    std::vector<std::unique_ptr<Evaluator>> idle;
};

Formula::Formula(const std::string& text, const FormulaScope& scope,
                 const std::vector<std::string>& variables)
    : _text(text), _variables(variables), _pool(std::make_unique<Pool>()) {
    const bool hasDots =
        std::any_of(variables.begin(), variables.end(),
                    [](const std::string& name) { return name.find('.') != std::string::npos; });
    checkText(text, hasDots);
    _scope.constants = scope.constants;
    for (const auto& table : scope.tables)  // only those that occur are kept
        if (text.find(table.first) != std::string::npos) _scope.tables.insert(table);
    std::unique_ptr<Evaluator> evaluator;
    try {
        evaluator = makeEvaluator(_text);
        int count = 1;
        try {
            evaluator->parser.Eval(count);
        } catch (const std::domain_error&) {  // a table refuses what the variables are now
        }
        if (count != 1)
            throw FormulaError("a comma separates nothing here: decimals are written with a point",
                               static_cast<int>(text.find(',')));
        for (const auto& used : evaluator->parser.GetUsedVar()) _used.push_back(used.first);
        _evaluated = writeChoices(_text);
        if (_evaluated != _text) {
            evaluator = makeEvaluator(_evaluated);
            try {
                evaluator->parser.Eval();
            } catch (const std::domain_error&) {
            }
        }
    } catch (const mu::ParserError& error) {
        const int position =
            std::max(0, std::min(static_cast<int>(error.GetPos()), static_cast<int>(text.size())));
        if (error.GetCode() != mu::ecUNASSIGNABLE_TOKEN && error.GetCode() != mu::ecINVALID_NAME)
            throw FormulaError(describe(error), position);
        std::string word = error.GetToken();
        const std::size_t end = static_cast<std::size_t>(
            std::find_if_not(word.begin(), word.end(),
                             [&](char c) { return isWordCharacter(c) || (hasDots && c == '.'); }) -
            word.begin());
        word.resize(end);
        if (word.empty()) throw FormulaError(describe(error), position);
        std::vector<std::string> known = variables;
        for (const auto& constant : scope.constants) known.push_back(constant.first);
        for (const auto& table : scope.tables) known.push_back(table.first);
        for (const std::string& function : getFormulaFunctions()) known.push_back(function);
        const std::vector<std::string> functions = getFormulaFunctions();
        if (scope.tables.count(word) > 0 ||
            std::find(functions.begin(), functions.end(), word) != functions.end())
            throw FormulaError(word + " wants its arguments in parentheses", position);
        const bool isTime = word == "t";
        const std::string proposal = proposeName(word, known);
        throw FormulaError(isTime ? "this number is constant: it cannot depend on the time t"
                                  : "'" + word + "' is no parameter, table or function" +
                                        (proposal.empty() ? "" : "; " + proposal),
                           position);
    } catch (const std::domain_error& error) {
        throw FormulaError(error.what(), 0);
    }
    _pool->idle.reserve(64);
    _pool->idle.push_back(std::move(evaluator));
}
Formula::~Formula() = default;

std::unique_ptr<Formula::Evaluator> Formula::makeEvaluator(const std::string& text) const {
    auto evaluator = std::make_unique<Evaluator>();
    mu::Parser& parser = evaluator->parser;
    evaluator->values.assign(_variables.size() + 1, 0);
    parser.ClearFun();
    parser.ClearConst();
    parser.DefineNameChars("0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
    for (const Function& function : kFunctions) parser.DefineFun(function.name, function.calc);
    parser.DefineFun("step", calcStep);
    parser.DefineFun("ramp", calcRamp);
    parser.DefineFun("pulse", calcPulse);
    parser.DefineFun("if", calcIf);
    parser.DefineFun("min", calcMin);
    parser.DefineFun("max", calcMax);
    parser.DefineFun("mod", calcMod);
    parser.DefineFun("atan2", [](double y, double x) { return std::atan2(y, x); });
    parser.DefineFun("hypot", [](double x, double y) { return std::hypot(x, y); });
    for (const auto& constant : _scope.constants)
        parser.DefineConst(constant.first, constant.second);
    for (const auto& table : _scope.tables)
        parser.DefineFunUserData(table.first, calcTable, const_cast<Table*>(table.second.get()),
                                 false);
    for (std::size_t i = 0; i < _variables.size(); ++i)
        parser.DefineVar(_variables[i], &evaluator->values[i]);
    parser.SetExpr(text);
    return evaluator;
}

double Formula::calc(const double* values) const {
    std::unique_ptr<Evaluator> evaluator;
    {
        const std::lock_guard<std::mutex> lock(_pool->mutex);
        if (!_pool->idle.empty()) {
            evaluator = std::move(_pool->idle.back());
            _pool->idle.pop_back();
        }
    }
    if (!evaluator) evaluator = makeEvaluator(_evaluated);
    std::copy(values, values + _variables.size(), evaluator->values.begin());
    const auto giveBack = [&] {
        const std::lock_guard<std::mutex> lock(_pool->mutex);
        _pool->idle.push_back(std::move(evaluator));
    };
    double result = std::numeric_limits<double>::quiet_NaN();
    try {
        result = evaluator->parser.Eval();
    } catch (const mu::ParserError&) {  // of mathematics, as a division by zero
    } catch (...) {
        giveBack();
        throw;
    }
    giveBack();
    return result;
}

std::vector<std::string> getFormulaFunctions() {
    std::vector<std::string> names;
    for (const Function& function : kFunctions) names.push_back(function.name);
    names.insert(names.end(), std::begin(kOtherFunctions), std::end(kOtherFunctions));
    return names;
}

bool isFormulaWord(const std::string& name) {
    if (name == "t" || name == "pi" || name == "deg" || name == "g") return true;
    const std::vector<std::string> functions = getFormulaFunctions();
    return std::find(functions.begin(), functions.end(), name) != functions.end();
}

bool readPlainNumber(const std::string& text, double& value) {
    if (text.empty() || text.size() > 100) return false;
    if (text.find_first_not_of("0123456789+-.eE") != std::string::npos) return false;
    const char* const end = text.data() + text.size();
    const char* const begin = text.data() + (text[0] == '+' && text[1] != '-' ? 1 : 0);
    const std::from_chars_result read = std::from_chars(begin, end, value);  // in any locale
    return read.ec == std::errc() && read.ptr == end && std::isfinite(value);
}

}  // namespace cli
}  // namespace simflex
