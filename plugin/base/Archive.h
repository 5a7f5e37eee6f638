#pragma once
/** @file
Values as bytes and back. One visit() of a class both writes and reads it, so that the two cannot
differ; what is read is taken for damaged by anybody, and never asks for more memory than it has
bytes. Internal.

    void visit(Archive& a, Frame& frame) { a.visit(frame.time, frame.q, frame.u); }

    Archive written;                              Archive read(written.getBytes());
    visit(written, frame);                        visit(read, other);   // the same
                                                  read.requireEnd();

Numbers stand as this machine has them, sizes in 64 bits. **/

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace simflex {

class Archive {
public:
    /** Empty, to write into. **/
    Archive() = default;
    /** To read from. **/
    explicit Archive(std::string bytes)
        : m_isReading(true), m_left(bytes.size()), m_bytes(std::move(bytes)) {}
    virtual ~Archive() = default;
    Archive(const Archive&) = delete;
    Archive& operator=(const Archive&) = delete;

    bool isReading() const { return m_isReading; }

    /** @name Values. @throws std::runtime_error "it ends early", or what else is wrong **/
    /**@{**/
    template <class T>
    std::enable_if_t<std::is_arithmetic_v<T>> visit(T& value) {
        visitBytes(&value, sizeof value);
    }
    void visit(bool& value);
    void visit(std::string& value);
    virtual void visit(std::vector<double>& values) { visitList(values); }
    template <class T>
    void visit(std::vector<T>& values) {
        visitList(values);
    }
    template <class A, class B, class... More>
    void visit(A& a, B& b, More&... more) {
        visit(a);
        visit(b);
        (visit(more), ...);
    }
    /** An index: refused outside first … last. **/
    void visitWithin(int& value, int first, int last, const char* what);
    /** A number of things, in 64 bits: refused if it is negative or no int. **/
    void visitCount(int& count);
    /**@}**/

    /** Number of elements of this many bytes, which must be there when reading. **/
    std::size_t visitSize(std::size_t size, std::size_t bytesEach);
    void visitBytes(void* data, std::size_t size);

    /** Refuses to go on if so many elements cannot follow. @pre isReading() **/
    void requireLeft(std::uint64_t count, std::size_t bytesEach) const;
    /** Refuses bytes that nobody has read. **/
    void requireEnd() const;

    /** What was written; what is read from. **/
    const std::string& getBytes() const { return m_bytes; }
    /** Bytes that have not been read. **/
    std::uint64_t getLeft() const { return m_left; }

protected:
    /** For archives that keep their bytes themselves. @param left  to be read **/
    Archive(bool isReading, std::uint64_t left) : m_isReading(isReading), m_left(left) {}
    /** @throws std::runtime_error of the reason **/
    [[noreturn]] virtual void fail(const std::string& reason) const;
    /** Writes bytes, or reads them, which are there. **/
    virtual void move(void* data, std::size_t size);

private:
    template <class T>
    void visitList(std::vector<T>& values) {
        constexpr bool isPlain = std::is_arithmetic_v<T>;
        values.resize(visitSize(values.size(), isPlain ? sizeof(T) : sizeof(std::uint64_t)));
        if constexpr (isPlain)
            visitBytes(values.data(), values.size() * sizeof(T));
        else
            for (T& value : values) visit(value);
    }

    bool m_isReading = false;
    std::uint64_t m_left = 0;
    std::string m_bytes;
};

/** @name Files of an archive: a line that names their kind, byte order, version, length, the bytes,
and their checksum **/
/**@{**/
/** @throws std::runtime_error if the stream cannot take it. **/
void writeArchive(std::ostream& stream, const std::string& kind, std::uint32_t version,
                  const std::string& bytes);
/** @returns the bytes. @throws std::runtime_error if it is of another kind or version, cut off or
damaged. **/
std::string readArchive(std::istream& stream, const std::string& kind, std::uint32_t version);
/**@}**/

}  // namespace simflex
