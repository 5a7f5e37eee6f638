#pragma once
/** @file
Modifications of an HDF5 file by another program. **/

#include <hdf5.h>

#include <cmath>
#include <cstring>
#include <iterator>

#include "Fuzz.h"

namespace simflex {
namespace fuzz {

constexpr size_t kTrailer = 16;  ///< bytes of the final checksum

/** Reads numbers from the input; zeros after its end. **/
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

inline void removeObject(hid_t file, const char* name) {
    if (std::strcmp(name, ".") != 0) H5Ldelete(file, name, H5P_DEFAULT);
}

/** Replaces one object by another data set of up to three extents. **/
inline void replaceData(hid_t file, const char* name, Input& input) {
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

/** Changes one number of a data set. **/
inline void changeValue(hid_t file, const char* name, Input& input) {
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

/** Changes or removes an attribute. **/
template <size_t count>
void changeAttribute(hid_t file, const char* name, const char* const (&names)[count],
                     Input& input) {
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

/** Changes up to six objects of a file according to the input. **/
template <size_t numObjects, size_t numAttributes>
void changeHdf5(const std::string& path, const char* const (&objects)[numObjects],
                const char* const (&attributes)[numAttributes], Input& input) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    if (file < 0) fail("HDF5 cannot open the file");
    for (int count = 0; count < 6 && !input.empty(); ++count) {
        const unsigned operation = input.take() % 4;
        const char* name = objects[input.take() % numObjects];
        if (operation == 0) removeObject(file, name);
        if (operation == 1) replaceData(file, name, input);
        if (operation == 2) changeValue(file, name, input);
        if (operation == 3) changeAttribute(file, name, attributes, input);
    }
    H5Fclose(file);  // drops the checksum
}

/** Changes bytes other than the checksum's mark, without which the file would count as changed by
another program. @returns whether any are changed. **/
inline bool changeBytes(std::string& bytes, Input& input) {
    const std::string before = bytes;
    while (!input.empty()) bytes[input.take2() * 7 % bytes.size()] ^= char(input.take());
    return bytes != before &&
           bytes.compare(bytes.size() - kTrailer, 8, before, before.size() - kTrailer, 8) == 0;
}

}  // namespace fuzz
}  // namespace simflex
