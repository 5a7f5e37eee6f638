#include "NastranDeck.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "BulkCards.h"
#include "IncludeLimit.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/DependencyOrder.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NameDistance.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

/** Largest relative difference of a shear modulus from E/2(1+ν). **/
constexpr double SameShear = 0.01;

/** CalculiX type and node order of a Nastran element. **/
struct BulkElement {
    const char* type;
    std::vector<size_t> order;  ///< grid of each node
    bool isShell;
};

/** Returns 0 … count−1. **/
std::vector<size_t> inOrder(size_t count) {
    std::vector<size_t> order(count);
    for (size_t k = 0; k < count; ++k) order[k] = k;
    return order;
}

/** By name and number of grids. **/
const std::map<std::pair<std::string, size_t>, BulkElement>& getBulkElements() {
    static const std::map<std::pair<std::string, size_t>, BulkElement> Elements = {
        {{"CTETRA", 4}, {"C3D4", inOrder(4), false}},
        {{"CTETRA", 10}, {"C3D10", inOrder(10), false}},
        {{"CPENTA", 6}, {"C3D6", inOrder(6), false}},
        {{"CPENTA", 15}, {"C3D15", {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11}, false}},
        {{"CHEXA", 8}, {"C3D8I", inOrder(8), false}},
        {{"CHEXA", 20},
         {"C3D20R", {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15}, false}},
        {{"CTRIA3", 3}, {"S3", inOrder(3), true}},
        {{"CTRIAR", 3}, {"S3", inOrder(3), true}},
        {{"CTRIA6", 6}, {"S6", inOrder(6), true}},
        {{"CQUAD4", 4}, {"S4", inOrder(4), true}},
        {{"CQUADR", 4}, {"S4", inOrder(4), true}},
        {{"CQUAD8", 8}, {"S8R", inOrder(8), true}}};
    return Elements;
}

/** Number of grid fields; shells have as many as the element has grids. **/
size_t getMostGrids(const std::string& name) {
    size_t most = 0;
    for (const auto& entry : getBulkElements())
        if (entry.first.first == name) most = std::max(most, entry.first.second);
    return most;
}

/** Ignored entries: supports, loads, output, control. **/
const std::set<std::string> LeftOutEntries = {
    "SPC",     "SPC1",    "SPCADD", "SPCD",    "LOAD",   "FORCE",  "FORCE1", "FORCE2", "MOMENT",
    "MOMENT1", "MOMENT2", "PLOAD",  "PLOAD1",  "PLOAD2", "PLOAD4", "GRAV",   "RFORCE", "TEMP",
    "TEMPD",   "TEMPP1",  "SUPORT", "SUPORT1", "EIGR",   "EIGRL",  "EIGB",   "EIGC",   "TABLED1",
    "TABDMP1", "DLOAD",   "RLOAD1", "RLOAD2",  "TLOAD1", "TLOAD2", "DAREA",  "DELAY",  "DPHASE",
    "FREQ",    "FREQ1",   "FREQ2",  "FREQ3",   "FREQ4",  "TSTEP",  "SET1",   "PLOTEL", "ASET",
    "ASET1",   "BSET",    "BSET1",  "CSET",    "CSET1",  "QSET",   "QSET1",  "OMIT",   "OMIT1",
    "USET",    "USET1",   "SPOINT", "MDLPRM",  "ENDDATA"};

constexpr const char* Beams =
    "CalculiX has beams by their shape alone: write it as a B32R of a deck "
    "with *BEAM SECTION, SECTION=RECT, CIRC, PIPE or BOX, or mesh it by "
    "solids or shells";

/** Refused entries and the remedy. **/
const std::map<std::string, const char*> RefusedEntries = {
    {"CPYRAM", "CalculiX has no pyramids; mesh with tetrahedra, wedges and hexahedra"},
    {"CBAR", Beams},
    {"CBEAM", Beams},
    {"CBEND", Beams},
    {"CTUBE", "write it as CROD with the area of its wall"},
    {"CBUSH", "put bushings and springs into the multibody model"},
    {"CELAS1", "put bushings and springs into the multibody model"},
    {"CELAS2", "put bushings and springs into the multibody model"},
    {"CELAS3", "put bushings and springs into the multibody model"},
    {"CELAS4", "put bushings and springs into the multibody model"},
    {"CDAMP1", "put dampers into the multibody model"},
    {"CDAMP2", "put dampers into the multibody model"},
    {"CVISC", "put dampers into the multibody model"},
    {"CGAP", "gaps are not linear"},
    {"CSHEAR", "shear panels are no shells; use CQUAD4"},
    {"CONM1", "give the mass by CONM2"},
    {"CMASS1", "give the mass by CONM2"},
    {"CMASS2", "give the mass by CONM2"},
    {"PLAMINATE", "give the layers by PCOMP"},
    {"MAT2", "give an orthotropic material of shells by MAT8, or layers by PCOMP"},
    {"MAT3", "it is of axisymmetric elements; give the material by MAT1"},
    {"MAT9", "give the material as a deck's *ELASTIC, TYPE=ANISO"},
    {"MATT1", "material constants cannot depend on temperature; give those at one temperature"},
    {"MPC", "write it as an *EQUATION of a deck, or as RBE2"},
    {"MPCADD", "write them as *EQUATION of a deck, or as RBE2"},
    {"RBE1", "write it as RBE2"},
    {"RROD", "write it as RBE2"},
    {"RSPLINE", "write it as RBE2 or RBE3"},
    {"DMIG", "it adds matrices to those of the elements; reduce the matrices (.pch)"},
    {"GENEL", "it adds a matrix to those of the elements"},
    {"PBAR", Beams},
    {"PBARL", Beams},
    {"PBEAM", Beams},
    {"PBEAML", Beams}};

struct CoordinateSystem {
    char kind;  ///< R, C or S
    Vec3d origin, e1, e2, e3;

    Vec3d toBasic(const Vec3d& x) const {
        const double degree = M_PI / 180;
        Vec3d local = x;
        if (kind == 'C')
            local = {x[0] * std::cos(x[1] * degree), x[0] * std::sin(x[1] * degree), x[2]};
        if (kind == 'S')
            local = {x[0] * std::sin(x[1] * degree) * std::cos(x[2] * degree),
                     x[0] * std::sin(x[1] * degree) * std::sin(x[2] * degree),
                     x[0] * std::cos(x[1] * degree)};
        return sumOf(sumOf(sumOf(origin, local[0], e1), local[1], e2), local[2], e3);
    }
};

