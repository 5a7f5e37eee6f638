#pragma once
/** @file
The bytes of an integrator's checkpoint (private header). One visit() of a class both writes and
reads it, so that the two cannot differ:

    void StepController::visit(Checkpoint& c) { c.visit(m_lastError, m_lastRatio, m_hasPast); }

A file is a line that names it, byte order, version, length, the bytes, and their checksum. **/

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace simflex {

class Checkpoint {
public:
    /** Version of the format that is written; older ones are not read, there are none. **/
    static constexpr std::uint32_t Version = 4;

    /** Empty, to write into. **/
    Checkpoint() = default;
    /** Takes a file to read from.
    @throws std::runtime_error if it is no checkpoint, of another version, cut off or damaged. **/
    explicit Checkpoint(std::istream& stream);

    /** @throws std::runtime_error if the stream cannot take it. **/
    void write(std::ostream& stream) const;

    bool isReading() const { return m_isReading; }

    template <class T>
    std::enable_if_t<std::is_arithmetic_v<T>> visit(T& value) {
        visitBytes(&value, sizeof value);
    }
    void visit(bool& value);
    void visit(std::string& value);
    /** An index or count: refused outside first … last. **/
    void visitWithin(int& value, int first, int last, const char* what);
    /** @pre `values` has the size that the model asks for; another one is refused. **/
    void visit(std::vector<double>& values);
    template <class A, class B, class... More>
    void visit(A& a, B& b, More&... more) {
        visit(a);
        visit(b);
        (visit(more), ...);
    }

    /** Number of elements of this many bytes, which must be there when reading. **/
    std::size_t visitSize(std::size_t size, std::size_t bytesEach);
    void visitBytes(void* data, std::size_t size);

    /** Refuses bytes that nobody has read. **/
    void requireEnd() const;

    /** @throws std::runtime_error **/
    [[noreturn]] static void refuse(const std::string& reason);

private:
    std::string m_bytes;
    std::size_t m_at = 0;
    bool m_isReading = false;
};

}  // namespace simflex
