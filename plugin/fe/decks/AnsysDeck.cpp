#include "AnsysDeck.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

constexpr int MostInRange = 20000000;

/** Commands that affect K or M in an unsupported way, and the remedy. **/
const std::map<std::string, const char*> RefusedCommands = {
    {"CE", "write constraint equations as *EQUATION of a deck"},
    {"CP", "write coupled degrees of freedom as *EQUATION of a deck"},
    {"E", "write elements by CDWRITE, as an EBLOCK"},
    {"EN", "write elements by CDWRITE, as an EBLOCK"},
    {"SECJOINT", "put joints into the multibody model"},
    {"TBFIELD", "material constants cannot depend on temperature; give those at one temperature"}};

/** Labels of TB for which the initial behaviour is elastic. **/
const std::set<std::string> YieldingLabels = {"BISO", "MISO", "BKIN", "MKIN", "KINH",
                                              "CHAB", "NLIS", "PLAS", "CREE", "SDAM"};

/** Labels of MP irrelevant to stiffness and mass. **/
const std::set<std::string> IdleLabels = {
    "ALPX", "CTEX", "THSX", "REFT", "KXX",  "KYY",  "KZZ",  "C",    "ENTH", "HF",   "EMIS", "MU",
    "DAMP", "DMPR", "BETD", "ALPD", "RSVX", "PERX", "MURX", "VISC", "SONC", "ALPY", "ALPZ"};

/** Elements without structural function. **/
const std::set<int> IdleElements = {152, 153, 154, 156, 200, 201};

/** Fixed-column format of a line. **/
struct FixedColumns {
    size_t width = 0, count = 0;  ///< of integers
    size_t realWidth = 0;         ///< of the numbers after them
};

class AnsysReader {
public:
    AnsysReader(const std::string& path, const ProgressCallback& progress)
        : m_progress(progress), m_path(path), m_lines(path, "Ansys model") {}

    std::vector<DeckCard> read() {
        while (m_lines.next()) {
            report();
            const std::string line = upperCase(trimBlanks(m_lines.line()));
            if (line.empty() || line[0] == '!' || line[0] == '(') continue;
            std::vector<std::string> words = splitAt(line, ',');
            for (std::string& word : words) word = trimBlanks(word);
            take(words);
        }
        if (m_nodes.empty()) throw std::invalid_argument(m_path + ": there is no NBLOCK in it");
        writeNodes();
        writeElements();
        writeComponents();
        for (const auto& [name, leftOut] : m_leftOut)
            m_result.push_back(makeNoteCard(
                "left out " + name + " (" + m_path + ":" + std::to_string(leftOut.first) + ")" +
                (leftOut.second > 1 ? ", " + std::to_string(leftOut.second) + " times" : "")));
        return std::move(m_result);
    }

private:
    struct Element {
        int number, material, type, real, section, line;
        std::vector<int> nodes;
    };
    struct ElementKind {
        int number = 0;
        std::map<int, int> options;
    };
    struct Section {
        bool isShell = false;
        std::vector<double> thicknesses;
        double offset = 0;  ///< share of the thickness
        int material = 0, line = 0;
    };
    struct Component {
        std::string name, kind;
        std::vector<int> members;
        int line;
    };

    [[noreturn]] void refuse(int line, const std::string& why) const {
        throw std::invalid_argument(m_path + ":" + std::to_string(line) + ": " + why);
    }

    std::string word(const std::vector<std::string>& words, size_t k) const {
        return k < words.size() ? words[k] : "";
    }
    double number(const std::vector<std::string>& words, size_t k) const {
        double value = 0;
        if (!word(words, k).empty() && !readNumber(word(words, k), value))
            m_lines.refuse(words[0] + ": " + quoteField(word(words, k)) +
                           " must be a finite number");
        return value;
    }
    int integer(const std::vector<std::string>& words, size_t k) const {
        const double value = number(words, k);
        if (value != double(int(value)) || value < -2e9 || value > 2e9)
            m_lines.refuse(words[0] + ": " + quoteField(word(words, k)) +
                           " must be a whole number");
        return int(value);
    }

    void leaveOut(const std::string& name) {
        auto& entry = m_leftOut[name];
        if (entry.second++ == 0) entry.first = m_lines.number();
    }