/** An entry of a file or of those it includes. **/
struct BulkEntry {
    BulkCard card;
    std::string path;
};

class NastranReader {
public:
    NastranReader(const std::string& path, const ProgressCallback& progress)
        : m_progress(progress), m_path(path) {
        readFile(path, 0);
    }

    std::vector<DeckCard> read() {
        for (const BulkEntry& entry : m_entries) sort(entry);
        for (const BulkEntry& entry : m_entries)
            if (entry.card.name == "PARAM" && entry.card.field(0) == "WTMASS")
                m_massFactor = number(entry, 1, "WTMASS");
        writeNodes();
        writeElements();
        writeProperties();
        writeRods();
        writeRigidBodies();
        writeMasses();
        for (const auto& [name, leftOut] : m_leftOut)
            note("left out " + name + " (" + leftOut.first + ")" +
                 (leftOut.second > 1 ? ", " + std::to_string(leftOut.second) + " times" : ""));
        return std::move(m_result);
    }

private:
    using EntryMap = std::map<int, const BulkEntry*>;

    [[noreturn]] static void refuse(const BulkEntry& entry, const std::string& why) {
        throw std::invalid_argument(
            entry.path + ":" + std::to_string(entry.card.line) + ": " + entry.card.name +
            (entry.card.field(0).empty() ? "" : " " + quoteField(entry.card.field(0))) + ": " +
            why);
    }

    static double number(const BulkEntry& entry, size_t place, const char* what) {
        const std::string_view field = entry.card.field(place);
        double value = 0;
        if (!field.empty() && !readNumber(field, value) &&
            !readNumber(withExponentLetter(field), value))
            refuse(entry,
                   std::string(what) + " is " + quoteField(field) + "; it must be a finite number");
        return value;
    }

    static int integer(const BulkEntry& entry, size_t place, const char* what) {
        const std::string_view field = entry.card.field(place);
        int value = 0;
        if (!field.empty() && !readInteger(field, value))
            refuse(entry,
                   std::string(what) + " is " + quoteField(field) + "; it must be a whole number");
        return value;
    }

    static int positive(const BulkEntry& entry, size_t place, const char* what) {
        const int value = integer(entry, place, what);
        if (value < 1) refuse(entry, std::string(what) + " must be a number from 1 on");
        return value;
    }

    void readFile(const std::string& path, int depth) {
        const std::string mistake = m_includes.enter(depth);
        if (!mistake.empty()) throw std::invalid_argument(path + ": " + mistake);
        BulkCards cards(path, "bulk data file", {});
        long numRead = 0;
        for (BulkCard card; cards.next(card);) {
            if (++numRead % DeckLinesPerReport == 0)
                reportProgress(m_progress, ReadingDeck, ReadingCards * cards.lines().fraction());
            if (card.name == "ENDDATA") break;
            if (card.name == "INCLUDE") {
                std::string name;
                for (const std::string& field : card.fields) name += field;
                name.erase(std::remove_if(name.begin(), name.end(),
                                          [](char c) { return c == '\'' || c == '"'; }),
                           name.end());
                const auto beside = std::filesystem::path(path).parent_path() / name;
                if (!isInputFile(beside))
                    throw std::runtime_error(path + ":" + std::to_string(card.line) +
                                             ": cannot read '" + beside.string() + "'");
                readFile(beside.string(), depth + 1);
            } else if (card.name.compare(0, 5, "BEGIN") == 0) {
                m_entries.clear();  // drop everything before the bulk data
            } else {
                m_entries.push_back({std::move(card), path});
            }
        }
    }

    static void add(EntryMap& entries, const BulkEntry& entry) {
        const int id = positive(entry, 0, "its number");
        const auto [found, isNew] = entries.emplace(id, &entry);
        if (!isNew && found->second->card.fields != entry.card.fields)
            refuse(entry,
                   "is given twice, also in line " + std::to_string(found->second->card.line));
    }

    /** Dispatches an entry by its name. **/
    void sort(const BulkEntry& entry) {
        const std::string& name = entry.card.name;
        if (name == "GRID") {
            add(m_grids, entry);
        } else if (name == "GRDSET") {
            m_gridDefaults = &entry;
        } else if (name.compare(0, 4, "CORD") == 0 && name.size() == 6) {
            addSystem(entry);
        } else if (getMostGrids(name) > 0 || isRod(entry)) {
            add(m_elements, entry);
        } else if (name == "PSOLID" || name == "PROD" || isShellProperty(entry)) {
            add(m_properties, entry);
        } else if (name == "MAT1" || name == "MAT8") {
            add(m_materials, entry);
        } else if (name == "RBE2" || name == "RBAR" || name == "RBE3") {
            add(m_rigids, entry);
        } else if (name == "CONM2") {
            add(m_masses, entry);
        } else if (name == "PARAM" || LeftOutEntries.count(name)) {
            if (name == "PARAM" && entry.card.field(0) == "WTMASS") return;
            auto& leftOut = m_leftOut[name];
            if (leftOut.second++ == 0)
                leftOut.first = entry.path + ":" + std::to_string(entry.card.line);
        } else if (const auto refused = RefusedEntries.find(name);
                   refused != RefusedEntries.end()) {
            refuse(entry, std::string("cannot be part of a flexible body: ") + refused->second);
        } else {
            std::vector<std::string> known = {
                "GRID",   "GRDSET", "CORD2R", "PSOLID", "PSHELL", "PCOMP", "PCOMPG", "PROD", "CROD",
                "CONROD", "MAT1",   "MAT8",   "RBE2",   "RBE3",   "RBAR",  "CONM2",  "PARAM"};
            for (const auto& element : getBulkElements()) known.push_back(element.first.first);
            known.insert(known.end(), LeftOutEntries.begin(), LeftOutEntries.end());
            const std::string nearest = findNearestName(name, known);
            refuse(entry,
                   "is not known to simflex, so it cannot tell whether K and M stay those of its "
                   "elements" +
                       (nearest.empty() ? "; take it out of the bulk data"
                                        : "; did you mean " + nearest + "?"));
        }
    }

