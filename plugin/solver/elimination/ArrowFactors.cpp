#include "simflex/solver/elimination/ArrowFactors.h"

#include <algorithm>
#include <cmath>

namespace simflex {
namespace {

/** A x for six columns of A. **/
template <class Column>
inline Column multiply(const Column* A, const Chunk& x) {
    Column even = A[0] * x[0], odd = A[1] * x[1];
    even += A[2] * x[2];
    odd += A[3] * x[3];
    even += A[4] * x[4];
    odd += A[5] * x[5];
    return even + odd;
}

inline ComplexChunk multiply(const ComplexChunk* A, const ComplexChunk& x) {
    ComplexChunk even = A[0] * getEntry(x, 0), odd = A[1] * getEntry(x, 1);
    even += A[2] * getEntry(x, 2);
    odd += A[3] * getEntry(x, 3);
    even += A[4] * getEntry(x, 4);
    odd += A[5] * getEntry(x, 5);
    return even + odd;
}

bool isPivot(double value) {
    return value > 0 && std::isfinite(value);
}
bool isPivot(const Complex& value) {
    return magnitude(value) > 0 && isFinite(value);
}

double invertScalar(double value) {
    return 1 / value;
}
Complex invertScalar(const Complex& value) {
    return std::conj(value) / std::norm(value);
}

double takeRoot(double value) {
    return std::sqrt(value);
}
/** Either square root. **/
Complex takeRoot(const Complex& value) {
    const double half = std::sqrt(0.5 * (magnitude(value) + std::abs(value.real())));
    const double other = value.imag() / (2 * half);
    return value.real() >= 0 ? Complex(half, other) : Complex(other, half);
}

/** A⁻¹ of a symmetric A of size n ≤ 6, positive definite or complex with such a real part, rows and
columns from `first` on.
@returns false if a pivot shows otherwise. **/
template <int Size, class Scalar>
bool invert(const Scalar (&A)[6][6], int first, Scalar (&inverse)[6][6]) {
    Scalar L[Size][Size], invL[Size][Size];  // A = LLᵀ; lower triangles
    for (int j = 0; j < Size; ++j) {
        Scalar pivot = A[first + j][first + j];
        for (int k = 0; k < j; ++k) pivot -= L[j][k] * L[j][k];
        if (!isPivot(pivot)) return false;
        invL[j][j] = invertScalar(takeRoot(pivot));
        for (int i = j + 1; i < Size; ++i) {
            Scalar sum = A[first + i][first + j];
            for (int k = 0; k < j; ++k) sum -= L[i][k] * L[j][k];
            L[i][j] = sum * invL[j][j];
        }
    }
    for (int j = 0; j < Size; ++j)
        for (int i = j + 1; i < Size; ++i) {
            Scalar sum = 0;
            for (int k = j; k < i; ++k) sum -= L[i][k] * invL[k][j];
            invL[i][j] = sum * invL[i][i];
        }
    for (int j = 0; j < Size; ++j)
        for (int i = j; i < Size; ++i) {
            Scalar sum = 0;
            for (int k = i; k < Size; ++k) sum += invL[k][i] * invL[k][j];
            inverse[first + j][first + i] = inverse[first + i][first + j] = sum;
        }
    return true;
}

/** The same for all six rows; rotation and translation apart where nothing couples them. **/
template <class Scalar>
bool invertHead(const Scalar (&H)[6][6], Scalar (&inverse)[6][6]) {
    bool isCoupled = H[4][3] != 0.0 || H[5][3] != 0.0 || H[5][4] != 0.0;
    for (int i = 3; i < 6; ++i)
        for (int j = 0; j < 3; ++j) isCoupled = isCoupled || H[i][j] != 0.0;
    if (isCoupled) return invert<6>(H, 0, inverse);
    for (int i = 3; i < 6; ++i) {
        if (!isPivot(H[i][i])) return false;
        inverse[i][i] = invertScalar(H[i][i]);
    }
    return invert<3>(H, 0, inverse);
}

}  // namespace

template <class Scalar>
ArrowFactors<Scalar>::ArrowFactors(const Block& block, PartFactors<Scalar>& part)
    : m_part(&part),
      m_numModes(part.numModes()),
      m_numColumns(block.numColumns()),
      m_Y(block.rows.size(), ScalarChunk{}),
      m_ownsColumns(block.columns == NewtonBlock::Columns::Own),
      m_dE(part.numModes(), 3),
      m_products(part.getNumProductRows(), 3) {
    m_inverseHead.fill(ScalarChunk{});
    if (m_ownsColumns) {
        m_g.resize(m_numModes, m_numColumns);
        m_dg.resize(m_numModes, m_numColumns);
    } else {
        m_K.assign(block.rows.size(), Chunk{});
        if (!IsReal<Scalar>) m_dr.resize(m_numModes, 1);
    }
    for (const NewtonBlock::Side& side : block.sides) {
        m_frames.push_back(side.frame);
        for (const NewtonBlock::Side& other : block.sides)
            part.requestPair(side.frame, other.frame);
    }
    std::sort(m_frames.begin(), m_frames.end());
    m_frames.erase(std::unique(m_frames.begin(), m_frames.end()), m_frames.end());
    m_frameForces.assign(m_frames.size(), ScalarChunk{});
    int column = 0;
    for (const NewtonBlock::Side& side : block.sides) {
        const int place =
            int(std::lower_bound(m_frames.begin(), m_frames.end(), side.frame) - m_frames.begin());
        m_sides.push_back({side.frame, place, column, column + side.numColumns});
        column += side.numColumns;
    }
}

template <class Scalar>
bool ArrowFactors<Scalar>::condenseHead(const Block& block) {
    const int n = m_numModes;
    const Scalar* E = block.coupling.data();
    const auto inverseDiagonal = m_part->getInverseDiagonal()[0];
    const typename PaddedColumns<Scalar>::Column dE[3] = {m_dE[0], m_dE[1], m_dE[2]};
    ScalarChunk sums[6] = {};
    for (int i = 0; i < n; i += ChunkSize) {
        const int count = std::min(n - i, ChunkSize);
        const ScalarChunk inverse = inverseDiagonal.load(i);
        ScalarChunk columns[3];
        for (int a = 0, k = 0; a < 3; ++a) {
            columns[a] = loadChunk(E + a * n + i, count);
            const ScalarChunk scaled = inverse * columns[a];
            dE[a].store(scaled, i);
            for (int b = 0; b <= a; ++b) sums[k++] += scaled * columns[b];
        }
    }
    Scalar H[6][6], inverse[6][6] = {};
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) H[i][j] = block.head[size_t(i + 6 * j)];
    for (int a = 0, k = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) H[a][b] -= sumChunk(sums[k++]);
    if (!invertHead(H, inverse)) return false;
    for (int j = 0; j < 6; ++j) m_inverseHead[size_t(j)] = loadSix(inverse[j]);
    return true;
}

