/** @file
Time histories in CSV and HDF5. An accepted one has a value for every time and column, and survives
a round trip. **/

#include <cstring>

#include "FuzzHdf5.h"
#include "simflex/part/TableFile.h"

using namespace simflex;

namespace {

const std::vector<TableColumn> kColumns = {{"tip.x", "m"}, {"force, \"net\"", "N"}};
const char* const kObjects[] = {"time", "values", "channels", "units", "."};
const char* const kAttributes[] = {"format", "version"};

const std::string& getFile() {
    static const std::string bytes = [] {
        const std::string path = fuzz::getFolder() / "base.h5";
        {
            TableFile table(path, kColumns);
            for (int k = 0; k < 5; ++k) {
                const double values[] = {0.1 * k, -1e5 * k};
                table.append(1e-3 * k, values);
            }
        }
        std::ifstream in(path, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    }();
    return bytes;
}

/** NaN equals NaN. **/
bool areSame(const std::vector<double>& a, const std::vector<double>& b) {
    if (a.size() != b.size()) return false;
    for (size_t k = 0; k < a.size(); ++k)
        if (!(a[k] == b[k] || (a[k] != a[k] && b[k] != b[k]))) return false;
    return true;
}

void check(const std::string& path) {
    Table table;
    if (!fuzz::accepts([&] { table = readTable(path); })) return;
    const size_t numColumns = table.columns.size();
    if (table.values.size() != table.times.size() * numColumns)
        fuzz::fail("rows without their values");
    for (const char* name : {"again.csv", "again.h5"}) {
        const std::string again = fuzz::getFolder() / name;
        {
            TableFile out(again, table.columns);
            for (size_t k = 0; k < table.times.size(); ++k)
                out.append(table.times[k], table.values.data() + k * numColumns);
        }
        const Table same = readTable(again);
        if (!areSame(same.times, table.times) || !areSame(same.values, table.values) ||
            same.columns.size() != numColumns)
            fuzz::fail("a table that was written reads back as another");
        for (size_t k = 0; k < numColumns; ++k) {
            const TableColumn &column = table.columns[k], &written = same.columns[k];
            // A text ends at a zero, and a header at its last " [".
            const std::string text = column.name + column.unit;
            const bool isPlain =
                text.find('\0') == std::string::npos && column.unit.find('[') == std::string::npos;
            if (isPlain && (written.name != column.name || written.unit != column.unit))
                fuzz::fail("a column that was written reads back as another");
        }
    }
}

}  // namespace

/** With prefix "h5": changes to objects of the HDF5 file; otherwise the CSV file. **/
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size >= 2 && std::memcmp(data, "h5", 2) == 0) {
        fuzz::Input input(data + 2, size - 2);
        const std::string path = fuzz::getFolder().write("table.h5", getFile());
        fuzz::changeHdf5(path, kObjects, kAttributes, input);
        check(path);
    } else {
        check(fuzz::getFolder().write("table.csv",
                                      std::string(reinterpret_cast<const char*>(data), size)));
    }
    return 0;
}