    void take(const std::vector<std::string>& words) {
        const std::string& name = words[0];
        if (name[0] == '/' || name[0] == '*') return;  // control commands
        if (name == "NBLOCK") {
            readNodes();
        } else if (name == "N") {
            if (word(words, 1).compare(0, 1, "R") != 0)  // otherwise the end of the block
                m_lines.refuse("write nodes by CDWRITE, as an NBLOCK");
        } else if (name == "EBLOCK") {
            readElements(words);
        } else if (name == "CMBLOCK") {
            readComponent(words);
        } else if (name == "ET") {
            setKind(integer(words, 1), word(words, 2));
            for (size_t k = 3; k < words.size(); ++k)
                if (!words[k].empty())
                    m_kinds[integer(words, 1)].options[int(k) - 2] = integer(words, k);
        } else if (name == "ETBLOCK") {
            readKinds();
        } else if (name == "KEYOPT" || name == "KEYOP") {
            m_kinds[integer(words, 1)].options[integer(words, 2)] = integer(words, 3);
        } else if (name == "MP") {
            setProperty(words, word(words, 1), integer(words, 2), {number(words, 3)});
            for (size_t k = 4; k < words.size(); ++k)
                if (number(words, k) != 0)
                    m_lines.refuse("MP " + words[1] +
                                   " depends on temperature; a material has one");
        } else if (name == "MPDATA") {
            readProperties(words);
        } else if (name == "TB") {
            const std::string label = word(words, 1).substr(0, 4);
            if (!YieldingLabels.count(label))
                m_lines.refuse("TB," + label +
                               " is not known to simflex: give the material by MP: EX, PRXY, DENS");
            leaveOut("TB," + label + ": the part is elastic, however much it is loaded");
        } else if (name == "R") {
            auto& values = m_reals[integer(words, 1)] = {};
            for (size_t k = 2; k < words.size(); ++k) values.push_back(number(words, k));
        } else if (name == "RLBLOCK") {
            readReals(integer(words, 1));
        } else if (name.compare(0, 3, "SEC") == 0) {
            readSection(words);
        } else if (const auto found = RefusedCommands.find(name); found != RefusedCommands.end()) {
            m_lines.refuse(name + " is not known to simflex: " + found->second);
        } else {
            leaveOut(name.substr(0, 20));
        }
    }

    /** Reads a line such as (3i9,6e21.13e3). **/
    FixedColumns readFormat() {
        if (!m_lines.next()) m_lines.refuse("the file ends in a block");
        const std::string text = lowerCase(trimBlanks(m_lines.line()));
        FixedColumns columns;
        size_t at = 1;
        const auto readCount = [&] {
            size_t value = 0;
            for (; at < text.size() && isDigit(text[at]) && value < 1000; ++at)
                value = 10 * value + size_t(text[at] - '0');
            return value;
        };
        if (!text.empty() && text[0] == '(') {
            columns.count = std::max<size_t>(readCount(), 1);
            if (at < text.size() && text[at] == 'i') {
                ++at;
                columns.width = readCount();
            }
            if (at < text.size() && text[at] == ',') {
                ++at;
                readCount();
                ++at;
                columns.realWidth = readCount();
            }
        }
        if (columns.width == 0)
            m_lines.refuse(
                "there must be a format such as (3i9,6e21.13e3) behind the block's line");
        return columns;
    }

    std::vector<int> readIntegers(const FixedColumns& columns) const {
        std::vector<int> values;
        const std::string_view line = m_lines.line();
        for (size_t k = 0; k < columns.count && k * columns.width < line.size(); ++k) {
            const std::string_view field =
                trimBlanks(line.substr(k * columns.width, columns.width));
            if (field.empty()) break;
            values.push_back(m_lines.parseInteger(field, "a number of the block"));
        }
        return values;
    }

    bool isBlockEnd() const {
        const std::string_view text = trimBlanks(m_lines.line());
        return text == "-1" || text.empty() || isLetter(text[0]) || text[0] == '/' ||
               text[0] == '*';
    }

    void report() {
        if (m_lines.number() % DeckLinesPerReport == 0)
            reportProgress(m_progress, ReadingDeck, ReadingCards * m_lines.fraction());
    }

