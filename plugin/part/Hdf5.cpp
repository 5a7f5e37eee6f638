#include "Hdf5.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "simflex/base/InputFile.h"
#include "simflex/base/Utf8.h"

namespace simflex {
namespace hdf5 {
namespace {

/** Longest text attribute: HDF5 stores attributes in the object header, which is limited to 64
KiB. **/
constexpr size_t LongestText = 60000;

/** Size limit of a data set, so that a damaged file does not request absurd amounts of memory. **/
constexpr double MostNumbers = 1e11;

/** Records the name of the first external or user-defined link. **/
herr_t findForeignLink(hid_t, const char* name, const H5L_info_t* info, void* found) {
    if (info->type == H5L_TYPE_HARD || info->type == H5L_TYPE_SOFT) return 0;
    *static_cast<std::string*>(found) = name;
    return 1;
}

/** @throws std::runtime_error if a link leads to another file, which an untrusted file could
choose. **/
void refuseForeignLinks(hid_t file) {
    std::string found;
    check(H5Lvisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, findForeignLink, &found), "list its links");
    if (!found.empty()) throw std::runtime_error("'" + found + "' is a link to another file");
}

Handle makeCreation(hid_t kind) {
    Handle properties(H5Pcreate(kind), H5Pclose, "create properties");
    check(H5Pset_obj_track_times(properties, false), "turn time stamps off");
    return properties;
}

void writeAny(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
              hid_t stored, hid_t given, const void* values) {
    const Handle space(H5Screate_simple(int(shape.size()), shape.data(), nullptr), H5Sclose,
                       "shape '" + name + "'");
    const Handle properties = makeCreation(H5P_DATASET_CREATE);
    const Handle data(
        H5Dcreate2(parent, name.c_str(), stored, space, H5P_DEFAULT, properties, H5P_DEFAULT),
        H5Dclose, "create '" + name + "'");
    hsize_t size = 1;
    for (const hsize_t extent : shape) size *= extent;
    if (size > 0)
        check(H5Dwrite(data, given, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), "write '" + name + "'");
}

template <class Number>
std::vector<Number> readAny(hid_t parent, const std::string& name,
                            const std::vector<hsize_t>& shape, hid_t wanted, H5T_class_t kind) {
    const Handle data = openData(parent, name);
    const Handle space(H5Dget_space(data), H5Sclose, "read the shape of '" + name + "'");
    const Handle type(H5Dget_type(data), H5Tclose, "read the type of '" + name + "'");
    std::vector<hsize_t> found(shape.size());
    if (H5Sget_simple_extent_ndims(space) != int(shape.size()))
        throw std::runtime_error("'" + name + "' has another number of dimensions than " +
                                 std::to_string(shape.size()));
    check(H5Sget_simple_extent_dims(space, found.data(), nullptr),
          "read the shape of '" + name + "'");
    double size = 1;
    for (size_t k = 0; k < shape.size(); ++k) {
        size *= double(found[k]);
        if (shape[k] != 0 && found[k] != shape[k])
            throw std::runtime_error("'" + name + "' has extent " + std::to_string(found[k]) +
                                     ", expected " + std::to_string(shape[k]));
    }
    if (H5Tget_class(type) != kind)
        throw std::runtime_error("'" + name + "' holds another type of number");
    if (size > MostNumbers ||
        (size > 0 && double(H5Dget_storage_size(data)) < size * double(H5Tget_size(type))))
        throw std::runtime_error("'" + name + "' claims more numbers than the file holds");
    std::vector<Number> values(size_t(size), Number(0));
    if (!values.empty())
        check(H5Dread(data, wanted, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
              "read '" + name + "'");
    return values;
}

}  // namespace

std::string describeFailure(const std::string& what) {
    const int reason = errno;
    const bool isTheDisks = reason == ENOSPC || reason == EDQUOT || reason == EROFS ||
                            reason == EACCES || reason == EFBIG;
    return "cannot " + what + (isTheDisks ? std::string(": ") + std::strerror(reason) : "");
}

void check(herr_t status, const std::string& what) {
    if (status < 0) throw std::runtime_error(describeFailure(what));
}

Handle::Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what)
    : m_id(id), m_close(close) {
    if (id < 0) throw std::runtime_error(describeFailure(what));
}

Handle::~Handle() {
    if (m_id >= 0) m_close(m_id);
}

Quiet::Quiet() {
    H5Eget_auto2(H5E_DEFAULT, &m_function, &m_data);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Quiet::~Quiet() {
    H5Eset_auto2(H5E_DEFAULT, m_function, m_data);
}

Handle createFile(const std::string& path) {
    const Handle creation = makeCreation(H5P_FILE_CREATE);
    return Handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, H5P_DEFAULT), H5Fclose,
                  "create the file");
}

