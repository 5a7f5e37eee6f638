#pragma once
/** @file
Decks of shells, beams and solids for tests, written node by node. **/

#include <array>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace simflex {
namespace testing {

/** Patches of shells, chains of beams and boxes of solids; coincident nodes are merged. Materials
METAL (70 GPa, 2700 kg/m³) and HEAVY (200 GPa, 7800 kg/m³); node set ALL. **/
class ThinDeck {
public:
    using Point = std::array<double, 3>;

    double nu = 0.3;  ///< of METAL

    /** Adds n × m shells over 0…1 × 0…1, mapped into space. **/
    void addPatch(const std::string& type, const std::string& set, int n, int m,
                  const std::function<Point(double, double)>& at);
    /** Adds n beams from a to b, or along a curve over 0…1. **/
    void addBeam(const std::string& type, const std::string& set, int n, const Point& a,
                 const Point& b);
    void addCurvedBeam(const std::string& type, const std::string& set, int n,
                       const std::function<Point(double)>& at);
    /** n[0]×n[1]×n[2] hexahedra of 8 or 20 nodes over 0…1 × 0…1 × 0…1, mapped into space. **/
    void addBricks(const std::string& type, const std::string& set, const std::array<int, 3>& n,
                   const std::function<Point(const Point&)>& at);
    /** C3D20R in a box. **/
    void addBox(const std::string& set, const std::array<int, 3>& n, const Point& low,
                const Point& high);

    void addShellSection(const std::string& set, double thickness, double offset = 0);
    void addBeamSection(const std::string& set, const std::string& shape, double a, double b,
                        const std::string& n1);
    void addNodeSet(const std::string& set, const std::function<bool(const Point&)>& isIn);
    /** Adds cards after the materials. **/
    void add(const std::string& cards) { _cards += cards; }

    /** Starts a piece that shares no nodes with the previous ones. **/
    void startPiece() { ++_piece; }
    /** Returns the number of the node at this position, adding it if necessary. **/
    int addNode(const Point& x);

    std::string text() const;

private:
    void addElement(const std::vector<int>& numbers);

    std::map<std::array<long, 4>, std::pair<int, Point>> _nodes;
    std::ostringstream _elements;
    std::string _cards;
    int _numElements = 0, _piece = 0;
};

}  // namespace testing
}  // namespace simflex
