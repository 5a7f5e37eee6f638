#include "simflex/model/analyses/EarlierResults.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>

#include "simflex/base/NumberText.h"
#include "simflex/model/analyses/RunCheckpoint.h"
#include "simflex/model/results/ResultLayout.h"

namespace simflex {
namespace model {
namespace {

namespace fs = std::filesystem;

/** All files of a run's results, the result file last. **/
std::vector<std::string> listFiles(const std::string& path) {
    const std::string checkpoint = makeCheckpointPath(path);
    return {checkpoint, getFramesPath(checkpoint), getJournalPath(path), path};
}

/** Path of a file within a folder. **/
std::string placeInside(const std::string& folder, const std::string& file) {
    return (fs::path(folder) / fs::path(file).filename()).string();
}

std::string makeFolderBegin(const std::string& path) {
    return path + ".before-";
}

/** Numbers of the existing folders. **/
std::set<int> findFolders(const std::string& path) {
    std::set<int> numbers;
    const fs::path begin(makeFolderBegin(path));
    const fs::path parent = begin.has_parent_path() ? begin.parent_path() : ".";
    const std::string name = begin.filename().string();
    for (const auto& entry : fs::directory_iterator(parent)) {
        const std::string found = entry.path().filename().string();
        int number = 0;
        if (found.compare(0, name.size(), name) == 0 &&
            readInteger(found.substr(name.size()), number) && number > 0 && !entry.is_symlink())
            numbers.insert(number);
    }
    return numbers;
}

/** Adds the complete analyses of a result file.
@returns true if all its analyses were complete already; false if the file cannot be read. **/
bool addComplete(const std::string& file, std::set<std::string>& complete) {
    try {
        bool isReplaced = true;
        for (const Results::Analysis& analysis : readResults(file, ReadStates::No).analyses) {
            isReplaced = isReplaced && complete.count(analysis.name) > 0;
            if (analysis.isComplete) complete.insert(analysis.name);
        }
        return isReplaced;
    } catch (const std::exception&) {
        return false;
    }
}

}  // namespace

std::string keepAside(const std::string& path) {
    const std::string journal = getJournalPath(path);
    std::optional<ResultJournal> lock;
    if (fs::exists(journal)) lock.emplace(journal, ResultJournal::Access::Append);
    const std::set<int> numbers = findFolders(path);
    const int last = numbers.empty() ? 0 : *numbers.rbegin();
    std::string folder = makeFolderBegin(path) + std::to_string(last);
    if (last == 0 || fs::exists(placeInside(folder, path)))
        folder = makeFolderBegin(path) + std::to_string(last + 1);
    fs::create_directory(folder);
    for (const std::string& file : listFiles(path)) {
        if (file == journal && lock && !lock->hasHeader()) continue;  // it is empty, or not ours
        if (fs::is_symlink(file))  // the link stays, for the new file
            fs::copy_file(file, placeInside(folder, file), fs::copy_options::overwrite_existing);
        else if (fs::exists(file))
            fs::rename(file, placeInside(folder, file));
    }
    return folder;
}

void removeResults(const std::string& path) {
    std::error_code ignored;
    for (const std::string& file : listFiles(path)) fs::remove(file, ignored);
}

void removeReplaced(const std::string& path) {
    const std::set<int> numbers = findFolders(path);
    if (numbers.empty()) return;
    std::set<std::string> complete;
    addComplete(path, complete);
    for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) {
        const std::string folder = makeFolderBegin(path) + std::to_string(*number),
                          results = placeInside(folder, path);
        if (fs::exists(results) && !addComplete(results, complete)) continue;
        std::error_code ignored;
        removeResults(results);
        fs::remove(folder, ignored);  // fails if the folder has other files
    }
}

}  // namespace model
}  // namespace simflex