    bool nextInBlock() {
        if (!m_lines.next()) return false;
        report();
        if (!isBlockEnd()) return true;
        if (trimBlanks(m_lines.line()) != "-1") m_lines.stepBack();
        return false;
    }

    void readNodes() {
        const FixedColumns columns = readFormat();
        if (columns.realWidth == 0) m_lines.refuse("the format of NBLOCK has no coordinates");
        while (nextInBlock()) {
            const std::string_view line = m_lines.line();
            const std::vector<int> numbers = readIntegers(columns);
            if (numbers.empty() || numbers[0] < 1) m_lines.refuse("node numbers begin at 1");
            std::array<double, 3> x{};
            for (size_t a = 0; a < 3; ++a) {
                const size_t begin = columns.count * columns.width + a * columns.realWidth;
                if (begin >= line.size()) break;
                const std::string_view field = trimBlanks(line.substr(begin, columns.realWidth));
                if (!field.empty()) x[a] = m_lines.parseNumber(field, "a coordinate");
            }
            if (!m_nodes.emplace(numbers[0], x).second)
                m_lines.refuse("node " + std::to_string(numbers[0]) + " is given twice");
        }
    }

    void readElements(const std::vector<std::string>& words) {
        constexpr size_t Head = 11;
        if (word(words, 2) != "SOLID")
            m_lines.refuse(
                "EBLOCK without SOLID is not known to simflex: write the model by CDWRITE,DB");
        const FixedColumns columns = readFormat();
        while (nextInBlock()) {
            const std::vector<int> head = readIntegers(columns);
            if (head.size() < Head) m_lines.refuse("an element needs 11 numbers and its nodes");
            Element element{head[10], head[0], head[1], head[2], head[3], m_lines.number(), {}};
            element.nodes.assign(head.begin() + Head, head.end());
            if (head[5] != 0)
                m_lines.refuse("element " + std::to_string(element.number) +
                               " is dead; leave out of the model what is not there");
            const int count = head[8];
            if (count < 1 || count > 20)
                m_lines.refuse("element " + std::to_string(element.number) + " has " +
                               std::to_string(count) + " nodes, allowed are 1 to 20");
            while (element.nodes.size() < size_t(count)) {
                if (!m_lines.next() || isBlockEnd())
                    m_lines.refuse("element " + std::to_string(element.number) + " lacks nodes");
                const std::vector<int> more = readIntegers(columns);
                element.nodes.insert(element.nodes.end(), more.begin(), more.end());
            }
            element.nodes.resize(size_t(count));
            if (element.number < 1) m_lines.refuse("element numbers begin at 1");
            m_elements.push_back(std::move(element));
        }
    }

    void readComponent(const std::vector<std::string>& words) {
        Component component{word(words, 1), word(words, 2), {}, m_lines.number()};
        // Words after the count are flags; a comment may follow it.
        const std::string count = word(words, 3).substr(0, word(words, 3).find_first_of(" !"));
        double expected = 0;
        if (!readNumber(count, expected) || expected < 0 || expected > 2e9)
            m_lines.refuse("CMBLOCK needs the number of its entries");
        const FixedColumns columns = readFormat();
        size_t left = size_t(expected);
        while (left > 0) {
            if (!m_lines.next()) m_lines.refuse("the component ends too soon");
            const std::vector<int> values = readIntegers(columns);
            if (values.empty() || values.size() > left)
                m_lines.refuse("the component ends too soon");
            left -= values.size();
            for (const int value : values) {
                if (value >= 0 || component.members.empty()) {
                    component.members.push_back(value);
                    continue;
                }
                const int first = component.members.back();
                if (-(value + first) > MostInRange) m_lines.refuse("the range is too long");
                for (int k = first + 1; k <= -value; ++k) component.members.push_back(k);
            }
        }
        m_components.push_back(std::move(component));
    }

    void setKind(int id, const std::string& type) {
        std::string digits;
        for (const char c : type)
            if (isDigit(c)) digits += c;
        int kind = 0;
        if (!readInteger(digits, kind))
            m_lines.refuse("element type " + quoteField(type) + " is none");
        m_kinds[id].number = kind;
    }

