#pragma once
/** @file
A private folder for a test. Several instances of one test may run at the same time. **/

#include <string>
#include <vector>

namespace simflex {
namespace testing {

/** A private folder that the destructor removes. During its lifetime $TMPDIR points into it. **/
class TestFolder {
public:
    TestFolder();
    ~TestFolder();
    TestFolder(const TestFolder&) = delete;
    TestFolder& operator=(const TestFolder&) = delete;

    std::string operator/(const std::string& name) const { return _path + "/" + name; }
    const std::string& path() const { return _path; }

    /** Makes a subfolder. @returns its path. **/
    std::string makeFolder(const std::string& name) const;

    /** Returns the files that simflex left in $TMPDIR; there should be none. **/
    std::vector<std::string> listTemporaryFiles() const;

private:
    std::string _path, _oldTemporary;
};

std::string readText(const std::string& path);
void writeText(const std::string& path, const std::string& text);

/** Returns the sorted file names in a folder; none if the folder does not exist. **/
std::vector<std::string> listFiles(const std::string& folder);

}  // namespace testing
}  // namespace simflex