template <class Scalar>
void ArrowFactors<Scalar>::multiplyByFlexibility(int count, const Scalar* const* x,
                                                 const PaddedColumns<Scalar>& scaled) {
    const double* factors[6];
    double* products[6];
    for (int k = 0; k < PaddedColumns<Scalar>::numPlanes * count; ++k) {
        if constexpr (IsReal<Scalar>)
            factors[k] = x[k];
        else
            factors[k] = scaled.plane(k);
        products[k] = m_products.plane(k);
    }
    m_part->multiplyTransposed(PaddedColumns<Scalar>::numPlanes * count, factors, products);
}

template <class Scalar>
void ArrowFactors<Scalar>::condenseColumns(const Block& block) {
    const Scalar* E = block.coupling.data();
    const Scalar* const couplings[3] = {E, E + m_numModes, E + 2 * m_numModes};
    multiplyByFlexibility(3, couplings, m_dE);
    for (const Side& side : m_sides) {
        ScalarChunk QTransposed[6];  // (d⁻¹A)ᵀE
        for (int c = 0; c < 6; ++c) {
            const int row = 6 * side.frame + c;
            const Scalar entries[6] = {m_products[0].get(row), m_products[1].get(row),
                                       m_products[2].get(row)};
            QTransposed[c] = loadSix(entries);
        }
        for (int k = side.firstColumn; k < side.endColumn; ++k) {
            const Chunk K = loadSix(block.coefficients.data() + 6 * k);
            m_K[size_t(k)] = K;
            m_Y[size_t(k)] = loadSix(block.Gt.data() + 6 * k) - multiply(QTransposed, K);
        }
    }
}

