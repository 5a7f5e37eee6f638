#include "simflex/model/formula/Parser.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "simflex/base/AsciiText.h"
#include "simflex/model/formula/Evaluation.h"

namespace simflex {
namespace formula {

namespace {

const std::size_t MaxLength = 10000;
const int MaxNesting = 200;  // of parentheses, signs, powers and conditionals
const int MaxDepth = 1000;   // of the tree: terms in a sum

struct Function {
    const char* name;
    Operation operation;
    int fewest, most;  ///< number of arguments
};
const int Any = 1000;
const Function FormulaFunctions[] = {
    {"sin", Operation::Sin, 1, 1},     {"cos", Operation::Cos, 1, 1},
    {"tan", Operation::Tan, 1, 1},     {"asin", Operation::Asin, 1, 1},
    {"acos", Operation::Acos, 1, 1},   {"atan", Operation::Atan, 1, 1},
    {"sinh", Operation::Sinh, 1, 1},   {"cosh", Operation::Cosh, 1, 1},
    {"tanh", Operation::Tanh, 1, 1},   {"exp", Operation::Exp, 1, 1},
    {"ln", Operation::Ln, 1, 1},       {"log", Operation::Ln, 1, 1},
    {"log10", Operation::Log10, 1, 1}, {"sqrt", Operation::Sqrt, 1, 1},
    {"abs", Operation::Abs, 1, 2},     {"sign", Operation::Sign, 1, 2},
    {"clamp", Operation::Min, 3, 3},   {"deadband", Operation::Min, 2, 2},
    {"floor", Operation::Floor, 1, 1}, {"ceil", Operation::Ceil, 1, 1},
    {"step", Operation::Step, 5, 5},   {"ramp", Operation::Ramp, 5, 5},
    {"pulse", Operation::Pulse, 3, 3}, {"if", Operation::If, 3, 3},
    {"min", Operation::Min, 1, Any},   {"max", Operation::Max, 1, Any},
    {"mod", Operation::Mod, 2, 2},     {"atan2", Operation::Atan2, 2, 2},
    {"hypot", Operation::Hypot, 2, 2}};

const Function* findFunction(const std::string& name) {
    for (const Function& function : FormulaFunctions)
        if (name == function.name) return &function;
    return nullptr;
}

bool isWordCharacter(char c) {
    return isLetter(c) || isDigit(c) || c == '_';
}

class Parser {
public:
    Parser(const std::string& text, const Scope& scope, const std::vector<std::string>& variables)
        : m_text(text), m_scope(scope), m_variables(variables) {}

    Tree parse() {
        checkCharacters();
        const int root = parseChoice();
        if (!isAtEnd()) failAtToken();
        // Drop nodes that a constant has replaced.
        return m_tree.copyPart(root);
    }

private:
    const std::string& m_text;
    const Scope& m_scope;
    const std::vector<std::string>& m_variables;
    Tree m_tree;
    std::size_t m_at = 0, m_end = 0;  ///< start of the next token; end of the last one
    int m_nesting = 0;

    class Nesting {
    public:
        explicit Nesting(Parser& parser) : m_parser(parser) {
            if (++m_parser.m_nesting > MaxNesting)
                m_parser.fail("parentheses are nested more than " + std::to_string(MaxNesting) +
                              " deep");
        }
        ~Nesting() { --m_parser.m_nesting; }
        Nesting(const Nesting&) = delete;
        Nesting& operator=(const Nesting&) = delete;

    private:
        Parser& m_parser;
    };

    //---------------------------------------------------------------------------------------------
    // Errors

    [[noreturn]] void fail(const std::string& message, std::size_t position) const {
        throw SyntaxError(message, static_cast<int>(position));
    }
    [[noreturn]] void fail(const std::string& message) const { fail(message, m_at); }

    void checkCharacters() const {
        if (m_text.size() > MaxLength)
            fail("the formula has " + std::to_string(m_text.size()) + " characters; at most " +
                     std::to_string(MaxLength) + " are read",
                 0);
        if (m_text.find_first_not_of(" \t\r\n") == std::string::npos)
            fail("a number or formula is missing here", 0);
        const std::string allowed = "+-*/^()<>=!&|?:,._ \t\r\n";
        for (std::size_t i = 0; i < m_text.size(); ++i) {
            const char c = m_text[i];
            if (static_cast<unsigned char>(c) >= 128)
                fail("this character is not allowed in a formula", i);
            if (!isLetter(c) && !isDigit(c) && allowed.find(c) == std::string::npos)
                fail(std::string("'") + c + "' has no meaning in a formula", i);
        }
    }