    /** CORD1x may define two systems. **/
    void addSystem(const BulkEntry& entry) {
        const std::string& name = entry.card.name;
        if ((name[4] != '1' && name[4] != '2') ||
            std::string("RCS").find(name[5]) == std::string::npos)
            refuse(entry,
                   "is none of the coordinate systems that simflex knows: CORD1R, CORD1C, "
                   "CORD1S, CORD2R, CORD2C, CORD2S");
        for (size_t first = 0; first < (name[4] == '1' ? 8 : 1); first += 4) {
            if (first > 0 && entry.card.field(first).empty()) break;
            m_systemEntries[positive(entry, first, "its number")] = {&entry, first};
        }
    }

    /** Coordinate system 0 is the basic one. **/
    Vec3d toBasic(const BulkEntry& entry, int system, const Vec3d& x) {
        if (system <= 0) return x;
        if (!m_systems.count(system)) {
            needSystem(entry, system);
            finishInOrder(
                system, [&](int number) { return findOpenSystem(number); },
                [&](int number) { m_systems.emplace(number, makeSystem(number)); },
                [&](const std::vector<int>& circle) {
                    const int first = circle.front();
                    refuse(*m_systemEntries.at(first).first,
                           "coordinate system " + std::to_string(first) + " goes back to itself");
                });
        }
        return m_systems.at(system).toBasic(x);
    }

    void needSystem(const BulkEntry& asker, int system) const {
        if (!m_systemEntries.count(system))
            refuse(asker, "names coordinate system " + std::to_string(system) +
                              ", which the bulk data do not have");
    }

    /** Returns a system that another one is defined in and that has not been made yet. **/
    std::optional<int> findOpenSystem(int number) const {
        const auto& [of, first] = m_systemEntries.at(number);
        const auto isOpen = [&, of = of](const BulkEntry& asker, int system) {
            if (system <= 0 || m_systems.count(system)) return false;
            needSystem(asker, system);
            return true;
        };
        if (of->card.name[4] != '1') {
            const int system = integer(*of, 1, "RID");
            return isOpen(*of, system) ? std::optional<int>(system) : std::nullopt;
        }
        for (size_t k = 0; k < 3; ++k) {
            const BulkEntry& grid = getGrid(*of, positive(*of, first + 1 + k, "a grid"));
            const int system = systemOf(grid, 1);
            if (isOpen(grid, system)) return system;
        }
        return {};
    }

    CoordinateSystem makeSystem(int system) {
        const auto& [of, first] = m_systemEntries.at(system);
        std::array<Vec3d, 3> p;
        for (size_t k = 0; k < 3; ++k) {
            if (of->card.name[4] == '1') {
                p[k] = positionOf(*of, positive(*of, first + 1 + k, "a grid"));
                continue;
            }
            Vec3d at{};
            for (size_t a = 0; a < 3; ++a) at[a] = number(*of, 2 + 3 * k + a, "a coordinate");
            p[k] = toBasic(*of, integer(*of, 1, "RID"), at);
        }
        CoordinateSystem made{of->card.name[5], p[0], {}, {}, minus(p[1], p[0])};
        const Vec3d inPlane = minus(p[2], p[0]);
        const Vec3d side = cross(made.e3, inPlane);
        if (!(normOf(side) > 0)) refuse(*of, "its three points lie on one line");
        made.e3 = scaled(made.e3, 1 / normOf(made.e3));
        made.e2 = scaled(side, 1 / normOf(side));
        made.e1 = cross(made.e2, made.e3);
        return made;
    }

    /** Returns the position system of a grid, or its displacement system (field 5). **/
    int systemOf(const BulkEntry& grid, size_t place) const {
        if (!grid.card.field(place).empty()) return integer(grid, place, place == 1 ? "CP" : "CD");
        return m_gridDefaults ? integer(*m_gridDefaults, place, "a system of GRDSET") : 0;
    }

    const BulkEntry& getGrid(const BulkEntry& asker, int number_) const {
        const auto grid = m_grids.find(number_);
        if (grid == m_grids.end())
            refuse(asker,
                   "names grid " + std::to_string(number_) + ", which the bulk data do not have");
        return *grid->second;
    }

    Vec3d positionOf(const BulkEntry& asker, int number_) {
        const BulkEntry& grid = getGrid(asker, number_);
        Vec3d x{};
        for (size_t a = 0; a < 3; ++a) x[a] = number(grid, 2 + a, "a coordinate");
        return toBasic(grid, systemOf(grid, 1), x);
    }

    DeckCard& addCard(const BulkEntry* of, const std::string& title,
                      std::map<std::string, std::string> parameters) {
        DeckCard card;
        card.setTitle(title);
        card.parameters = std::move(parameters);
        card.file = of ? of->path : m_path;
        card.line = of ? of->card.line : 1;
        m_result.push_back(std::move(card));
        return m_result.back();
    }

    static void addLine(DeckCard& card, std::vector<std::string> fields,
                        const BulkEntry* of = nullptr) {
        DeckLine line;
        line.line = of ? of->card.line : card.line;
        line.fields = std::move(fields);
        card.data.push_back(std::move(line));
    }

    void note(const std::string& text) { m_result.push_back(makeNoteCard(text)); }

    void writeNodes() {
        DeckCard& card = addCard(nullptr, "*NODE", {});
        for (const auto& [id, grid] : m_grids) {
            const Vec3d x = positionOf(*grid, id);
            addLine(
                card,
                {std::to_string(id), writeGeneral(x[0]), writeGeneral(x[1]), writeGeneral(x[2])},
                grid);
        }
        m_nextNode = m_grids.empty() ? 1 : m_grids.rbegin()->first + 1;
    }

    static std::string setOf(int property, double offset) {
        return "P" + std::to_string(property) +
               (offset == 0 ? "" : "_ZOFFS_" + writeGeneral(offset, 6));
    }