Handle openFile(const std::string& path) {
    if (!isInputFile(path)) throw std::runtime_error("there is no such file");
    // Closing the file closes all its objects, so that a damaged file leaves nothing open.
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "create properties");
    check(H5Pset_fclose_degree(access, H5F_CLOSE_STRONG), "set the way of closing");
    Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), H5Fclose,
                "open it as HDF5: the file is cut short or of another kind");
    refuseForeignLinks(file);
    return file;
}

Handle createGroup(hid_t parent, const std::string& name) {
    const Handle creation = makeCreation(H5P_GROUP_CREATE);
    return Handle(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, creation, H5P_DEFAULT), H5Gclose,
                  "create '" + name + "'");
}

Handle openGroup(hid_t parent, const std::string& name) {
    return Handle(H5Gopen2(parent, name.c_str(), H5P_DEFAULT), H5Gclose, "open '" + name + "'");
}

Handle openData(hid_t parent, const std::string& name) {
    Handle data(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose, "open '" + name + "'");
    const Handle creation(H5Dget_create_plist(data), H5Pclose, "read how '" + name + "' is stored");
    if (H5Pget_external_count(creation) > 0 || H5Pget_layout(creation) == H5D_VIRTUAL)
        throw std::runtime_error("'" + name + "' is stored in another file");
    return data;
}

bool hasLink(hid_t group, const std::string& name) {
    return H5Lexists(group, name.c_str(), H5P_DEFAULT) > 0;
}

size_t countLinks(hid_t group) {
    H5G_info_t info{};
    check(H5Gget_info(group, &info), "count the members of a group");
    return size_t(info.nlinks);
}

std::vector<std::string> listLinks(hid_t group) {
    std::vector<std::string> names;
    for (hsize_t k = 0; k < countLinks(group); ++k) {
        const auto getName = [&](char* name, size_t size) {
            return H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, k, name, size,
                                      H5P_DEFAULT);
        };
        const ssize_t size = getName(nullptr, 0);
        if (size < 0) throw std::runtime_error("cannot list the members of a group");
        std::string name(size_t(size) + 1, '\0');
        getName(name.data(), name.size());
        name.resize(size_t(size));
        if (makePrintable(name) != name || name.find('\n') != name.npos) {
            std::replace(name.begin(), name.end(), '\n', '?');
            throw std::runtime_error("'" + name + "' in it is no name: it cannot be printed");
        }
        names.push_back(name);
    }
    return names;
}

void writeText(hid_t object, const std::string& name, const std::string& value) {
    if (value.size() > LongestText)
        throw std::runtime_error("the text of '" + name + "' is too long");
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "describe '" + name + "'");
    check(H5Tset_size(type, value.size() + 1), "describe '" + name + "'");
    check(H5Tset_cset(type, H5T_CSET_UTF8), "describe '" + name + "'");
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "shape '" + name + "'");
    const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                           H5Aclose, "create '" + name + "'");
    check(H5Awrite(attribute, type, value.c_str()), "write '" + name + "'");
}

std::string readText(hid_t object, const std::string& name) {
    return makePrintable(readPath(object, name));
}

