/** @file
Cases of a sweep: a table of values, and the command line's `NAME=VALUES`. Every case has its values
and its own folder in the sweep's. **/

#include <set>

#include "Fuzz.h"
#include "simflex/model/sweep/SweepPlan.h"

using namespace simflex;

namespace {

void checkCases(model::SweepPlan& plan, model::SweepOrder order) {
    if (!fuzz::accepts([&] { model::makeSweepCases(plan, order); }, fuzz::Names::Anything)) return;
    std::set<std::string> folders;
    for (const model::SweepCase& one : plan.cases) {
        if (one.values.size() != plan.keys.size()) fuzz::fail("a case without its values");
        if (one.folder.empty() || one.folder.size() > 200 || one.folder == ".." ||
            one.folder.find('/') != std::string::npos || !folders.insert(one.folder).second)
            fuzz::fail("a case with the folder '" + one.folder + "'");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 2);
    model::SweepPlan list, grid;
    const std::string path = fuzz::getFolder().write("cases.csv", files[0]);
    if (fuzz::accepts([&] { list.keys = model::readSweptKeys(path); }))
        checkCases(list, model::SweepOrder::List);
    for (size_t begin = 0; begin < files[1].size() && grid.keys.size() < 4;) {
        const size_t end = std::min(files[1].find('\n', begin), files[1].size());
        fuzz::accepts(
            [&] { grid.keys.push_back(model::parseSweptKey(files[1].substr(begin, end - begin))); },
            fuzz::Names::Anything);
        begin = end + 1;
    }
    size_t count = 1;
    for (const model::SweptKey& key : grid.keys) count *= std::min<size_t>(key.values.size(), 1000);
    if (count < 200) checkCases(grid, model::SweepOrder::Grid);
    return 0;
}