template <class Scalar>
void ArrowFactors<Scalar>::condenseOwnColumns(const Block& block) {
    const Scalar* E = block.coupling.data();
    const auto inverseDiagonal = m_part->getInverseDiagonal()[0];
    for (int k = 0; k < m_numColumns; ++k) {
        const double* column = block.Gt.data() + size_t(k) * size_t(block.size);
        const auto g = m_g[k];
        const auto dg = m_dg[k];
        ScalarChunk sums[3] = {};
        for (int i = 0; i < m_numModes; i += ChunkSize) {
            const int count = std::min(m_numModes - i, ChunkSize);
            const Chunk chunk = loadChunk(column + 6 + i, count);
            const ScalarChunk scaled = inverseDiagonal.load(i) * chunk;
            g.store(chunk, i);
            dg.store(scaled, i);
            for (int a = 0; a < 3; ++a)
                sums[a] += loadChunk(E + a * m_numModes + i, count) * scaled;
        }
        const Scalar modal[6] = {sumChunk(sums[0]), sumChunk(sums[1]), sumChunk(sums[2])};
        m_Y[size_t(k)] = loadSix(column) - loadSix(modal);
    }
}

template <class Scalar>
bool ArrowFactors<Scalar>::formOwnSchur(Scalar* schur) const {
    const int m = m_numColumns;
    Scalar sum = 0;
    for (int k = 0; k < m; ++k) {
        const ScalarChunk Y = multiply(m_inverseHead.data(), m_Y[size_t(k)]);
        const auto dg = m_dg[k];
        for (int i = 0; i <= k; ++i) {
            ScalarChunk product = m_Y[size_t(i)] * Y;
            for (int j = 0; j < m_numModes; j += ChunkSize) product += m_g[i].load(j) * dg.load(j);
            schur[i + m * k] = schur[k + m * i] = sumChunk(product);
            sum += schur[i + m * k];
        }
    }
    return isFinite(sum);
}

template <class Scalar>
bool ArrowFactors<Scalar>::factor(const Block& block, Scalar* schur) {
    if (!condenseHead(block)) return false;
    if (m_numColumns == 0) return true;
    if (m_ownsColumns) {
        condenseOwnColumns(block);
        return formOwnSchur(schur);
    }
    condenseColumns(block);
    return formSchur(schur);
}

template <class Scalar>
bool ArrowFactors<Scalar>::formSchur(Scalar* schur) const {
    const int m = m_numColumns;
    Scalar sum = 0;
    for (const Side& side : m_sides)
        for (int k = side.firstColumn; k < side.endColumn; ++k) {
            const Chunk K = m_K[size_t(k)];
            const ScalarChunk Y = multiply(m_inverseHead.data(), m_Y[size_t(k)]);
            for (const Side& other : m_sides) {
                if (other.firstColumn > k) break;
                const ScalarChunk force =
                    multiply(m_part->getCompliance(other.frame, side.frame), K);
                for (int i = other.firstColumn; i < std::min(other.endColumn, k + 1); ++i) {
                    const Scalar entry = sumChunk(m_K[size_t(i)] * force + m_Y[size_t(i)] * Y);
                    schur[i + m * k] = schur[k + m * i] = entry;
                    sum += entry;
                }
            }
        }
    return isFinite(sum);
}

