#include "simflex/base/Checkpoint.h"

#include <stdexcept>

namespace simflex {
namespace {

constexpr char Kind[] = "simflex checkpoint";
/** Version of the format. Other versions are refused. **/
constexpr std::uint32_t Version = 8;

std::string readBytes(std::istream& stream) {
    try {
        return readArchive(stream, Kind, Version);
    } catch (const std::runtime_error& error) {
        Checkpoint::refuse(error.what());
    }
}

}  // namespace

void Checkpoint::refuse(const std::string& reason) {
    throw std::runtime_error("the checkpoint cannot be used: " + reason);
}

Checkpoint::Checkpoint(std::istream& stream) : Archive(readBytes(stream)) {}

void Checkpoint::write(std::ostream& stream) const {
    writeArchive(stream, Kind, Version, getBytes());
}

void Checkpoint::visit(std::vector<double>& values) {
    const std::size_t size = visitSize(values.size(), sizeof(double));
    if (size != values.size())
        refuse("it holds " + std::to_string(size) + " numbers where this model has " +
               std::to_string(values.size()));
    visitBytes(values.data(), size * sizeof(double));
}

}  // namespace simflex
