#pragma once
/** @file
The bytes of an integrator's checkpoint (private header). A checkpoint is read into an existing
model: a vector of another size than the model's is refused.

    void StepController::visit(Checkpoint& c) { c.visit(m_lastError, m_lastRatio, m_hasPast); }  **/

#include "simflex/base/Archive.h"

namespace simflex {

class Checkpoint : public Archive {
public:
    using Archive::visit;

    /** Creates an empty checkpoint for writing. **/
    Checkpoint() = default;
    /** Opens a checkpoint for reading.
    @throws std::runtime_error if the stream is no checkpoint, has another version, is truncated or
    damaged. **/
    explicit Checkpoint(std::istream& stream);

    /** @throws std::runtime_error if the stream cannot be written. **/
    void write(std::ostream& stream) const;

    void visit(std::vector<double>& values) override;

    /** @throws std::runtime_error **/
    [[noreturn]] static void refuse(const std::string& reason);

private:
    [[noreturn]] void fail(const std::string& reason) const override { refuse(reason); }
};

}  // namespace simflex
