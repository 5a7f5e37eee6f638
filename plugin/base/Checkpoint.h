#pragma once
/** @file
The bytes of an integrator's checkpoint (private header). It is read into a model that is there:
vectors of numbers have the sizes that it asks for, and are refused if they come in others.

    void StepController::visit(Checkpoint& c) { c.visit(m_lastError, m_lastRatio, m_hasPast); } **/

#include "simflex/base/Archive.h"

namespace simflex {

class Checkpoint : public Archive {
public:
    using Archive::visit;

    /** Empty, to write into. **/
    Checkpoint() = default;
    /** Takes a file to read from.
    @throws std::runtime_error if it is no checkpoint, of another version, cut off or damaged. **/
    explicit Checkpoint(std::istream& stream);

    /** @throws std::runtime_error if the stream cannot take it. **/
    void write(std::ostream& stream) const;

    void visit(std::vector<double>& values) override;

    /** @throws std::runtime_error **/
    [[noreturn]] static void refuse(const std::string& reason);

private:
    [[noreturn]] void fail(const std::string& reason) const override { refuse(reason); }
};

}  // namespace simflex