    void writeElements() {
        std::map<std::pair<std::string, std::string>, std::vector<const BulkEntry*>> blocks;
        std::map<const BulkEntry*, std::pair<const BulkElement*, std::vector<int>>> elementOf;
        for (const auto& [id, entry] : m_elements) {
            if (isRod(*entry)) continue;
            const std::string& name = entry->card.name;
            size_t count = getMostGrids(name);
            std::vector<int> grids;
            for (size_t k = 0; k < count; ++k) grids.push_back(integer(*entry, 2 + k, "a grid"));
            while (!grids.empty() && grids.back() == 0) grids.pop_back();
            m_elementGrids.insert(grids.begin(), grids.end());
            const auto element = getBulkElements().find({name, grids.size()});
            if (element == getBulkElements().end() || std::count(grids.begin(), grids.end(), 0) > 0)
                refuse(*entry,
                       "has " +
                           std::to_string(grids.size() -
                                          size_t(std::count(grids.begin(), grids.end(), 0))) +
                           " grids; CalculiX has elements with all or none of the grids in "
                           "the middle of edges");
            const int property =
                entry->card.field(1).empty() ? id : positive(*entry, 1, "its property");
            const bool isShell = element->second.isShell;
            const double offset = isShell ? readShell(*entry, grids) : 0;
            const auto found = m_properties.find(property);
            if (found == m_properties.end())
                refuse(*entry, "names property " + std::to_string(property) +
                                   ", which the bulk data do not have");
            const std::string& kind = found->second->card.name;
            if (isShell ? !isShellProperty(*found->second) : kind != "PSOLID")
                refuse(*entry, "does not fit its property, a " + kind);
            m_sets[{property, offset}] = setOf(property, offset);
            if (isShell && hasDirections(*found->second))
                m_directions[setOf(property, offset)].emplace_back(id,
                                                                   readMaterialAxes(*entry, grids));
            blocks[{element->second.type, setOf(property, offset)}].push_back(entry);
            elementOf[entry] = {&element->second, std::move(grids)};
        }
        for (const auto& [block, entries] : blocks) {
            DeckCard& card =
                addCard(entries[0], "*ELEMENT", {{"TYPE", block.first}, {"ELSET", block.second}});
            for (const BulkEntry* entry : entries) {
                const auto& [element, grids] = elementOf.at(entry);
                std::vector<std::string> fields = {std::string(entry->card.field(0))};
                for (const size_t k : element->order) fields.push_back(std::to_string(grids[k]));
                addLine(card, std::move(fields), entry);
            }
        }
        m_nextElement = m_elements.empty() ? 1 : m_elements.rbegin()->first + 1;
    }

    static bool isRod(const BulkEntry& entry) {
        return entry.card.name == "CROD" || entry.card.name == "CONROD";
    }

    /** Writes trusses: CROD with its PROD, and the self-contained CONROD. **/
    void writeRods() {
        std::set<std::string> written;
        for (const auto& [id, entry] : m_elements) {
            if (!isRod(*entry)) continue;
            const bool isOwn = entry->card.name == "CONROD";
            const BulkEntry* section = entry;
            std::string set = "CONROD_" + std::to_string(id), material = set;
            if (!isOwn) {
                const int property =
                    entry->card.field(1).empty() ? id : positive(*entry, 1, "its property");
                const auto found = m_properties.find(property);
                if (found == m_properties.end() || found->second->card.name != "PROD")
                    refuse(*entry, "names property " + std::to_string(property) +
                                       ", which the bulk data do not have as PROD");
                section = found->second;
                set = setOf(property, 0);
                material = "PID_" + std::to_string(property);
            }
            std::vector<std::string> fields = {std::to_string(id)};
            for (size_t k = 0; k < 2; ++k) {
                const int grid = positive(*entry, (isOwn ? 1 : 2) + k, "a grid");
                m_elementGrids.insert(grid);
                fields.push_back(std::to_string(grid));
            }
            addLine(addCard(entry, "*ELEMENT", {{"TYPE", "T3D2"}, {"ELSET", set}}), fields);
            addCard(entry, "*NSET", {{"NSET", material}, {"ELSET", set}});
            if (!written.insert(set).second) continue;
            const size_t first = isOwn ? 3 : 1;  // of MID, A, J, C, NSM
            const double area = number(*section, first + 1, "A");
            if (!(area > 0)) refuse(*section, "the area A must be positive");
            if (number(*section, first + 2, "J") != 0)
                note(section->path + ":" + std::to_string(section->card.line) +
                     ": left out J of rods, which resist along themselves alone");
            Material constants = readMaterial(*section, positive(*section, first, "its material"));
            constants.rho += m_massFactor * number(*section, first + 4, "NSM") / area;
            writeMaterial(*section, material, constants);
            addLine(addCard(section, "*SOLID SECTION", {{"ELSET", set}, {"MATERIAL", material}}),
                    {writeGeneral(area)});
        }
    }

    /** Reads the optional fields of a shell. @returns its offset [m] **/
    double readShell(const BulkEntry& entry, const std::vector<int>& grids) {
        // EID, PID, grids, THETA, ZOFFS, …; with eight grids THETA and ZOFFS come last.
        constexpr size_t FirstThickness = 10;
        const size_t corners = grids.size() % 3 == 0 ? 3 : 4,
                     offset = grids.size() == 8 ? 15 : 3 + grids.size();
        for (const int grid : grids) m_shellGrids.insert(grid);
        for (size_t k = 0; k < corners; ++k)
            if (!entry.card.field(FirstThickness + k).empty())
                refuse(entry,
                       "has thicknesses of its own at its corners, which simflex does not support; "
                       "give them by its property");
        return number(entry, offset, "ZOFFS");
    }

    static bool isShellProperty(const BulkEntry& entry) {
        const std::string& name = entry.card.name;
        return name == "PSHELL" || name == "PCOMP" || name == "PCOMPG";
    }

    /** A layer of a shell; PSHELL has a single one. **/
    struct Ply {
        int material = 0;
        double thickness = 0, angle = 0;  ///< [m], [°] from the material axes of the element
    };