    [[noreturn]] void failAtToken() {
        skipBlanks();
        if (m_at >= m_text.size()) fail("the formula ends too early", m_text.size());
        const char c = m_text[m_at];
        if (c == ',') fail("a comma has no meaning here (decimals are written with a point)");
        if (c == ')') fail("there is one ')' too many");
        if (c == ':') fail("there is a ':' without its '?'");
        if (c == '=') fail("a formula assigns nothing; to compare, write ==");
        if (isWordCharacter(c)) {
            std::size_t end = m_at;
            while (end < m_text.size() && isWordCharacter(m_text[end])) ++end;
            fail("an operator is missing before '" + m_text.substr(m_at, end - m_at) + "'");
        }
        fail(c == '(' ? "an operator is missing before the '('"
                      : "an operator '" + std::string(1, c) + "' has no meaning here");
    }

    /** Reports a word after a number: "5 mm", "3t". **/
    [[noreturn]] void failAtUnit(const std::string& number, std::size_t begin) {
        std::size_t end = m_at;
        while (end < m_text.size() && isWordCharacter(m_text[end])) ++end;
        const std::string name = m_text.substr(m_at, end - m_at);
        static const std::map<std::string, std::string> units{
            {"mm", "*1e-3"}, {"um", "*1e-6"}, {"cm", "*1e-2"}, {"km", "*1e3"},    {"m", ""},
            {"s", ""},       {"ms", "*1e-3"}, {"us", "*1e-6"}, {"kg", ""},        {"N", ""},
            {"kN", "*1e3"},  {"Pa", ""},      {"MPa", "*1e6"}, {"GPa", "*1e9"},   {"kPa", "*1e3"},
            {"Hz", ""},      {"rad", ""},     {"deg", "*deg"}, {"rpm", "*pi/30"}, {"Nm", ""},
            {"min", "*60"},  {"h", "*3600"},  {"bar", "*1e5"}, {"kHz", "*1e3"}};
        const auto unit = units.find(name);
        if (unit != units.end() && !(end < m_text.size() && m_text[end] == '(')) {
            // Write "5e-3" rather than "5*1e-3".
            const bool isPower = unit->second.compare(0, 3, "*1e") == 0 &&
                                 number.find_first_of("eE") == std::string::npos;
            fail("numbers have no units here, all are SI: write " + number +
                     unit->second.substr(isPower ? 2 : 0) + " instead of " + number + " " + name,
                 begin);
        }
        fail("an operator is missing between '" + number + "' and '" + name + "': write " + number +
             "*" + name);
    }

    //---------------------------------------------------------------------------------------------
    // Characters

    void skipBlanks() {
        while (m_at < m_text.size() && std::strchr(" \t\r\n", m_text[m_at])) ++m_at;
    }
    bool isAtEnd() {
        skipBlanks();
        return m_at >= m_text.size();
    }
    /** Consumes the symbol if it comes next. **/
    bool take(const char* symbol) {
        skipBlanks();
        const std::size_t length = std::strlen(symbol);
        if (m_text.compare(m_at, length, symbol) != 0) return false;
        m_at += length;
        m_end = m_at;
        return true;
    }
    bool isNext(const char* symbol) {
        skipBlanks();
        return m_text.compare(m_at, std::strlen(symbol), symbol) == 0;
    }

    //---------------------------------------------------------------------------------------------
    // Nodes

    int add(Operation operation, std::vector<int> operands, std::size_t begin,
            std::shared_ptr<const Table> table = nullptr,
            std::shared_ptr<const SurfaceTable> surface = nullptr,
            std::shared_ptr<const OwnFunction> function = nullptr) {
        Node node;
        node.operation = operation;
        node.table = std::move(table);
        node.surface = std::move(surface);
        node.function = std::move(function);
        node.begin = static_cast<int>(begin);
        node.end = static_cast<int>(m_end);
        for (int operand : operands) node.depth = std::max(node.depth, m_tree[operand].depth + 1);
        if (node.depth > MaxDepth)
            fail("the formula has more than " + std::to_string(MaxDepth) + " operations in a row",
                 begin);
        node.operands = std::move(operands);
        m_tree.nodes.push_back(std::move(node));
        return fold();
    }
    int addNumber(double number, std::size_t begin) {
        Node node;
        node.number = number;
        node.begin = static_cast<int>(begin);
        node.end = static_cast<int>(m_end);
        m_tree.nodes.push_back(node);
        return m_tree.getRoot();
    }

