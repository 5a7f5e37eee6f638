#pragma once
/** @file
A folder of a test's own: others may run the same test at the same time. **/

#include <string>
#include <vector>

namespace simflex {
namespace testing {

/** A folder of a test's own, removed at the end. While it lives, $TMPDIR points into it. **/
class TestFolder {
public:
    TestFolder();
    ~TestFolder();
    TestFolder(const TestFolder&) = delete;
    TestFolder& operator=(const TestFolder&) = delete;

    std::string operator/(const std::string& name) const { return _path + "/" + name; }
    const std::string& path() const { return _path; }

    /** @returns the path of a new folder in it. **/
    std::string makeFolder(const std::string& name) const;

    /** What simflex left behind in $TMPDIR: nothing, one hopes. **/
    std::vector<std::string> listTemporaryFiles() const;

private:
    std::string _path, _oldTemporary;
};

std::string readText(const std::string& path);
void writeText(const std::string& path, const std::string& text);

/** Names of the files of a folder, sorted; none if there is no such folder. **/
std::vector<std::string> listFiles(const std::string& folder);

}  // namespace testing
}  // namespace simflex
