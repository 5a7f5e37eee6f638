#pragma once
/** @file
RAII wrappers of the HDF5 operations needed for part files. (Private header.) **/

#include <hdf5.h>

#include <string>
#include <utility>
#include <vector>

namespace simflex {
namespace hdf5 {

/** An HDF5 identifier, closed by the destructor. **/
class Handle {
public:
    Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what);
    Handle(Handle&& other) noexcept : m_id(std::exchange(other.m_id, -1)), m_close(other.m_close) {}
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle();
    operator hid_t() const { return m_id; }

private:
    hid_t m_id;
    herr_t (*m_close)(hid_t);
};

/** Suppresses HDF5's error output during its lifetime. **/
class Quiet {
public:
    Quiet();
    ~Quiet();
    Quiet(const Quiet&) = delete;
    Quiet& operator=(const Quiet&) = delete;

private:
    H5E_auto2_t m_function = nullptr;
    void* m_data = nullptr;
};

/** Returns "cannot create the file: No space left on device", with the system's reason for disk
errors, which HDF5 does not report. **/
std::string describeFailure(const std::string& what);
/** Throws describeFailure(what) for a negative status. **/
void check(herr_t status, const std::string& what);

/** All of these throw std::runtime_error with the name of the object that failed. Objects have no
time stamps. **/
Handle createFile(const std::string& path);
Handle openFile(const std::string& path);
Handle createGroup(hid_t parent, const std::string& name);
Handle openGroup(hid_t parent, const std::string& name);
Handle openData(hid_t parent, const std::string& name);

/** Whether the group has a member of this name. **/
bool hasLink(hid_t group, const std::string& name);

/** Number of links of a group; their names. **/
size_t countLinks(hid_t group);
std::vector<std::string> listLinks(hid_t group);

void writeText(hid_t object, const std::string& name, const std::string& value);
/** Reads printable text (see makePrintable()), since the file is untrusted. **/
std::string readText(hid_t object, const std::string& name);
/** Reads text unchanged, as needed for paths. **/
std::string readPath(hid_t object, const std::string& name);
void writeInteger(hid_t object, const std::string& name, int value);
int readInteger(hid_t object, const std::string& name);

/** Texts as a data set, padded to the longest. They are read as by readText(). **/
void writeTexts(hid_t parent, const std::string& name, const std::vector<std::string>& texts);
std::vector<std::string> readTexts(hid_t parent, const std::string& name);

void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const double* values);
void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const float* values);
void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const int* values);

/** Read a data set, which must have this shape; 0 stands for any extent. **/
std::vector<double> readNumbers(hid_t parent, const std::string& name,
                                const std::vector<hsize_t>& shape);
std::vector<float> readFloats(hid_t parent, const std::string& name,
                              const std::vector<hsize_t>& shape);
std::vector<int> readIndices(hid_t parent, const std::string& name,
                             const std::vector<hsize_t>& shape);

}  // namespace hdf5
}  // namespace simflex
