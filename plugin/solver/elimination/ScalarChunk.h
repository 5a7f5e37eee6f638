#pragma once
/** @file
Chunks of the elimination's scalars, real or complex (private header). Eight complex numbers are two
chunks, real and imaginary parts; products do not conjugate. **/

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <type_traits>

#include "simflex/base/Chunk.h"

namespace simflex {

using Complex = std::complex<double>;

struct ComplexChunk {
    Chunk re, im;
};

template <class Scalar>
constexpr bool IsReal = std::is_same_v<Scalar, double>;

template <class Scalar>
using ChunkOf = std::conditional_t<IsReal<Scalar>, Chunk, ComplexChunk>;

inline ComplexChunk operator+(const ComplexChunk& a, const ComplexChunk& b) {
    return {a.re + b.re, a.im + b.im};
}
inline ComplexChunk operator-(const ComplexChunk& a, const ComplexChunk& b) {
    return {a.re - b.re, a.im - b.im};
}
inline ComplexChunk operator-(const Chunk& a, const ComplexChunk& b) {
    return {a - b.re, -b.im};
}
inline ComplexChunk operator-(const ComplexChunk& a) {
    return {-a.re, -a.im};
}
inline ComplexChunk operator*(const ComplexChunk& a, const ComplexChunk& b) {
    return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
inline ComplexChunk operator*(const ComplexChunk& a, const Chunk& b) {
    return {a.re * b, a.im * b};
}
inline ComplexChunk operator*(const Chunk& a, const ComplexChunk& b) {
    return {a * b.re, a * b.im};
}
inline ComplexChunk operator*(const ComplexChunk& a, double b) {
    return {a.re * b, a.im * b};
}
inline ComplexChunk operator*(const ComplexChunk& a, const Complex& b) {
    return {a.re * b.real() - a.im * b.imag(), a.re * b.imag() + a.im * b.real()};
}
inline ComplexChunk operator*(const Chunk& a, const Complex& b) {
    return {a * b.real(), a * b.imag()};
}
inline ComplexChunk& operator+=(ComplexChunk& a, const ComplexChunk& b) {
    return a = a + b;
}
inline ComplexChunk& operator-=(ComplexChunk& a, const ComplexChunk& b) {
    return a = a - b;
}

inline Complex getEntry(const ComplexChunk& chunk, int k) {
    return {chunk.re[k], chunk.im[k]};
}

inline void setEntry(ComplexChunk& chunk, int k, const Complex& value) {
    setEntry(chunk.re, k, value.real());
    setEntry(chunk.im, k, value.imag());
}

inline Complex sumChunk(const ComplexChunk& chunk) {
    return {sumChunk(chunk.re), sumChunk(chunk.im)};
}

inline ComplexChunk loadChunk(const Complex* values, int count) {
    const double* entries = reinterpret_cast<const double*>(values);
    const Chunk a = loadChunk(entries, std::min(2 * count, ChunkSize));
    const Chunk b = loadChunk(entries + ChunkSize, std::max(2 * count - ChunkSize, 0));
    return {makeChunk(a[0], a[2], a[4], a[6], b[0], b[2], b[4], b[6]),
            makeChunk(a[1], a[3], a[5], a[7], b[1], b[3], b[5], b[7])};
}

inline void storeChunk(const ComplexChunk& chunk, Complex* values, int count) {
    const Chunk &re = chunk.re, &im = chunk.im;
    double* entries = reinterpret_cast<double*>(values);
    storeChunk(makeChunk(re[0], im[0], re[1], im[1], re[2], im[2], re[3], im[3]), entries,
               std::min(2 * count, ChunkSize));
    storeChunk(makeChunk(re[4], im[4], re[5], im[5], re[6], im[6], re[7], im[7]),
               entries + ChunkSize, std::max(2 * count - ChunkSize, 0));
}

inline Chunk loadSix(const double* values) {
    return loadChunk(values, 6);
}
inline ComplexChunk loadSix(const Complex* values) {
    return loadChunk(values, 6);
}

inline bool isFinite(double value) {
    return std::isfinite(value);
}
inline bool isFinite(const Complex& value) {
    return std::isfinite(value.real()) && std::isfinite(value.imag());
}

/** |z|, without protection against overflow and underflow. **/
inline double magnitude(double value) {
    return std::abs(value);
}
inline double magnitude(const Complex& value) {
    return std::sqrt(value.real() * value.real() + value.imag() * value.imag());
}

inline Chunk invertChunk(const Chunk& chunk) {
    return 1 / chunk;
}
inline ComplexChunk invertChunk(const ComplexChunk& chunk) {
    const Chunk scale = 1 / (chunk.re * chunk.re + chunk.im * chunk.im);
    return {chunk.re * scale, -chunk.im * scale};
}

/** One column of PaddedColumns.
@tparam Number  double, const where the column is **/
template <class Scalar, class Number>
class PaddedColumn {
public:
    PaddedColumn(Number* values, int stride) : m_values(values), m_stride(stride) {}

    /** Eight rows. **/
    ChunkOf<Scalar> load(int row) const {
        if constexpr (IsReal<Scalar>)
            return loadChunk(m_values + row);
        else
            return {loadChunk(m_values + row), loadChunk(m_values + m_stride + row)};
    }
    void store(const ChunkOf<Scalar>& chunk, int row) const {
        if constexpr (IsReal<Scalar>) {
            storeChunk(chunk, m_values + row);
        } else {
            storeChunk(chunk.re, m_values + row);
            storeChunk(chunk.im, m_values + m_stride + row);
        }
    }

    Scalar get(int row) const {
        if constexpr (IsReal<Scalar>)
            return m_values[row];
        else
            return {m_values[row], m_values[m_stride + row]};
    }
    void set(int row, const Scalar& value) const {
        if constexpr (IsReal<Scalar>) {
            m_values[row] = value;
        } else {
            m_values[row] = value.real();
            m_values[m_stride + row] = value.imag();
        }
    }

    /** The first `count` rows. **/
    void copyFrom(const double* values, int count) const {
        std::copy_n(values, count, m_values);
        if (!IsReal<Scalar>) std::fill_n(m_values + m_stride, count, 0.0);
    }
    void copyFrom(const Complex* values, int count) const {
        for (int i = 0; i < count; ++i) set(i, values[i]);
    }
    template <class Other>
    void copyFrom(const PaddedColumn<Scalar, Other>& column, int count) const {
        std::copy_n(column.m_values, count, m_values);
        if (!IsReal<Scalar>)
            std::copy_n(column.m_values + column.m_stride, count, m_values + m_stride);
    }
    void copyTo(Scalar* values, int count) const {
        if constexpr (IsReal<Scalar>)
            std::copy_n(m_values, count, values);
        else
            for (int i = 0; i < count; ++i) values[i] = get(i);
    }
    void clear(int first, int end) const {
        for (int i = first; i < end; ++i) set(i, 0);
    }

private:
    template <class, class>
    friend class PaddedColumn;

    Number* m_values;
    int m_stride;
};

/** Columns of equal height, padded with zeros to whole chunks. Complex columns are two columns of
doubles, real and imaginary parts. **/
template <class Scalar>
class PaddedColumns {
public:
    static constexpr int numPlanes = IsReal<Scalar> ? 1 : 2;
    using Column = PaddedColumn<Scalar, double>;
    using ConstColumn = PaddedColumn<Scalar, const double>;

    PaddedColumns() = default;
    PaddedColumns(int height, int numColumns) { resize(height, numColumns); }

    /** Zeroes all entries if the size changes. **/
    void resize(int height, int numColumns) {
        m_stride = roundUpToChunks(height);
        const Eigen::Index size = Eigen::Index(m_stride) * numPlanes * numColumns;
        if (m_values.size() != size) m_values.setZero(size);
    }

    int paddedHeight() const { return m_stride; }

    Column operator[](int column) { return {plane(numPlanes * column), m_stride}; }
    ConstColumn operator[](int column) const { return {plane(numPlanes * column), m_stride}; }

    /** Real columns that these are. **/
    double* plane(int k) { return m_values.data() + k * m_stride; }
    const double* plane(int k) const { return m_values.data() + k * m_stride; }

private:
    int m_stride = 0;
    Eigen::VectorXd m_values;  ///< aligned
};

}  // namespace simflex