template <class Scalar>
void ArrowFactors<Scalar>::eliminate(const Scalar* r, Scalar* Gz) {
    const Scalar* modes = r + 6;
    ScalarChunk sums[3] = {};
    for (int i = 0; i < m_numModes; i += ChunkSize) {
        const ScalarChunk chunk = loadChunk(modes + i, std::min(m_numModes - i, ChunkSize));
        for (int a = 0; a < 3; ++a) sums[a] += m_dE[a].load(i) * chunk;
        if (!IsReal<Scalar> && !m_ownsColumns)
            m_dr[0].store(m_part->getInverseDiagonal()[0].load(i) * chunk, i);
    }
    const Scalar top[6] = {r[0] - sumChunk(sums[0]),
                           r[1] - sumChunk(sums[1]),
                           r[2] - sumChunk(sums[2]),
                           r[3],
                           r[4],
                           r[5]};
    m_top = multiply(m_inverseHead.data(), loadSix(top));
    if (m_numColumns == 0) return;
    if (m_ownsColumns) {
        for (int k = 0; k < m_numColumns; ++k) {
            ScalarChunk product = m_Y[size_t(k)] * m_top;
            for (int i = 0; i < m_numModes; i += ChunkSize)
                product +=
                    m_dg[k].load(i) * loadChunk(modes + i, std::min(m_numModes - i, ChunkSize));
            Gz[k] = sumChunk(product);
        }
        return;
    }
    multiplyByFlexibility(1, &modes, m_dr);
    for (const Side& side : m_sides) {
        Scalar entries[6];
        for (int c = 0; c < 6; ++c) entries[c] = m_products[0].get(6 * side.frame + c);
        const ScalarChunk force = loadSix(entries);
        for (int k = side.firstColumn; k < side.endColumn; ++k)
            Gz[k] = sumChunk(m_K[size_t(k)] * force + m_Y[size_t(k)] * m_top);
    }
}

template <class Scalar>
void ArrowFactors<Scalar>::prefetch() const {
    constexpr size_t LineSize = 64;
    const auto ask = [](const auto* values, size_t count) {
        const char* bytes = reinterpret_cast<const char*>(values);
        for (size_t i = 0; i < count * sizeof *values; i += LineSize) __builtin_prefetch(bytes + i);
    };
    ask(this, 1);
    ask(m_dE.plane(0), size_t(3 * PaddedColumns<Scalar>::numPlanes * m_dE.paddedHeight()));
    ask(m_Y.data(), m_Y.size());
    ask(m_K.data(), m_K.size());
}

template <class Scalar>
void ArrowFactors<Scalar>::substitute(const Scalar* r, const Scalar* lambda, Scalar* deltaU) {
    ScalarChunk columns{};
    std::fill(m_frameForces.begin(), m_frameForces.end(), ScalarChunk{});
    for (const Side& side : m_sides)
        for (int k = side.firstColumn; k < side.endColumn; ++k) {
            m_frameForces[size_t(side.place)] += m_K[size_t(k)] * lambda[k];
            columns += m_Y[size_t(k)] * lambda[k];
        }
    if (m_ownsColumns)
        for (int k = 0; k < m_numColumns; ++k) columns += m_Y[size_t(k)] * lambda[k];
    ScalarChunk top = multiply(m_inverseHead.data(), columns);
    if (r) top += m_top;
    storeChunk(-top, deltaU, 6);
    const int stride = m_part->getStride();
    for (int i = 0; i < m_numModes; i += ChunkSize) {
        const int count = std::min(m_numModes - i, ChunkSize);
        const ScalarChunk inverse = m_part->getInverseDiagonal()[0].load(i);
        ScalarChunk delta{};
        if (r) delta = -inverse * loadChunk(r + 6 + i, count);
        for (int a = 0; a < 3; ++a) delta += m_dE[a].load(i) * getEntry(top, a);
        for (int k = 0; m_ownsColumns && k < m_numColumns; ++k)
            delta -= m_dg[k].load(i) * lambda[k];
        ScalarChunk load{};  // of complex parts, before d⁻¹
        for (size_t f = 0; f < m_frames.size(); ++f) {
            const double* A = m_part->getColumns(m_frames[f]) + i;
            for (int a = 0; a < 6; ++a) {
                const ScalarChunk share = loadChunk(A + a * stride) * getEntry(m_frameForces[f], a);
                if (IsReal<Scalar>)
                    delta -= share;
                else
                    load += share;
            }
        }
        if (!IsReal<Scalar>) delta -= inverse * load;
        storeChunk(delta, deltaU + 6 + i, count);
    }
}

template class ArrowFactors<double>;
template class ArrowFactors<Complex>;

}  // namespace simflex