    void readKinds() {
        const FixedColumns columns = readFormat();
        while (nextInBlock()) {
            FixedColumns all = columns;
            all.count = 2 + 18;
            const std::vector<int> values = readIntegers(all);
            if (values.size() < 2) m_lines.refuse("an element type needs its number and its kind");
            ElementKind& kind = m_kinds[values[0]];
            kind.number = values[1];
            for (size_t k = 2; k < values.size(); ++k) kind.options[int(k) - 1] = values[k];
        }
    }

    /** MPDATA,R5.0,COUNT,LABEL,MATERIAL,FIRST,VALUES or MPDATA,LABEL,MATERIAL,FIRST,VALUES **/
    void readProperties(const std::vector<std::string>& words) {
        const bool hasVersion =
            word(words, 1).size() > 1 && word(words, 1)[0] == 'R' && isDigit(word(words, 1)[1]);
        const size_t label = hasVersion ? 3 : 1;
        size_t count = words.size() > label + 3 ? words.size() - label - 3 : 0;
        if (hasVersion) count = std::min(count, size_t(std::max(integer(words, 2), 0)));
        std::vector<double> values;
        for (size_t k = 0; k < count; ++k)
            if (!word(words, label + 3 + k).empty()) values.push_back(number(words, label + 3 + k));
        setProperty(words, word(words, label), integer(words, label + 1), values);
    }

    void setProperty(const std::vector<std::string>& words, const std::string& label, int material,
                     const std::vector<double>& values) {
        if (values.empty()) m_lines.refuse(words[0] + " " + label + " has no value");
        for (const double value : values)
            if (value != values[0] && !IdleLabels.count(label))
                m_lines.refuse(
                    words[0] + " " + label +
                    " depends on temperature; a material has one: give its constants there");
        if (IdleLabels.count(label)) return leaveOut(words[0] + "," + label);
        static const std::set<std::string> Known = {"EX",   "EY",   "EZ",   "NUXY", "NUYZ",
                                                    "NUXZ", "PRXY", "PRYZ", "PRXZ", "GXY",
                                                    "GYZ",  "GXZ",  "DENS"};
        if (!Known.count(label))
            m_lines.refuse(words[0] + " " + quoteField(label) +
                           " is not a property of a material that simflex knows");
        m_materials[material][label] = {values[0], m_lines.number()};
    }

    /** After two formats, (2i8,6g16.9) and (7g16.9): set, count, values. **/
    void readReals(int numSets) {
        const FixedColumns columns = readFormat();
        m_lines.next();
        for (int k = 0; k < numSets; ++k) {
            if (!m_lines.next() || isBlockEnd()) m_lines.refuse("RLBLOCK ends too soon");
            const std::vector<int> head = readIntegers(columns);
            if (head.size() < 2 || columns.realWidth == 0) m_lines.refuse("RLBLOCK has no values");
            std::vector<double>& values = m_reals[head[0]] = {};
            size_t begin = columns.count * columns.width;
            const size_t count = size_t(std::clamp(head[1], 0, 1000));
            while (values.size() < count) {
                const std::string_view line = m_lines.line();
                for (; begin < line.size() && values.size() < count; begin += columns.realWidth) {
                    const std::string_view field =
                        trimBlanks(line.substr(begin, columns.realWidth));
                    values.push_back(field.empty() ? 0 : m_lines.parseNumber(field, "a constant"));
                }
                begin = 0;
                if (values.size() < count && (!m_lines.next() || isBlockEnd()))
                    m_lines.refuse("RLBLOCK ends too soon");
            }
        }
    }