    /** Reads the layers, from below. **/
    std::vector<Ply> readPlies(const BulkEntry& entry) const {
        if (entry.card.name == "PSHELL")
            return {{positive(entry, 1, "its material"), number(entry, 2, "T"), 0}};
        // PID, Z0, NSM, SB, FT, TREF, GE, LAM, then MID, T, THETA, SOUT of each layer. PCOMPG has a
        // separate line for each layer, which begins with a number.
        const bool isGlobal = entry.card.name == "PCOMPG";
        const size_t step = isGlobal ? 8 : 4, first = isGlobal ? 9 : 8;
        std::vector<Ply> plies;
        for (size_t at = first; at < entry.card.fields.size(); at += step) {
            const auto isGiven = [&](size_t k) { return !entry.card.field(at + k).empty(); };
            if (!isGiven(0) && !isGiven(1) && !isGiven(2) && !isGiven(3)) continue;
            if (plies.empty() && !(isGiven(0) && isGiven(1)))
                refuse(entry, "its first layer needs a material MID and a thickness T");
            Ply ply;
            ply.material = isGiven(0) ? positive(entry, at, "MID") : plies.back().material;
            ply.thickness = isGiven(1) ? number(entry, at + 1, "T") : plies.back().thickness;
            ply.angle = number(entry, at + 2, "THETA");
            if (!(ply.thickness > 0))
                refuse(entry, "a layer has thickness " + writeGeneral(ply.thickness, 6) +
                                  "; it must be positive");
            plies.push_back(ply);
        }
        if (plies.empty()) refuse(entry, "has no layers");
        const std::string_view lam = entry.card.field(7);
        if (lam == "SYM" && !isGlobal)
            for (size_t k = plies.size(); k-- > 0;) plies.push_back(Ply(plies[k]));
        else if (!lam.empty())
            refuse(entry, "LAM is " + quoteField(lam) + "; simflex knows " +
                              (isGlobal ? "none" : "SYM, or none") +
                              ": write out the layers, each with its material");
        return plies;
    }

    /** Returns whether the property depends on directions in the shell. **/
    bool hasDirections(const BulkEntry& property) const {
        for (const Ply& ply : readPlies(property)) {
            const auto found = m_materials.find(ply.material);
            if (found != m_materials.end() && found->second->card.name == "MAT8") return true;
        }
        return false;
    }

    /** Returns a vector whose component in the shell is the first material axis, and a second one:
    THETA degrees from the side from the first grid to the second, or x of the system MCID. **/
    std::array<Vec3d, 2> readMaterialAxes(const BulkEntry& entry, const std::vector<int>& grids) {
        const size_t place = grids.size() == 8 ? 14 : 2 + grids.size();
        const std::string_view field = entry.card.field(place);
        int system = 0;
        if (!field.empty() && readInteger(field, system)) {
            if (system < 0) refuse(entry, "MCID must not be negative");
            std::array<Vec3d, 2> axes{{{1, 0, 0}, {0, 1, 0}}};
            const Vec3d origin = toBasic(entry, system, {0, 0, 0});
            for (Vec3d& axis : axes) axis = minus(toBasic(entry, system, axis), origin);
            if (system > 0 && m_systems.at(system).kind != 'R')
                refuse(entry, "its MCID " + std::to_string(system) +
                                  " is a system whose axes turn; give it a rectangular one, or "
                                  "THETA");
            return axes;
        }
        const double theta = number(entry, place, "THETA") * M_PI / 180;
        std::array<Vec3d, 4> x{};
        const size_t corners = grids.size() % 3 == 0 ? 3 : 4;
        for (size_t k = 0; k < corners; ++k) x[k] = positionOf(entry, grids[k]);
        Vec3d n = corners == 3 ? cross(minus(x[1], x[0]), minus(x[2], x[0]))
                               : cross(minus(x[2], x[0]), minus(x[3], x[1]));
        if (!(normOf(n) > 0)) refuse(entry, "has no area");
        n = scaled(n, 1 / normOf(n));
        Vec3d side = minus(x[1], x[0]);
        side = sumOf(side, -dot(side, n), n);
        if (!(normOf(side) > 0)) refuse(entry, "its first two grids are at one place");
        side = scaled(side, 1 / normOf(side));
        const Vec3d across = cross(n, side);
        const double c = std::cos(theta), s = std::sin(theta);
        return {sumOf(scaled(side, c), s, across), sumOf(scaled(across, c), -s, side)};
    }

    struct Material {
        double E = 0, nu = 0, rho = 0;
        std::vector<double> engineering;  ///< constants of an orthotropic material, as in *ELASTIC
    };

    /** For shells only: without Poisson's effect in the thickness direction, so the other constants
    are irrelevant. **/
    Material readOrthotropicMaterial(const BulkEntry& entry) {
        const double E1 = number(entry, 1, "E1"), E2 = number(entry, 2, "E2"),
                     nu12 = number(entry, 3, "NU12"), G12 = number(entry, 4, "G12");
        double G13 = number(entry, 5, "G1Z"), G23 = number(entry, 6, "G2Z");
        for (const auto& [value, name] :
             {std::pair(E1, "E1"), std::pair(E2, "E2"), std::pair(G12, "G12")})
            if (!(value > 0)) refuse(entry, std::string(name) + " must be positive");
        if ((G13 == 0 || G23 == 0) && m_noted.insert(&entry).second)
            note(
                entry.path + ":" + std::to_string(entry.card.line) + ": MAT8 " +
                std::string(entry.card.field(0)) +
                " has no G1Z or no G2Z, which is no flexibility in transverse shear; G12 is taken");
        if (G13 == 0) G13 = G12;
        if (G23 == 0) G23 = G12;
        Material material;
        material.engineering = {E1, E2, E2, nu12, 0, 0, G12, G13, G23};
        material.rho = m_massFactor * number(entry, 7, "RHO");
        if (!(material.rho > 0))
            refuse(entry, "has no density RHO, so that its elements have no mass");
        return material;
    }

    Material readShellMaterial(const BulkEntry& asker, int id) {
        const auto found = m_materials.find(id);
        return found != m_materials.end() && found->second->card.name == "MAT8"
                   ? readOrthotropicMaterial(*found->second)
                   : readMaterial(asker, id);
    }

