#include "simflex/model/parts/PartBuilder.h"

#include <cmath>
#include <filesystem>

#include "simflex/model/parts/PartSource.h"
#include "simflex/part/ModeSelection.h"
#include "simflex/part/PartWarnings.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex {
namespace model {
namespace {

ReducedBody readPart(const ModelValue& value, const ModelOptions& options) {
    if (!value.has("file")) return reducePart(value, options);
    const ModelValue file = value.get("file");
    const std::string path = file.getFilePath();
    if (!std::filesystem::exists(path))
        file.fail("there is no part file '" + path + "'; `simflex reduce` makes one");
    try {
        ReducedBody part = readReducedBody(path);
        for (const auto& warnings : {readPartWarnings(path), listPartDoubts(part)})
            for (const std::string& warning : warnings)
                options.listener.tellWarning("part '" + value.getName() + "': " + warning);
        return part;
    } catch (const std::exception& error) {
        file.fail(error.what());
    }
}

ReducedBody keepModes(ReducedBody part, const ModelValue& keep) {
    if (!keep.isGiven() || (keep.isScalar() && keep.getText() == "all")) return part;
    return withPlace(keep, [&]() -> ReducedBody {
        if (keep.has("lowest"))
            return selectLowestModes(std::move(part), keep.get("lowest").getInteger());
        if (keep.has("below"))
            return selectModesInBand(std::move(part), 0, keep.get("below").getNumber());
        std::vector<int> modes;
        for (const double number : keep.getNumbers()) {
            if (number != std::floor(number) || number < 1 || number > part.numModes)
                keep.fail("its modes are numbered from 1 to " + std::to_string(part.numModes));
            modes.push_back(int(number) - 1);
        }
        return selectModes(std::move(part), modes);
    });
}

/** The part with additional modes. **/
std::shared_ptr<const ReducedBody> findFiner(const ModelValue& value, const ReducedBody& part) {
    if (part.finer) return part.finer;
    value.fail(
        "nothing is known of the modes that its file has left out; reduce the part with "
        "`simflex reduce --further-modes 24` for error bars");
}

}  // namespace

Parts makeParts(const ModelValue& file, const ModelOptions& options) {
    Parts parts;
    const ModelValue values = file.get("parts");
    for (const std::string& name : values.getKeys()) {
        const ModelValue value = values.get(name);
        if (options.bodies == ModelOptions::Bodies::Finer) {
            parts[name] = findFiner(value, readPart(value, options));
            continue;
        }
        parts[name] = std::make_shared<const ReducedBody>(
            keepModes(readPart(value, options), value.get("keep")));
    }
    return parts;
}

}  // namespace model
}  // namespace simflex