    void readSection(const std::vector<std::string>& words) {
        const std::string& name = words[0];
        if (name == "SECTYPE") {
            m_section = integer(words, 1);
            m_sections[m_section].isShell = word(words, 2) == "SHELL";
            m_sections[m_section].line = m_lines.number();
        } else if (name == "SECDATA") {
            m_sections[m_section].thicknesses.push_back(number(words, 1));
            m_sections[m_section].material = integer(words, 2);
        } else if (name == "SECBLOCK") {
            const int layers = integer(words, 1);
            for (int k = 0; k < layers; ++k) {
                if (!m_lines.next()) m_lines.refuse("SECBLOCK ends too soon");
                const std::vector<std::string> layer = splitAt(m_lines.line(), ',');
                m_sections[m_section].thicknesses.push_back(
                    m_lines.parseNumber(trimBlanks(layer[0]), "a thickness"));
                if (layer.size() > 1)
                    m_sections[m_section].material =
                        m_lines.parseInteger(trimBlanks(layer[1]), "a material");
            }
        } else if (name.compare(0, 6, "SECOFF") == 0) {
            const std::string place = word(words, 1);
            if (place != "MID" && place != "TOP" && place != "BOT" && !place.empty())
                m_lines.refuse("an offset of a shell must be MID, TOP or BOT");
            // The nodes are on the top, so the mid-surface is half a thickness below.
            m_sections[m_section].offset = place == "TOP" ? 0.5 : place == "BOT" ? -0.5 : 0;
        } else if (name.compare(0, 7, "SECCONT") == 0) {
            // User-defined shear stiffnesses and mass; the following values scale hourglass
            // stiffness.
            for (size_t k = 1; k <= 4; ++k)
                if (number(words, k) != 0)
                    m_lines.refuse(
                        "SECCONTROLS gives shells a shear stiffness or mass of their "
                        "own, which simflex does not know: leave these at 0");
            leaveOut(name.substr(0, 20));
        } else if (const auto found = RefusedCommands.find(name); found != RefusedCommands.end()) {
            m_lines.refuse(name + " is not known to simflex: " + found->second);
        } else {
            leaveOut(name.substr(0, 20));
        }
    }

    DeckCard& addCard(int line, const std::string& title,
                      std::map<std::string, std::string> parameters) {
        DeckCard card;
        card.setTitle(title);
        card.parameters = std::move(parameters);
        card.file = m_path;
        card.line = line;
        m_result.push_back(std::move(card));
        return m_result.back();
    }

    static void addLine(DeckCard& card, std::vector<std::string> fields, int line = 0) {
        DeckLine data;
        data.line = line ? line : card.line;
        data.fields = std::move(fields);
        card.data.push_back(std::move(data));
    }

    void writeNodes() {
        DeckCard& card = addCard(1, "*NODE", {});
        for (const auto& [number, x] : m_nodes)
            addLine(card, {std::to_string(number), writeGeneral(x[0]), writeGeneral(x[1]),
                           writeGeneral(x[2])});
    }

    int optionOf(const Element& element, int option) const {
        const auto& options = m_kinds.at(element.type).options;
        const auto found = options.find(option);
        return found == options.end() ? 0 : found->second;
    }

    /** Returns CalculiX's type and the indices of its nodes in the element: degenerate elements
    have fewer. **/
    std::pair<std::string, std::vector<size_t>> chooseElement(const Element& element,
                                                              int kind) const {
        const auto& n = element.nodes;
        const auto all = [&](size_t count) {
            std::vector<size_t> order(count);
            for (size_t k = 0; k < count; ++k) order[k] = k;
            return order;
        };
        const auto needs = [&](size_t count) {
            if (n.size() != count)
                refuse(element.line, "element " + std::to_string(element.number) + " has " +
                                         std::to_string(n.size()) + " nodes, needs " +
                                         std::to_string(count));
        };
        if (kind == 187 || kind == 92) {
            needs(10);
            return {"C3D10", all(10)};
        }
        if (kind == 181) {
            const int use = optionOf(element, 1);  // 1: a membrane
            if (use != 0 && use != 1)
                refuse(element.line, "SHELL181 with KEYOPT(1) = " + std::to_string(use) +
                                         " is not known to simflex: 0 and 1 are");
            needs(4);
            if (n[2] == n[3]) return {use == 1 ? "M3D3" : "S3", all(3)};
            return {use == 1 ? "M3D4" : "S4", all(4)};
        }
        if (kind == 281) {
            needs(8);
            if (n[2] == n[3]) return {"S6", {0, 1, 2, 4, 5, 7}};
            return {"S8R", all(8)};
        }
        const bool isQuadratic = kind == 186 || kind == 95;
        needs(isQuadratic ? 20 : 8);
        const bool isTriangle = n[2] == n[3],
                   isPointed = n[4] == n[5] && n[5] == n[6] && n[6] == n[7];
        if (isPointed && !isTriangle)
            refuse(element.line, "element " + std::to_string(element.number) +
                                     " is a pyramid, which CalculiX does not have; mesh with "
                                     "tetrahedra, wedges and hexahedra");
        if (isPointed) {
            if (isQuadratic) return {"C3D10", {0, 1, 2, 4, 8, 9, 11, 16, 17, 18}};
            return {"C3D4", {0, 1, 2, 4}};
        }
        if (isTriangle) {
            if (isQuadratic) return {"C3D15", {0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 15, 16, 17, 18}};
            return {"C3D6", {0, 1, 2, 4, 5, 6}};
        }
        if (isQuadratic)
            return {kind == 95 || optionOf(element, 2) == 1 ? "C3D20" : "C3D20R", all(20)};
        return {optionOf(element, 2) == 1 ? "C3D8R" : "C3D8I", all(8)};
    }