std::string readPath(hid_t object, const std::string& name) {
    const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose,
                           "open '" + name + "'");
    const Handle stored(H5Aget_type(attribute), H5Tclose, "read the type of '" + name + "'");
    const Handle space(H5Aget_space(attribute), H5Sclose, "read the shape of '" + name + "'");
    if (H5Tget_class(stored) != H5T_STRING || H5Tis_variable_str(stored) > 0 ||
        H5Sget_simple_extent_npoints(space) != 1 || H5Tget_size(stored) > LongestText + 1)
        throw std::runtime_error("'" + name + "' is not text");
    std::string value(H5Tget_size(stored) + 1, '\0');
    check(H5Aread(attribute, stored, value.data()), "read '" + name + "'");
    value.resize(value.find('\0'));
    return value;
}

void writeTexts(hid_t parent, const std::string& name, const std::vector<std::string>& texts) {
    size_t width = 1;
    for (const std::string& text : texts) width = std::max(width, text.size());
    std::string joined;
    joined.reserve(width * texts.size());
    for (const std::string& text : texts) joined.append(text).append(width - text.size(), '\0');
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "describe '" + name + "'");
    check(H5Tset_size(type, width), "describe '" + name + "'");
    check(H5Tset_strpad(type, H5T_STR_NULLPAD), "describe '" + name + "'");
    check(H5Tset_cset(type, H5T_CSET_UTF8), "describe '" + name + "'");
    writeAny(parent, name, {texts.size()}, type, type, joined.data());
}

std::vector<std::string> readTexts(hid_t parent, const std::string& name) {
    const Handle data = openData(parent, name);
    const Handle space(H5Dget_space(data), H5Sclose, "read the shape of '" + name + "'");
    const Handle type(H5Dget_type(data), H5Tclose, "read the type of '" + name + "'");
    const size_t width = H5Tget_size(type);
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0 || width == 0 || count < 0)
        throw std::runtime_error("'" + name + "' holds no texts");
    if (double(H5Dget_storage_size(data)) < double(count) * double(width))
        throw std::runtime_error("'" + name + "' claims more texts than the file holds");
    std::string joined(size_t(count) * width, '\0');
    if (count > 0)
        check(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, joined.data()),
              "read '" + name + "'");
    std::vector<std::string> texts;
    for (size_t k = 0; k < size_t(count); ++k) {
        texts.push_back(joined.substr(k * width, width));
        texts.back().resize(std::min(texts.back().find('\0'), width));
        texts.back() = makePrintable(texts.back());
    }
    return texts;
}

void writeInteger(hid_t object, const std::string& name, int value) {
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "shape '" + name + "'");
    const Handle attribute(
        H5Acreate2(object, name.c_str(), H5T_STD_I32LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
        "create '" + name + "'");
    check(H5Awrite(attribute, H5T_NATIVE_INT, &value), "write '" + name + "'");
}

int readInteger(hid_t object, const std::string& name) {
    const Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose,
                           "open '" + name + "'");
    const Handle space(H5Aget_space(attribute), H5Sclose, "read the shape of '" + name + "'");
    int value = 0;
    if (H5Sget_simple_extent_npoints(space) != 1)
        throw std::runtime_error("'" + name + "' is not one number");
    check(H5Aread(attribute, H5T_NATIVE_INT, &value), "read '" + name + "'");
    return value;
}

void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const double* values) {
    writeAny(parent, name, shape, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, values);
}

void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const float* values) {
    writeAny(parent, name, shape, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, values);
}

void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const int* values) {
    writeAny(parent, name, shape, H5T_STD_I32LE, H5T_NATIVE_INT, values);
}

std::vector<double> readNumbers(hid_t parent, const std::string& name,
                                const std::vector<hsize_t>& shape) {
    return readAny<double>(parent, name, shape, H5T_NATIVE_DOUBLE, H5T_FLOAT);
}

std::vector<float> readFloats(hid_t parent, const std::string& name,
                              const std::vector<hsize_t>& shape) {
    return readAny<float>(parent, name, shape, H5T_NATIVE_FLOAT, H5T_FLOAT);
}

std::vector<int> readIndices(hid_t parent, const std::string& name,
                             const std::vector<hsize_t>& shape) {
    return readAny<int>(parent, name, shape, H5T_NATIVE_INT, H5T_INTEGER);
}

}  // namespace hdf5
}  // namespace simflex
