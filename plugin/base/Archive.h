#pragma once
/** @file
Binary serialization. One visit() function of a class both writes and reads it, so the two cannot
diverge. Input is assumed to be damaged: a reader never allocates more memory than the input has
bytes. Internal.

    void visit(Archive& a, Frame& frame) { a.visit(frame.time, frame.q, frame.u); }

    Archive written;                              Archive read(written.getBytes());
    visit(written, frame);                        visit(read, other);   // the same
                                                  read.requireEnd();

Numbers are stored in this machine's representation, sizes in 64 bits. **/

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
    /** Creates an empty archive for writing. **/
    Archive() = default;
    /** Creates an archive that reads from these bytes. **/
    explicit Archive(std::string bytes)
        : m_isReading(true), m_left(bytes.size()), m_bytes(std::move(bytes)) {}
    virtual ~Archive() = default;
    Archive(const Archive&) = delete;
    Archive& operator=(const Archive&) = delete;

    bool isReading() const { return m_isReading; }

    /** @name Values. @throws std::runtime_error "it ends early", or another reason **/
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
    /** Visits an index. When reading, refuses values outside first … last. **/
    void visitWithin(int& value, int first, int last, const char* what);
    /** Visits a count, stored in 64 bits. Refuses negative values and values that do not fit an
    int. **/
    void visitCount(int& count);
    /**@}**/

    /** Visits the number of elements of this many bytes each. When reading, all of them must be
    present. **/
    std::size_t visitSize(std::size_t size, std::size_t bytesEach);
    void visitBytes(void* data, std::size_t size);

    /** Throws if fewer than `count` elements are left. @pre isReading() **/
    void requireLeft(std::uint64_t count, std::size_t bytesEach) const;
    /** Throws if unread bytes remain. **/
    void requireEnd() const;

    /** Returns the bytes written, or those being read. **/
    const std::string& getBytes() const { return m_bytes; }
    /** Returns the number of unread bytes. **/
    std::uint64_t getLeft() const { return m_left; }

protected:
    /** For archives that manage their own bytes. @param left  number of bytes to read **/
    Archive(bool isReading, std::uint64_t left) : m_isReading(isReading), m_left(left) {}
    /** @throws std::runtime_error with the reason **/
    [[noreturn]] virtual void fail(const std::string& reason) const;
    /** Writes bytes, or reads bytes known to be present. **/
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

/** @name Archive files: a line with kind, byte order, version and length, the bytes, and their
checksum **/
/**@{**/
/** @throws std::runtime_error if the stream cannot be written. **/
void writeArchive(std::ostream& stream, const std::string& kind, std::uint32_t version,
                  const std::string& bytes);
/** @returns the bytes. @throws std::runtime_error if the archive has another kind or version, is
truncated or damaged. **/
std::string readArchive(std::istream& stream, const std::string& kind, std::uint32_t version);
/**@}**/

}  // namespace simflex