    /** Writes elements by type and section; a section is the material, and for shells the section
    or real constants. **/
    void writeElements() {
        std::map<std::pair<std::string, std::string>,
                 std::vector<std::pair<const Element*, std::vector<int>>>>
            blocks;
        std::map<std::string, const Element*> solids, shells, masses, springs, trusses;
        std::set<int> numbers;
        for (const Element& element : m_elements) {
            const auto kind = m_kinds.find(element.type);
            if (kind == m_kinds.end() || kind->second.number == 0)
                refuse(element.line, "element " + std::to_string(element.number) + " is of type " +
                                         std::to_string(element.type) + ", which no ET defines");
            const int number = kind->second.number;
            if (IdleElements.count(number)) {
                auto& entry = m_leftOut["elements of type " + std::to_string(number)];
                if (entry.second++ == 0) entry.first = element.line;
                continue;
            }
            static const std::set<int> Solids = {185, 45, 186, 95, 187, 92}, Shells = {181, 281},
                                       Lines = {14, 180, 8};
            if (!Solids.count(number) && !Shells.count(number) && !Lines.count(number) &&
                number != 21)
                refuse(
                    element.line,
                    "element " + std::to_string(element.number) + " is of type " +
                        std::to_string(number) +
                        ", which simflex does not know: solids 185, 186, 187, 45, 92, 95, shells "
                        "181, 281, masses 21, springs 14, trusses 180, 8");
            if (!numbers.insert(element.number).second)
                refuse(element.line,
                       "element " + std::to_string(element.number) + " is given twice");
            if (number == 21) {
                const std::string set = "MASS_" + std::to_string(element.real);
                masses.emplace(set, &element);
                blocks[{"MASS", set}].push_back({&element, {element.nodes[0]}});
                continue;
            }
            if (Lines.count(number)) {
                if (element.nodes.size() < 2)
                    refuse(element.line,
                           "element " + std::to_string(element.number) + " has one node, needs 2");
                std::string set =
                    (number == 14 ? "SPRING_" : "TRUSS_") + std::to_string(element.real);
                if (number != 14) set += "_MAT_" + std::to_string(element.material);
                (number == 14 ? springs : trusses).emplace(set, &element);
                blocks[{number == 14 ? "SPRINGA" : "T3D2", set}].push_back(
                    {&element, {element.nodes[0], element.nodes[1]}});
                continue;
            }
            const auto [type, order] = chooseElement(element, number);
            std::vector<int> nodes;
            for (const size_t k : order) nodes.push_back(element.nodes[k]);
            if (std::count(nodes.begin(), nodes.end(), 0) > 0)
                refuse(element.line, "element " + std::to_string(element.number) +
                                         " lacks nodes in the middle of some edges");
            std::string set = "MAT_" + std::to_string(element.material);
            if (Shells.count(number)) {
                set += "_SEC_" + std::to_string(element.section) + "_R_" +
                       std::to_string(element.real) + (type[0] == 'M' ? "_MEMBRANE" : "");
                shells.emplace(set, &element);
            } else {
                solids.emplace(set, &element);
            }
            blocks[{type, set}].push_back({&element, std::move(nodes)});
        }
        for (const auto& [block, elements] : blocks) {
            DeckCard& card = addCard(elements[0].first->line, "*ELEMENT",
                                     {{"TYPE", block.first}, {"ELSET", block.second}});
            for (const auto& [element, nodes] : elements) {
                std::vector<std::string> fields = {std::to_string(element->number)};
                for (const int node : nodes) fields.push_back(std::to_string(node));
                addLine(card, std::move(fields), element->line);
            }
        }
        for (const auto& [set, element] : solids)
            addCard(element->line, "*SOLID SECTION",
                    {{"ELSET", set}, {"MATERIAL", writeMaterial(*element, element->material)}});
        for (const auto& [set, element] : shells) writeShellSection(set, *element);
        for (const auto& [set, element] : masses) writeMass(set, *element);
        for (const auto& [set, element] : springs) writeSpring(set, *element);
        for (const auto& [set, element] : trusses) {
            const double area = getReal(*element, 0);
            if (!(area > 0))
                refuse(element->line, "element " + std::to_string(element->number) +
                                          ", a truss, has no area by R");
            addLine(
                addCard(element->line, "*SOLID SECTION",
                        {{"ELSET", set}, {"MATERIAL", writeMaterial(*element, element->material)}}),
                {writeGeneral(area)});
        }
    }

