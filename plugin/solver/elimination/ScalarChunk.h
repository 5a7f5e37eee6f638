#pragma once
/** @file
Chunks of the elimination's scalars, real or complex (private header). Eight complex numbers are two
chunks, their real and their imaginary parts; a product conjugates nothing. **/

#include <Eigen/Dense>
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

inline double getEntry(const Chunk& chunk, int k) {
    return chunk[k];
}
inline Complex getEntry(const ComplexChunk& chunk, int k) {
    return {chunk.re[k], chunk.im[k]};
}

inline void setEntry(Chunk& chunk, int k, double value) {
    chunk[k] = value;
}
inline void setEntry(ComplexChunk& chunk, int k, const Complex& value) {
    chunk.re[k] = value.real();
    chunk.im[k] = value.imag();
}

inline Complex sumChunk(const ComplexChunk& chunk) {
    return {sumChunk(chunk.re), sumChunk(chunk.im)};
}

inline ComplexChunk loadChunk(const Complex* values, int count) {
    double re[ChunkSize], im[ChunkSize];
    for (int k = 0; k < ChunkSize; ++k) {
        re[k] = k < count ? values[k].real() : 0.0;
        im[k] = k < count ? values[k].imag() : 0.0;
    }
    return {loadChunk(re), loadChunk(im)};
}

inline void storeChunk(const ComplexChunk& chunk, Complex* values, int count) {
    for (int k = 0; k < ChunkSize; ++k)
        if (k < count) values[k] = getEntry(chunk, k);
}

inline Chunk loadSix(const double* values) {
    return Chunk{values[0], values[1], values[2], values[3], values[4], values[5], 0, 0};
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

/** |z|, without care for the ends of the range. **/
inline double magnitude(double value) {
    return std::abs(value);
}
inline double magnitude(const Complex& value) {
    return std::sqrt(value.real() * value.real() + value.imag() * value.imag());
}

/** Columns of equal height, padded with zeros to whole chunks. Complex ones are two columns of
 * doubles, real parts and imaginary parts. **/
template <class Scalar>
class PaddedColumns {
public:
    static constexpr int numPlanes = IsReal<Scalar> ? 1 : 2;

    PaddedColumns() = default;
    PaddedColumns(int height, int numColumns) { resize(height, numColumns); }

    /** All zero if the size changes. **/
    void resize(int height, int numColumns) {
        const size_t stride = size_t(roundUpToChunks(height));
        const size_t size = stride * size_t(numPlanes * numColumns);
        if (m_stride == int(stride) && m_values.size() == Eigen::Index(size)) return;
        m_stride = int(stride);
        m_values.setZero(Eigen::Index(size));
    }

    int paddedHeight() const { return m_stride; }

    /** Real columns that these are. **/
    double* plane(int k) { return m_values.data() + k * m_stride; }
    const double* plane(int k) const { return m_values.data() + k * m_stride; }

    /** Eight rows of a column. **/
    ChunkOf<Scalar> load(int column, int row) const {
        const double* values = plane(numPlanes * column) + row;
        if constexpr (IsReal<Scalar>)
            return loadChunk(values);
        else
            return {loadChunk(values), loadChunk(values + m_stride)};
    }
    void store(const ChunkOf<Scalar>& chunk, int column, int row) {
        double* values = plane(numPlanes * column) + row;
        if constexpr (IsReal<Scalar>) {
            storeChunk(chunk, values);
        } else {
            storeChunk(chunk.re, values);
            storeChunk(chunk.im, values + m_stride);
        }
    }

    Scalar get(int column, int row) const {
        const double* values = plane(numPlanes * column) + row;
        if constexpr (IsReal<Scalar>)
            return *values;
        else
            return {*values, values[m_stride]};
    }
    void set(int column, int row, const Scalar& value) {
        double* values = plane(numPlanes * column) + row;
        if constexpr (IsReal<Scalar>) {
            *values = value;
        } else {
            *values = value.real();
            values[m_stride] = value.imag();
        }
    }

    /** The first `count` rows of a column. **/
    void setColumn(int column, const Scalar* values, int count) {
        for (int i = 0; i < count; ++i) set(column, i, values[i]);
    }
    void getColumn(int column, Scalar* values, int count) const {
        for (int i = 0; i < count; ++i) values[i] = get(column, i);
    }

private:
    int m_stride = 0;
    Eigen::VectorXd m_values;  ///< aligned
};

}  // namespace simflex
