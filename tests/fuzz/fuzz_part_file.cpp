/** @file
Part files: bytes changed behind the checksum must be found out; objects changed by another program
(data sets of other sizes, types and values, other attributes, objects that are missing) give a
valid part or a refusal. **/

#include <hdf5.h>

#include <cmath>
#include <cstring>
#include <iterator>

#include "Fuzz.h"
#include "simflex/part/ReducedBodyFile.h"
#include "support/PointMassPart.h"

using namespace simflex;

namespace {

constexpr size_t kTrailer = 16;

/** A part with something of everything; its file. **/
const std::string& getFile() {
    static const std::string bytes = [] {
        test::PointMassPartOptions options;
        options.numModes = 2;
        options.cells = {1, 1, 1};
        options.stiffening = 1;
        ReducedBody body = *test::makePointMassPart(options).body;
        body.mesh.nodeSets["LEFT"] = {0, 1, 2};
        body.report.emplace();
        body.report->normalFrequencies = {1, 2};
        body.report->effectiveMasses.assign(12, 0.1);
        body.modalStress.emplace();
        body.modalStress->nodes = {0, 3};
        body.modalStress->stress.assign(24, 1.0f);
        body.modalStress->strain.assign(24, 1e-6f);
        body.interfaces[1].tie = TieType::Distributing;
        body.interfaces[1].weights.assign(body.interfaces[1].nodes.size(),
                                          1.0 / double(body.interfaces[1].nodes.size()));
        const std::string path = fuzz::getFolder() / "base.h5";
        writeReducedBody(path, body);
        std::ifstream in(path, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    }();
    return bytes;
}

/** Takes numbers from the input; zeros when it is used up. **/
class Input {
public:
    Input(const uint8_t* data, size_t size) : _data(data), _size(size) {}
    bool empty() const { return _at >= _size; }
    unsigned take() { return empty() ? 0 : _data[_at++]; }
    unsigned take2() {
        const unsigned high = take();
        return 256 * high + take();
    }

private:
    const uint8_t* _data;
    size_t _size, _at = 0;
};

const char* const kObjects[] = {"mass",
                                "center_of_mass",
                                "inertia",
                                "omega_squared",
                                "I1",
                                "I2",
                                "N",
                                "Phi",
                                "interfaces",
                                "interfaces/0",
                                "interfaces/0/position",
                                "interfaces/0/Phi",
                                "interfaces/0/Psi",
                                "interfaces/0/nodes",
                                "interfaces/1/weights",
                                "interfaces/1",
                                "stiffening",
                                "stiffening/turning",
                                "stiffening/interfaces",
                                "stiffening/interfaces/0",
                                "modal_stress",
                                "modal_stress/nodes",
                                "modal_stress/stress",
                                "modal_stress/strain",
                                "report",
                                "report/normal_frequencies",
                                "report/effective_masses",
                                "report/rigid_masses",
                                "report/residuals",
                                "report/full_frequencies",
                                "mesh",
                                "mesh/node_numbers",
                                "mesh/positions",
                                "mesh/elements",
                                "mesh/elements/0",
                                "mesh/elements/0/nodes",
                                "mesh/node_sets",
                                "mesh/node_sets/0",
                                "mesh/node_sets/0/nodes",
                                "."};

void removeObject(hid_t file, const char* name) {
    if (std::strcmp(name, ".") != 0) H5Ldelete(file, name, H5P_DEFAULT);
}

/** Another data set in the place of one object, of up to three extents. **/
void replaceData(hid_t file, const char* name, Input& input) {
    removeObject(file, name);
    static const hid_t types[] = {H5T_NATIVE_DOUBLE, H5T_NATIVE_INT, H5T_NATIVE_FLOAT,
                                  H5T_NATIVE_CHAR};
    const hid_t type = types[input.take() % 4];
    hsize_t extents[3] = {input.take() % 20, input.take() % 20, input.take() % 20};
    const int rank = int(input.take() % 4);
    const hid_t space = rank ? H5Screate_simple(rank, extents, nullptr) : H5Screate(H5S_SCALAR);
    const hid_t data = H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (data >= 0) {
        std::vector<double> values(8000);
        const double scale = double(input.take()) - 100;
        for (size_t k = 0; k < values.size(); ++k) values[k] = scale + double(k % 7);
        H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
        H5Dclose(data);
    }
    H5Sclose(space);
}

/** One number of a data set. **/
void changeValue(hid_t file, const char* name, Input& input) {
    static const double values[] = {0, -1, 1e300, -1e300, 1e9, 2147483647.0, NAN, INFINITY, 0.5, 7};
    const hid_t data = H5Dopen2(file, name, H5P_DEFAULT);
    if (data < 0) return;
    const hid_t space = H5Dget_space(data);
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    if (count > 0 && count < 100000) {
        std::vector<double> numbers(size_t(count), 0.0);
        H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
        numbers[input.take2() % size_t(count)] = values[input.take() % std::size(values)];
        H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
    }
    H5Sclose(space);
    H5Dclose(data);
}

/** Another value of an attribute, or none. **/
void changeAttribute(hid_t file, const char* name, Input& input) {
    static const char* const names[] = {"format",  "version", "name",
                                        "units",   "type",    "num_constraint_modes",
                                        "created", "source",  "num_attachment_modes"};
    const hid_t object = H5Oopen(file, name, H5P_DEFAULT);
    if (object < 0) return;
    const char* attribute = names[input.take() % std::size(names)];
    H5Adelete(object, attribute);
    const hid_t space = H5Screate(H5S_SCALAR);
    if (input.take() % 2) {
        const int value = int(input.take()) - 100;
        const hid_t id =
            H5Acreate2(object, attribute, H5T_NATIVE_INT, space, H5P_DEFAULT, H5P_DEFAULT);
        if (id >= 0) H5Awrite(id, H5T_NATIVE_INT, &value), H5Aclose(id);
    } else {
        const hid_t type = H5Tcopy(H5T_C_S1);
        const size_t length = 1 + input.take() % 30;
        H5Tset_size(type, length);
        const std::string text(length, char('A' + input.take() % 60));
        const hid_t id = H5Acreate2(object, attribute, type, space, H5P_DEFAULT, H5P_DEFAULT);
        if (id >= 0) H5Awrite(id, type, text.data()), H5Aclose(id);
        H5Tclose(type);
    }
    H5Sclose(space);
    H5Oclose(object);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    Input input(data, size);
    std::string bytes = getFile();
    const bool changesBytes = input.take() % 8 == 0;
    if (changesBytes) {
        const std::string before = bytes;
        while (!input.empty()) bytes[input.take2() * 7 % bytes.size()] ^= char(input.take());
        // A trailer that is gone is that of a file which another program has changed.
        if (bytes == before ||
            bytes.compare(bytes.size() - kTrailer, 8, before, before.size() - kTrailer, 8) != 0)
            return 0;
    }
    const std::string path = fuzz::getFolder().write("part.h5", bytes);
    if (!changesBytes) {
        H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
        const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
        if (file < 0) fuzz::fail("HDF5 cannot open the part file");
        for (int count = 0; count < 6 && !input.empty(); ++count) {
            const unsigned operation = input.take() % 4;
            const char* name = kObjects[input.take() % std::size(kObjects)];
            if (operation == 0) removeObject(file, name);
            if (operation == 1) replaceData(file, name, input);
            if (operation == 2) changeValue(file, name, input);
            if (operation == 3) changeAttribute(file, name, input);
        }
        H5Fclose(file);  // which drops the checksum
    }
    const bool accepted = fuzz::accepts([&] { readReducedBody(path).validate(); });
    if (accepted && changesBytes) fuzz::fail("a damaged file was accepted");
    return 0;
}