    /** Returns one of an element's real constants, 0 if it is not given. **/
    double getReal(const Element& element, size_t k) const {
        const auto real = m_reals.find(element.real);
        return real == m_reals.end() || k >= real->second.size() ? 0 : real->second[k];
    }

    /** Writes COMBIN14 as a spring along the line of its nodes; R contains stiffness and
    damping. **/
    void writeSpring(const std::string& set, const Element& element) {
        for (const int option : {1, 2, 3})
            if (optionOf(element, option) != 0)
                refuse(element.line, "COMBIN14 with KEYOPT(" + std::to_string(option) +
                                         ") is not known to simflex: its springs pull along the "
                                         "line of their nodes; put it into the multibody model");
        if (!(getReal(element, 0) > 0))
            refuse(element.line, "element " + std::to_string(element.number) +
                                     ", a COMBIN14, has no stiffness by R; put dampers into the "
                                     "multibody model");
        addLine(addCard(element.line, "*SPRING", {{"ELSET", set}}),
                {writeGeneral(getReal(element, 0))});
        if (getReal(element, 1) == 0) return;
        auto& entry = m_leftOut["damping of COMBIN14"];
        if (entry.second++ == 0) entry.first = element.line;
    }

    std::string writeMaterial(const Element& element, int number) {
        const std::string name = "MAT_" + std::to_string(number);
        if (!m_written.insert(number).second) return name;
        const auto found = m_materials.find(number);
        if (found == m_materials.end())
            refuse(element.line, "element " + std::to_string(element.number) + " is of material " +
                                     std::to_string(number) + ", which no MP defines");
        const auto& values = found->second;
        const auto get = [&](const std::string& label, double otherwise) {
            const auto value = values.find(label);
            return value == values.end() ? otherwise : value->second.first;
        };
        const double E = get("EX", 0), nu = get("PRXY", get("NUXY", 0.3)),
                     shear = E / (2 * (1 + nu));
        const int line = values.begin()->second.second;
        if (!(E > 0)) refuse(line, "material " + std::to_string(number) + " has no EX");
        if (!values.count("DENS"))
            refuse(line, "material " + std::to_string(number) +
                             " has no DENS, so that its elements have no mass");
        for (const char* label :
             {"EY", "EZ", "PRYZ", "PRXZ", "NUYZ", "NUXZ", "GXY", "GYZ", "GXZ"}) {
            const double isotropic = label[0] == 'E' ? E : label[0] == 'G' ? shear : nu;
            if (std::abs(get(label, isotropic) - isotropic) > 1e-6 * std::abs(isotropic))
                refuse(values.at(label).second,
                       "material " + std::to_string(number) + " is not isotropic by " + label +
                           "; give it as a deck's *ELASTIC, TYPE=ENGINEERING CONSTANTS");
        }
        addCard(line, "*MATERIAL", {{"NAME", name}});
        addLine(addCard(line, "*ELASTIC", {}), {writeFortran(E, 13), writeFortran(nu, 13)});
        addLine(addCard(line, "*DENSITY", {}), {writeFortran(get("DENS", 0), 13)});
        return name;
    }