    Material readMaterial(const BulkEntry& asker, int id) {
        const auto found = m_materials.find(id);
        if (found == m_materials.end())
            refuse(asker, "names material " + std::to_string(id) +
                              ", which the bulk data do not have as MAT1");
        const BulkEntry& entry = *found->second;
        if (entry.card.name != "MAT1")
            refuse(asker, "names material " + std::to_string(id) + ", a " + entry.card.name +
                              ", which shells alone can have; give it by MAT1");
        Material material;
        material.E = number(entry, 1, "E");
        material.nu = number(entry, 3, "NU");
        material.rho = m_massFactor * number(entry, 4, "RHO");
        const double G = number(entry, 2, "G");
        const bool hasE = !entry.card.field(1).empty(), hasG = !entry.card.field(2).empty(),
                   hasNu = !entry.card.field(3).empty();
        if (hasE + hasG + hasNu < 2 && !(hasE && material.E > 0))
            refuse(entry, "needs two of E, G and NU");
        if (hasE && hasG && !hasNu) material.nu = material.E / (2 * G) - 1;
        if (!hasE) material.E = 2 * G * (1 + material.nu);
        const double shear = material.E / (2 * (1 + material.nu));
        if (hasE && hasG && hasNu && std::abs(G - shear) > SameShear * shear)
            refuse(entry, "has G = " + writeGeneral(G, 6) + ", but E/2(1+NU) = " +
                              writeGeneral(shear, 6) + "; leave one of them out");
        if (entry.card.field(4).empty() || !(material.rho > 0))
            refuse(entry, "has no density RHO, so that its elements have no mass");
        return material;
    }

    void writeMaterial(const BulkEntry& of, const std::string& name, const Material& material) {
        addCard(&of, "*MATERIAL", {{"NAME", name}});
        if (material.engineering.empty()) {
            addLine(addCard(&of, "*ELASTIC", {}),
                    {writeFortran(material.E, 13), writeFortran(material.nu, 13)});
        } else {
            DeckCard& card = addCard(&of, "*ELASTIC", {{"TYPE", "ENGINEERING CONSTANTS"}});
            constexpr size_t OfLine = 8;
            std::vector<std::string> fields;
            for (const double value : material.engineering) {
                fields.push_back(writeFortran(value, 13));
                if (fields.size() == OfLine) addLine(card, std::exchange(fields, {}));
            }
            addLine(card, fields);
        }
        addLine(addCard(&of, "*DENSITY", {}), {writeFortran(material.rho, 13)});
    }

    void writeProperties() {
        std::set<int> written;
        for (const auto& [place, set] : m_sets) {
            const auto& [id, offset] = place;
            const BulkEntry& entry = *m_properties.at(id);
            const std::string name = "PID_" + std::to_string(id);
            const bool isNew = written.insert(id).second;
            if (isShellProperty(entry)) {
                writeShellSection(entry, name, set, offset, isNew);
            } else {
                checkSolidProperty(entry);
                if (isNew)
                    writeMaterial(entry, name,
                                  readMaterial(entry, positive(entry, 1, "its material")));
                addCard(&entry, "*SOLID SECTION", {{"ELSET", set}, {"MATERIAL", name}});
            }
            addCard(&entry, "*NSET", {{"NSET", name}, {"ELSET", set}});
        }
    }

    /** Writes the section of the elements in `set`. The material of a PSHELL is named after the
    property, those of layers PID_7_MID_3.
    @param offset  ZOFFS of the elements **/
    void writeShellSection(const BulkEntry& entry, const std::string& name, const std::string& set,
                           double offset, bool isNew) {
        const std::vector<Ply> plies = readPlies(entry);
        const bool isPlain = entry.card.name == "PSHELL", isLayered = plies.size() > 1;
        double thickness = 0;
        for (const Ply& ply : plies) thickness += ply.thickness;
        if (isPlain) {
            checkShellProperty(entry, thickness);
        } else if (!entry.card.field(1).empty()) {
            offset += number(entry, 1, "Z0") + thickness / 2;
        }
        const double massOfArea = m_massFactor * number(entry, isPlain ? 7 : 2, "NSM");
        const auto nameOf = [&](int material) {
            return isPlain ? name : name + "_MID_" + std::to_string(material);
        };
        std::set<int> materials;
        for (const Ply& ply : plies) {
            if (!isNew || !materials.insert(ply.material).second) continue;
            Material constants = readShellMaterial(entry, ply.material);
            if (isPlain) takeShear(entry, constants);
            constants.rho += massOfArea / thickness;
            writeMaterial(entry, nameOf(ply.material), constants);
        }
        std::map<std::string, std::string> parameters = {{"ELSET", set}};
        if (const auto axes = m_directions.find(set); axes != m_directions.end()) {
            parameters["ORIENTATION"] = "AXES_OF_" + set;
            writeDirections(entry, parameters["ORIENTATION"], axes->second);
        }
        if (offset != 0) parameters["OFFSET"] = writeGeneral(-offset / thickness);
        const bool isTurned = plies[0].angle != 0;
        if (isLayered || isTurned)
            parameters["COMPOSITE"] = "";
        else
            parameters["MATERIAL"] = nameOf(plies[0].material);
        DeckCard& section = addCard(&entry, "*SHELL SECTION", parameters);
        section.title = entry.card.name + " " + std::string(entry.card.field(0));
        for (const Ply& ply : plies) {
            addLine(section, {writeGeneral(ply.thickness)});
            if (isLayered || isTurned) {
                std::vector<std::string>& fields = section.data.back().fields;
                fields.insert(fields.end(), {"", nameOf(ply.material), writeGeneral(ply.angle)});
            }
        }
    }

    /** Writes the axes of each element. **/
    void writeDirections(const BulkEntry& entry, const std::string& name,
                         const std::vector<std::pair<int, std::array<Vec3d, 2>>>& axesOf) {
        DeckCard& card =
            addCard(&entry, "*DISTRIBUTION", {{"NAME", name}, {"LOCATION", "ELEMENT"}});
        for (const auto& [element, axes] : axesOf) {
            addLine(card, {std::to_string(element)});
            for (const Vec3d& axis : axes)
                for (const double x : axis) card.data.back().fields.push_back(writeGeneral(x));
        }
        addLine(addCard(&entry, "*ORIENTATION", {{"NAME", name}}), {name});
    }