    /** Negates a node. Comparisons stay comparisons, which have a margin: !(a < b) is b <= a. **/
    int addNot(int number, std::size_t begin) {
        const Node node = m_tree[number];
        const auto addSwapped = [&](Operation operation) {
            return add(operation, {node.operands[1], node.operands[0]}, begin);
        };
        const auto addBoth = [&](Operation operation) {
            const int first = addNot(node.operands[0], begin);
            const int second = addNot(node.operands[1], begin);
            return add(operation, {first, second}, begin);
        };
        switch (node.operation) {
            case Operation::Less:
                return addSwapped(Operation::LessOrEqual);
            case Operation::LessOrEqual:
                return addSwapped(Operation::Less);
            case Operation::Equal:
                return add(Operation::NotEqual, node.operands, begin);
            case Operation::NotEqual:
                return add(Operation::Equal, node.operands, begin);
            case Operation::And:
                return addBoth(Operation::Or);
            case Operation::Or:
                return addBoth(Operation::And);
            default:
                return add(Operation::Equal, {number, addNumber(0, begin)}, begin);
        }
    }

    /** Replaces the last node by a Number if it has a constant value; without one it stays, for
    messages. **/
    int fold() {
        Node& node = m_tree.nodes.back();
        const auto isNumber = [&](int operand) {
            return m_tree[operand].operation == Operation::Number;
        };
        const bool isChoice = node.operation == Operation::If && isNumber(node.operands[0]);
        if (isChoice) {
            const int taken = node.operands[m_tree[node.operands[0]].number != 0 ? 1 : 2];
            m_tree.nodes.pop_back();
            return taken;
        }
        if (!node.operands.empty() && node.operation != Operation::Call &&
            std::all_of(node.operands.begin(), node.operands.end(), isNumber)) {
            const double value = evaluate<double>(m_tree, m_tree.getRoot(), nullptr);
            if (std::isfinite(value)) {
                node.operation = Operation::Number;
                node.number = value;
                node.operands.clear();
                node.table = nullptr;
                node.surface = nullptr;
                node.depth = 1;
            }
        }
        return m_tree.getRoot();
    }

    //---------------------------------------------------------------------------------------------
    // Grammar

    int parseChoice() {
        skipBlanks();
        const std::size_t begin = m_at;
        const int condition = parseOr();
        if (!take("?")) return condition;
        const Nesting nesting(*this);
        const int yes = parseChoice();
        if (!take(":")) {
            if (isAtEnd()) fail("the ':' of the '?' is missing");
            failAtToken();
        }
        const int no = parseChoice();
        return add(Operation::If, {condition, yes, no}, begin);
    }

    int parseOr() {
        skipBlanks();
        const std::size_t begin = m_at;
        int left = parseAnd();
        while (take("||")) {
            const int right = parseAnd();
            left = add(Operation::Or, {left, right}, begin);
        }
        if (isNext("|")) fail("write || for or");
        return left;
    }

    int parseAnd() {
        skipBlanks();
        const std::size_t begin = m_at;
        int left = parseComparison();
        while (take("&&")) {
            const int right = parseComparison();
            left = add(Operation::And, {left, right}, begin);
        }
        if (isNext("&")) fail("write && for and");
        return left;
    }

    int parseComparison() {
        skipBlanks();
        const std::size_t begin = m_at;
        int left = parseSum();
        for (int count = 0;; ++count) {
            const std::size_t place = (skipBlanks(), m_at);
            Operation operation = Operation::Less;
            bool isSwapped = false;
            if (take("<="))
                operation = Operation::LessOrEqual;
            else if (take(">="))
                operation = Operation::LessOrEqual, isSwapped = true;
            else if (take("=="))
                operation = Operation::Equal;
            else if (take("!="))
                operation = Operation::NotEqual;
            else if (take(">"))
                isSwapped = true;
            else if (!take("<"))
                return left;
            if (count > 0)
                fail("comparisons do not follow each other: write a < b && b < c for a < b < c",
                     place);
            const int right = parseSum();
            left = isSwapped ? add(operation, {right, left}, begin)
                             : add(operation, {left, right}, begin);
        }
    }

    int parseSum() {
        skipBlanks();
        const std::size_t begin = m_at;
        int left = parseProduct();
        for (;;) {
            const bool isPlus = take("+");
            if (!isPlus && !take("-")) return left;
            const int right = parseProduct();
            left = add(isPlus ? Operation::Add : Operation::Subtract, {left, right}, begin);
        }
    }