    void writeShellSection(const std::string& set, const Element& element) {
        const auto section = m_sections.find(element.section);
        double thickness = 0, offset = 0;
        int material = element.material;
        if (section != m_sections.end() && section->second.isShell &&
            !section->second.thicknesses.empty()) {
            if (section->second.thicknesses.size() > 1)
                refuse(section->second.line, "section " + std::to_string(element.section) +
                                                 " has layers, which simflex does not know; mesh "
                                                 "them as solids");
            thickness = section->second.thicknesses[0];
            offset = section->second.offset;
            if (section->second.material > 0) material = section->second.material;
        } else {
            const auto real = m_reals.find(element.real);
            if (real == m_reals.end() || real->second.empty())
                refuse(element.line, "element " + std::to_string(element.number) +
                                         " has no thickness by section or R");
            thickness = real->second[0];
            for (size_t k = 1; k < real->second.size(); ++k)
                if (real->second[k] != 0 && (k > 3 || real->second[k] != thickness))
                    refuse(element.line, "constants " + std::to_string(element.real) +
                                             " say more of a shell than one thickness");
        }
        std::map<std::string, std::string> parameters = {
            {"ELSET", set}, {"MATERIAL", writeMaterial(element, material)}};
        const bool isMembrane = set.back() == 'E';
        if (offset != 0 && !isMembrane) parameters["OFFSET"] = writeGeneral(offset);
        addLine(
            addCard(element.line, isMembrane ? "*MEMBRANE SECTION" : "*SHELL SECTION", parameters),
            {writeGeneral(thickness)});
    }

    /** KEYOPT(3) = 0: masses along x, y, z and inertias; 2: one mass. **/
    void writeMass(const std::string& set, const Element& element) {
        const auto real = m_reals.find(element.real);
        if (real == m_reals.end() || real->second.empty())
            refuse(element.line,
                   "element " + std::to_string(element.number) + ", a MASS21, has no constants R");
        std::vector<double> values = real->second;
        const int option = optionOf(element, 3);
        if (option != 0 && option != 2)
            refuse(element.line, "MASS21 with KEYOPT(3) = " + std::to_string(option) +
                                     " is not known to simflex: 0 and 2 are");
        if (option == 2) values = {values[0], values[0], values[0]};
        values.resize(std::max<size_t>(values.size(), 3));
        for (size_t k = 1; k < values.size(); ++k)
            if (k < 3 ? values[k] != values[0] : values[k] != 0)
                refuse(element.line,
                       "MASS21 has inertia, or masses that differ along x, y and z; weld a "
                       "rigid body to an interface instead");
        addLine(addCard(element.line, "*MASS", {{"ELSET", set}}), {writeGeneral(values[0])});
    }

    void writeComponents() {
        for (const Component& component : m_components) {
            const bool isOfNodes = component.kind.compare(0, 4, "NODE") == 0;
            if (!isOfNodes && component.kind.compare(0, 4, "ELEM") != 0) {
                leaveOut("component " + component.name + " of " + component.kind);
                continue;
            }
            const char* kind = isOfNodes ? "NSET" : "ELSET";
            DeckCard& card =
                addCard(component.line, std::string("*") + kind, {{kind, component.name}});
            for (const int member : component.members) addLine(card, {std::to_string(member)});
            if (!isOfNodes)
                addCard(component.line, "*NSET",
                        {{"NSET", component.name}, {"ELSET", component.name}});
        }
    }

    const ProgressCallback& m_progress;
    std::string m_path;
    TextLines m_lines;
    std::map<int, std::array<double, 3>> m_nodes;
    std::vector<Element> m_elements;
    std::map<int, ElementKind> m_kinds;
    std::map<int, std::map<std::string, std::pair<double, int>>> m_materials;  ///< with their lines
    std::map<int, std::vector<double>> m_reals;
    std::map<int, Section> m_sections;
    int m_section = 0;
    std::vector<Component> m_components;
    std::map<std::string, std::pair<int, int>> m_leftOut;  ///< first line and count
    std::set<int> m_written;
    std::vector<DeckCard> m_result;
};

}  // namespace

std::vector<DeckCard> readAnsysCards(const std::string& path, const ProgressCallback& progress) {
    return AnsysReader(path, progress).read();
}

}  // namespace simflex