    /** Transverse shear of a PSHELL by MID3 and TS/T, where a shell of MID1 has 5/6 of T. **/
    void takeShear(const BulkEntry& entry, Material& material) {
        if (entry.card.field(5).empty()) return;
        constexpr double Usual = 5.0 / 6, Digits = 1e-3;
        double share = number(entry, 6, "TS/T") / Usual;
        if (entry.card.field(6).empty() || std::abs(share - 1) < Digits) share = 1;
        if (!(share > 0)) refuse(entry, "TS/T must be positive");
        const int id = positive(entry, 5, "MID3");
        const bool isOther = entry.card.field(5) != entry.card.field(1);
        if (!isOther && share == 1) return;
        const auto shearOf = [](const Material& of) {
            const double G = of.E / (2 * (1 + of.nu));
            return of.engineering.empty()
                       ? std::array<double, 2>{G, G}
                       : std::array<double, 2>{of.engineering[7], of.engineering[8]};
        };
        const auto G = shearOf(isOther ? readShellMaterial(entry, id) : material);
        if (material.engineering.empty()) {
            const double E = material.E, nu = material.nu;
            material.engineering = {E, E, E, nu, 0, 0, E / (2 * (1 + nu)), 0, 0};
        }
        for (const size_t k : {0, 1}) material.engineering[7 + k] = share * G[k];
    }

    static void checkSolidProperty(const BulkEntry& entry) {
        const std::string_view use = entry.card.field(6);
        if (!use.empty() && use != "SMECH")
            refuse(entry, "FCTN is " + quoteField(use) + "; it must be SMECH: a solid");
    }

    static void checkShellProperty(const BulkEntry& entry, double thickness) {
        if (!(thickness > 0)) refuse(entry, "the thickness T must be positive");
        if (entry.card.field(3).empty())
            refuse(entry, "has no material MID2 for bending: membranes are hinged at their grids");
        if (entry.card.field(3) != entry.card.field(1))
            refuse(entry,
                   "has a material MID2 for bending other than MID1, which simflex does not "
                   "support; give the layers by PCOMP");
        if (!entry.card.field(4).empty() && number(entry, 4, "12I/T**3") != 1)
            refuse(entry, "12I/T**3 is other than 1, which no solid has");
        if (!entry.card.field(10).empty())
            refuse(entry, "has a material MID4, which simflex does not support");
    }

    /** Degree-of-freedom components as a set of digits. **/
    static bool hasTranslations(std::string_view components) {
        return components.find('1') != std::string_view::npos &&
               components.find('2') != std::string_view::npos &&
               components.find('3') != std::string_view::npos;
    }

    void writeRigidBodies() {
        std::map<int, const BulkEntry*> references;
        for (const auto& [id, entry] : m_rigids)
            if (entry->card.name != "RBE3")
                references.emplace(positive(*entry, 1, "its independent grid"), entry);
        std::map<int, int> turnOf;
        for (const auto& [id, entry] : m_rigids) {
            const BulkCard& card = entry->card;
            if (card.name == "RBE3") {
                note(entry->path + ":" + std::to_string(card.line) + ": RBE3 " +
                     std::to_string(id) + " stiffens nothing; loads on its grid are left out");
                const int average = positive(*entry, 2, "REFGRID");
                if (m_elementGrids.count(average) || references.count(average))
                    refuse(*entry, "something else uses its grid " + std::to_string(average) +
                                       ": simflex does not hang grids on the mean of others; make "
                                       "them a distributing interface instead");
                m_averaged.emplace(average, entry);
                continue;
            }
            const int reference = positive(*entry, 1, "its independent grid");
            std::vector<int> dependent;
            std::string components = "123456";
            if (card.name == "RBAR") {
                dependent.push_back(positive(*entry, 2, "GB"));
                if (card.field(3) != "123456" || !card.field(4).empty())
                    refuse(*entry, "CNA must be 123456 and CNB empty; else write it as RBE2");
                if (!card.field(6).empty()) components = std::string(card.field(6));
            } else {
                components = std::string(card.field(2));
                for (size_t k = 3; k < card.fields.size(); ++k) {
                    if (card.field(k).empty()) continue;
                    double thermal = 0;
                    if (card.field(k).find('.') != std::string_view::npos &&
                        readNumber(withExponentLetter(card.field(k)), thermal))
                        continue;  // ALPHA
                    if (upperCase(card.field(k)) == "THRU")
                        refuse(*entry, "THRU in it is not known to simflex; list its grids");
                    dependent.push_back(positive(*entry, k, "a dependent grid"));
                }
            }
            if (!hasTranslations(components))
                refuse(*entry, "ties components " + components +
                                   "; simflex ties all translations, 123 or 123456");
            const bool isPinned = components.size() < 6;
            for (const int grid : dependent) {
                positionOf(*entry, grid);
                const auto other = references.find(grid);
                if (other != references.end() && other->second != entry)
                    refuse(*entry, "its grid " + std::to_string(grid) +
                                       " is the independent one of " + other->second->card.name +
                                       " " + std::string(other->second->card.field(0)) +
                                       "; write both as one");
                if (isPinned && m_shellGrids.count(grid))
                    refuse(*entry, "leaves the rotation of grid " + std::to_string(grid) +
                                       " of a shell free, which simflex does not support");
            }
            if (dependent.empty()) refuse(*entry, "has no dependent grids");
            const std::string set = card.name + "_" + std::to_string(id);
            DeckCard& nodes = addCard(entry, "*NSET", {{"NSET", set}});
            for (const int grid : dependent) addLine(nodes, {std::to_string(grid)});
            const Vec3d x = positionOf(*entry, reference);
            // Grids tied for other reasons are not part of the interface that the set represents.
            std::string tied = set;
            const bool isShell = m_shellGrids.count(reference) > 0;
            if (isShell || hangsMass(reference) ||
                std::any_of(dependent.begin(), dependent.end(),
                            [&](int grid) { return hangsMass(grid); })) {
                tied += "_AND_GN";
                DeckCard& all = addCard(entry, "*NSET", {{"NSET", tied}});
                for (const int grid : dependent) addLine(all, {std::to_string(grid)});
                if (isShell) addLine(all, {std::to_string(reference)});
            }
            m_rigidSets.emplace(reference, tied);
            for (const int grid : dependent) m_rigidSets.emplace(grid, tied);
            const auto [turn, isNew] = turnOf.emplace(reference, m_nextNode);
            if (isNew)
                addLine(addCard(entry, "*NODE", {}),
                        {std::to_string(m_nextNode++), writeGeneral(x[0]), writeGeneral(x[1]),
                         writeGeneral(x[2])});
            addCard(entry, "*RIGID BODY",
                    {{"NSET", tied},
                     {"REFNODE", std::to_string(reference)},
                     {"ROTNODE", std::to_string(turn->second)}})
                .title = card.name + " " + std::to_string(id);
        }
    }