    int parseProduct() {
        skipBlanks();
        const std::size_t begin = m_at;
        int left = parseSigned();
        for (;;) {
            if (isNext("**")) fail("write ^ for a power");
            const bool isTimes = take("*");
            if (!isTimes && !take("/")) return left;
            const int right = parseSigned();
            left = add(isTimes ? Operation::Multiply : Operation::Divide, {left, right}, begin);
        }
    }

    int parseSigned() {
        skipBlanks();
        const std::size_t begin = m_at;
        if (isNext("!") && !isNext("!=")) {
            take("!");
            const Nesting nesting(*this);
            return addNot(parseSigned(), begin);
        }
        const bool isMinus = take("-");
        if (isMinus || take("+")) {
            const Nesting nesting(*this);
            const int operand = parseSigned();
            return isMinus ? add(Operation::Negate, {operand}, begin) : operand;
        }
        const int base = parsePrimary();
        if (!take("^")) return base;
        const Nesting nesting(*this);
        const int exponent = parseSigned();
        return add(Operation::Power, {base, exponent}, begin);
    }

    int parsePrimary() {
        skipBlanks();
        const std::size_t begin = m_at;
        if (take("(")) {
            const Nesting nesting(*this);
            const int inner = parseChoice();
            if (!take(")")) {
                if (isAtEnd()) fail("a ')' is missing");
                failAtToken();
            }
            return inner;
        }
        if (m_at < m_text.size() && (isDigit(m_text[m_at]) || m_text[m_at] == '.'))
            return parseNumber();
        if (m_at < m_text.size() && isWordCharacter(m_text[m_at])) return parseWord(begin);
        failAtToken();
    }

    int parseNumber() {
        const std::size_t begin = m_at;
        while (m_at < m_text.size() && (isDigit(m_text[m_at]) || m_text[m_at] == '.')) ++m_at;
        if (m_at < m_text.size() && (m_text[m_at] == 'e' || m_text[m_at] == 'E')) {
            std::size_t exponent = m_at + 1;
            if (exponent < m_text.size() && (m_text[exponent] == '+' || m_text[exponent] == '-'))
                ++exponent;
            if (exponent < m_text.size() && isDigit(m_text[exponent])) {
                m_at = exponent;
                while (m_at < m_text.size() && isDigit(m_text[m_at])) ++m_at;
            }
        }
        m_end = m_at;
        const std::string number = m_text.substr(begin, m_at - begin);
        double value = 0;
        if (!readPlainNumber(number, value)) fail("'" + number + "' is not a number", begin);
        const int node = addNumber(value, begin);
        skipBlanks();
        if (m_at < m_text.size() && (isLetter(m_text[m_at]) || m_text[m_at] == '_'))
            failAtUnit(number, begin);
        return node;
    }

    int parseWord(std::size_t begin) {
        while (m_at < m_text.size() && (isWordCharacter(m_text[m_at]) || m_text[m_at] == '.'))
            ++m_at;
        m_end = m_at;
        const std::string word = m_text.substr(begin, m_at - begin);
        const bool isCall = m_scope.hasTable(word) && isNext("(");
        const auto variable = std::find(m_variables.begin(), m_variables.end(), word);
        if (variable != m_variables.end() && !isCall) {
            Node node;
            node.operation = Operation::Variable;
            node.variable = static_cast<int>(variable - m_variables.begin());
            node.begin = static_cast<int>(begin);
            node.end = static_cast<int>(m_end);
            m_tree.nodes.push_back(node);
            return m_tree.getRoot();
        }
        const auto constant = m_scope.constants.find(word);
        if (constant != m_scope.constants.end()) return addNumber(constant->second, begin);
        const auto table = m_scope.tables.find(word);
        const auto surface = m_scope.surfaces.find(word);
        const bool isSurface = surface != m_scope.surfaces.end();
        const Function* function = findFunction(word);
        const auto own = m_scope.functions.find(word);
        const bool isOwn = own != m_scope.functions.end();
        if (table == m_scope.tables.end() && !isSurface && !function && !isOwn)
            throw SyntaxError(word == "t"
                                  ? "this number is constant: it cannot depend on the time t"
                                  : "'" + word + "' is not a parameter, table or function",
                              static_cast<int>(begin), word == "t" ? "" : word);
        if (!take("(")) fail(word + " needs its arguments in parentheses", begin);
        const Nesting nesting(*this);
        const std::vector<int> arguments = parseArguments();
        const auto count = static_cast<int>(arguments.size());
        const int axes = isSurface ? 2 : 1;
        const int fewest = function ? function->fewest
                           : isOwn  ? own->second->fewest
                                    : axes,
                  most = function ? function->most
                         : isOwn  ? own->second->most
                                  : axes;
        if (!function && !isOwn && count != axes)
            fail("the table '" + word + "' has " + (isSurface ? "two arguments" : "one argument") +
                     ", here it gets " + std::to_string(count),
                 begin);
        if (count < fewest) fail("the function '" + word + "' has too few arguments", begin);
        if (count > most) fail("the function '" + word + "' has too many arguments", begin);
        if (isSurface) return add(Operation::LookupTwo, arguments, begin, nullptr, surface->second);
        if (isOwn) return add(Operation::Call, arguments, begin, nullptr, nullptr, own->second);
        if (!function) return add(Operation::Lookup, arguments, begin, table->second);
        if (const int composed = compose(word, arguments, begin); composed >= 0) return composed;
        if (function->most != Any) return add(function->operation, arguments, begin);
        int result = arguments[0];
        for (int i = 1; i < count; ++i)
            result =
                add(function->operation, {result, arguments[static_cast<std::size_t>(i)]}, begin);
        return result;
    }

