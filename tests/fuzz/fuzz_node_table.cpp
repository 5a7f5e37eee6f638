/** @file
Node tables, decks and grids as sources of nodes. Accepted nodes have ascending numbers and finite
positions, and elements and sets refer to them. **/

#include <cmath>

#include "../../plugin/fe/decks/NodeTable.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    for (const char* name : {"nodes.csv", "nodes.inp", "nodes.bdf"}) {
        const std::string path = fuzz::getFolder().write(name, text);
        NodeTable table;
        if (!fuzz::accepts([&] { table = readNodeTable(path); })) continue;
        const Mesh& mesh = table.mesh;
        const int n = mesh.numNodes();
        if (mesh.positions.size() != 3 * size_t(n) || table.order.size() != size_t(n))
            fuzz::fail("sizes differ");
        for (int k = 1; k < n; ++k)
            if (mesh.nodeNumbers[size_t(k)] <= mesh.nodeNumbers[size_t(k - 1)])
                fuzz::fail("node numbers do not ascend");
        for (const double x : mesh.positions)
            if (!std::isfinite(x)) fuzz::fail("a position is not finite");
        const auto check = [&](const std::vector<int>& nodes) {
            for (const int node : nodes)
                if (node < 0 || node >= n) fuzz::fail("a node that is not there");
        };
        check(table.order);
        for (const ElementBlock& block : mesh.elements) {
            check(block.nodes);
            if (block.nodes.size() % size_t(numNodesOf(block.type))) fuzz::fail("half an element");
        }
        for (const auto& [set, nodes] : mesh.nodeSets) check(nodes);
    }
    return 0;
}
