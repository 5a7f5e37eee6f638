#pragma once
/** @file
The few HDF5 operations that the part file needs, as values that clean up. (Private header.) **/

#include <hdf5.h>

#include <string>
#include <utility>
#include <vector>

namespace simflex {
namespace hdf5 {

/** An HDF5 identifier that closes itself. **/
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

/** Keeps HDF5 from printing its own error stack while this lives. **/
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

/** "cannot create the file: No space left on device": with the system's reason where it is the
disk's, which HDF5 does not pass on. **/
std::string describeFailure(const std::string& what);
/** Throws it for a negative status. **/
void check(herr_t status, const std::string& what);

/** All of these throw std::runtime_error with the name of the object that failed. Nothing carries
a time stamp. **/
Handle createFile(const std::string& path);
Handle openFile(const std::string& path);
Handle createGroup(hid_t parent, const std::string& name);
Handle openGroup(hid_t parent, const std::string& name);
Handle openData(hid_t parent, const std::string& name);

/** Whether the group has a member of this name. **/
bool hasLink(hid_t group, const std::string& name);

/** Number of links of a group, and their names. **/
size_t countLinks(hid_t group);
std::vector<std::string> listLinks(hid_t group);

void writeText(hid_t object, const std::string& name, const std::string& value);
/** Text that can be printed, see makePrintable(): the file may be anybody's. **/
std::string readText(hid_t object, const std::string& name);
/** The same as it stands there, which a path may need. **/
std::string readPath(hid_t object, const std::string& name);
void writeInteger(hid_t object, const std::string& name, int value);
int readInteger(hid_t object, const std::string& name);

/** Texts as a data set, of any number and length, each as long as the longest. They are read as
readText() reads one. **/
void writeTexts(hid_t parent, const std::string& name, const std::vector<std::string>& texts);
std::vector<std::string> readTexts(hid_t parent, const std::string& name);

void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const double* values);
void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const float* values);
void write(hid_t parent, const std::string& name, const std::vector<hsize_t>& shape,
           const int* values);

/** Reads a data set that must have this shape; a 0 stands for any extent. **/
std::vector<double> readNumbers(hid_t parent, const std::string& name,
                                const std::vector<hsize_t>& shape);
std::vector<float> readFloats(hid_t parent, const std::string& name,
                              const std::vector<hsize_t>& shape);
std::vector<int> readIndices(hid_t parent, const std::string& name,
                             const std::vector<hsize_t>& shape);

}  // namespace hdf5
}  // namespace simflex