    /** Functions defined by others; −1 for all other functions. **/
    int compose(const std::string& word, const std::vector<int>& x, std::size_t begin) {
        const auto make = [&](Operation operation, int a, int b) {
            return add(operation, {a, b}, begin);
        };
        const auto checkOrder = [&](int low, int high, const char* what) {
            const Node &a = m_tree[low], &b = m_tree[high];
            if (a.operation == Operation::Number && b.operation == Operation::Number &&
                a.number > b.number)
                fail(what, begin);
        };
        if (word == "step" || word == "ramp")
            checkOrder(x[1], x[3],
                       word == "step"
                           ? "the times of step(t, t0, y0, t1, y1) must ascend: t0 <= t1"
                           : "the times of ramp(t, t0, y0, t1, y1) must ascend: t0 <= t1");
        if (word == "pulse")
            checkOrder(x[1], x[2], "the times of pulse(t, t0, t1) must ascend: t0 <= t1");
        if (word == "clamp") {
            checkOrder(x[1], x[2], "clamp(x, low, high) has a low above its high");
            return make(Operation::Max, make(Operation::Min, x[0], x[2]), x[1]);
        }
        if (word == "deadband") {
            const int most = m_tree[x[1]].operation == Operation::Number
                                 ? x[1]
                                 : add(Operation::Abs, {x[1]}, begin);
            const int least = add(Operation::Negate, {most}, begin);
            checkOrder(least, most, "the width of deadband(x, width) is negative");
            const int within = make(Operation::Max, make(Operation::Min, x[0], most), least);
            return make(Operation::Subtract, x[0], within);
        }
        // With a second argument, the corner is rounded over that width.
        if (word == "abs" && x.size() == 2) return make(Operation::Hypot, x[0], x[1]);
        if (word == "sign" && x.size() == 2)
            return make(Operation::Divide, x[0], make(Operation::Hypot, x[0], x[1]));
        return -1;
    }

    std::vector<int> parseArguments() {
        std::vector<int> arguments;
        if (take(")")) return arguments;
        do arguments.push_back(parseChoice());
        while (take(","));
        if (!take(")")) {
            if (isAtEnd()) fail("a ')' is missing");
            failAtToken();
        }
        return arguments;
    }
};

}  // namespace

Tree parse(const std::string& text, const Scope& scope, const std::vector<std::string>& variables) {
    return Parser(text, scope, variables).parse();
}

std::vector<std::string> getFunctionNames() {
    std::vector<std::string> names;
    for (const Function& function : FormulaFunctions) names.push_back(function.name);
    return names;
}

bool readPlainNumber(const std::string& text, double& value) {
    if (text.empty() || text.size() > 100) return false;
    if (text.find_first_not_of("0123456789+-.eE") != std::string::npos) return false;
    const char* const end = text.data() + text.size();
    const char* const begin = text.data() + (text[0] == '+' && text[1] != '-' ? 1 : 0);
    const std::from_chars_result read = std::from_chars(begin, end, value);  // locale-independent
    return read.ec == std::errc() && read.ptr == end && std::isfinite(value);
}

}  // namespace formula
}  // namespace simflex