    void writeMasses() {
        for (const auto& [id, entry] : m_masses) {
            const int grid = positive(*entry, 1, "its grid");
            const double mass = m_massFactor * number(*entry, 3, "M");
            positionOf(*entry, grid);
            const auto averaged = m_averaged.find(grid);
            if (averaged != m_averaged.end())
                refuse(*entry, "hangs on RBE3 " + std::string(averaged->second->card.field(0)) +
                                   ", which simflex does not support; use RBE2, or a distributing "
                                   "interface and a body welded to it");
            const std::string set = "CONM2_" + std::to_string(id);
            int node = grid;
            const bool isSpread = hasOffsetOrInertia(*entry);
            if (isSpread) node = hangMass(*entry, grid);
            if (mass != 0 || !isSpread) {
                addLine(addCard(entry, "*ELEMENT", {{"TYPE", "MASS"}, {"ELSET", set}}),
                        {std::to_string(m_nextElement++), std::to_string(node)});
                addLine(addCard(entry, "*MASS", {{"ELSET", set}}), {writeGeneral(mass)});
            }
            if (isSpread) writeInertia(*entry, node, set + "_I");
        }
    }

    bool hasOffsetOrInertia(const BulkEntry& entry) const {
        for (size_t place = 4; place < 14; ++place)
            if (place != 7 && number(entry, place, "an offset or inertia") != 0) return true;
        return false;
    }

    /** Returns whether an offset mass at this grid follows its rigid body. **/
    bool hangsMass(int grid) const {
        return std::any_of(m_masses.begin(), m_masses.end(), [&](const auto& mass) {
            return positive(*mass.second, 1, "its grid") == grid &&
                   hasOffsetOrInertia(*mass.second);
        });
    }

    /** Adds a node at the offset of a mass, which follows the rigid body of its grid. **/
    int hangMass(const BulkEntry& entry, int grid) {
        const auto rigid = m_rigidSets.find(grid);
        if (rigid == m_rigidSets.end())
            refuse(entry, "has an offset or inertia, but its grid " + std::to_string(grid) +
                              " has no rotation; tie it to the part by RBE2, or weld a rigid body "
                              "to an interface");
        const int system = integer(entry, 2, "CID");
        Vec3d x{};
        for (size_t a = 0; a < 3; ++a) x[a] = number(entry, 4 + a, "an offset");
        const Vec3d at = positionOf(entry, grid);
        if (system < 0) {
            x = minus(x, at);  // position of the centre of mass itself
        } else if (system > 0) {
            x = minus(toBasic(entry, system, x), toBasic(entry, system, {0, 0, 0}));
        }
        const int node = m_nextNode++;
        addLine(addCard(&entry, "*NODE", {}),
                {std::to_string(node), writeGeneral(at[0] + x[0]), writeGeneral(at[1] + x[1]),
                 writeGeneral(at[2] + x[2])});
        addLine(addCard(&entry, "*NSET", {{"NSET", rigid->second}}), {std::to_string(node)});
        return node;
    }

    void writeInertia(const BulkEntry& entry, int node, const std::string& set) {
        // I11, I21, I22, I31, I32, I33, in Nastran with products ∫ x y.
        constexpr int Places[6][2] = {{0, 0}, {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}};
        double J[3][3] = {};
        bool isThere = false;
        for (size_t k = 0; k < 6; ++k) {
            const auto& [i, j] = Places[k];
            const double value = m_massFactor * number(entry, 8 + k, "an inertia");
            isThere |= value != 0;
            J[i][j] = J[j][i] = i == j ? value : -value;
        }
        if (!isThere) return;
        const int system = std::max(0, integer(entry, 2, "CID"));
        std::array<Vec3d, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        for (Vec3d& axis : axes)
            axis = minus(toBasic(entry, system, axis), toBasic(entry, system, {0, 0, 0}));
        if (system > 0 && m_systems.at(system).kind != 'R')
            refuse(entry, "has an inertia in axes that turn; give it a rectangular system");
        double turned[3][3] = {};
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b)
                for (size_t i = 0; i < 3; ++i)
                    for (size_t j = 0; j < 3; ++j)
                        turned[a][b] += axes[i][a] * J[i][j] * axes[j][b];
        addLine(addCard(&entry, "*ELEMENT", {{"TYPE", "ROTARYI"}, {"ELSET", set}}),
                {std::to_string(m_nextElement++), std::to_string(node)});
        addLine(
            addCard(&entry, "*ROTARY INERTIA", {{"ELSET", set}}),
            {writeGeneral(turned[0][0]), writeGeneral(turned[1][1]), writeGeneral(turned[2][2]),
             writeGeneral(turned[0][1]), writeGeneral(turned[0][2]), writeGeneral(turned[1][2])});
    }

    const ProgressCallback& m_progress;
    std::string m_path;
    std::vector<BulkEntry> m_entries;
    IncludeLimit m_includes;
    EntryMap m_grids, m_elements, m_properties, m_materials, m_rigids, m_masses;
    const BulkEntry* m_gridDefaults = nullptr;
    std::map<int, std::pair<const BulkEntry*, size_t>> m_systemEntries;
    std::map<int, CoordinateSystem> m_systems;
    std::map<std::pair<int, double>, std::string> m_sets;  ///< by property and offset
    std::set<int> m_elementGrids, m_shellGrids;
    /** Axes of the elements in each set. **/
    std::map<std::string, std::vector<std::pair<int, std::array<Vec3d, 2>>>> m_directions;
    std::set<const BulkEntry*> m_noted;
    std::map<int, const BulkEntry*> m_averaged;
    std::map<int, std::string> m_rigidSets;  ///< by the grids of RBE2 and RBAR
    std::map<std::string, std::pair<std::string, int>> m_leftOut;
    double m_massFactor = 1;
    int m_nextNode = 1, m_nextElement = 1;
    std::vector<DeckCard> m_result;
};

}  // namespace

std::vector<DeckCard> readNastranCards(const std::string& path, const ProgressCallback& progress) {
    return NastranReader(path, progress).read();
}

}  // namespace simflex
