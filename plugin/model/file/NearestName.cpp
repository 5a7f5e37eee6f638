#include "simflex/model/file/NearestName.h"

#include <cstddef>

namespace simflex {
namespace model {

namespace {

const std::size_t FewNames = 16;  // listed in full

}  // namespace

std::string proposeName(const std::string& name, const std::vector<std::string>& known) {
    const std::string nearest = findNearestName(name, known);
    if (!nearest.empty()) return "did you mean '" + nearest + "'?";
    if (known.empty() || known.size() > FewNames) return "";
    return "there " + std::string(known.size() == 1 ? "is " : "are ") + joinNames(known);
}

std::string joinNames(const std::vector<std::string>& names, const std::string& separator) {
    std::string text;
    for (const std::string& name : names) text += (&name == &names[0] ? "" : separator) + name;
    return text;
}

std::string describeUnknown(const std::string& what, const std::string& name,
                            const std::vector<std::string>& known) {
    const std::string proposal = known.empty() ? "the model has none" : proposeName(name, known);
    return "there is no " + what + " '" + name + "'" + (proposal.empty() ? "" : "; " + proposal);
}

}  // namespace model
}  // namespace simflex
