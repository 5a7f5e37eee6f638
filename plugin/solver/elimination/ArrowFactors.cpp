#include "simflex/solver/elimination/ArrowFactors.h"

#include <algorithm>
#include <cmath>

namespace simflex {
namespace {

/** A x for six columns of A. **/
inline Chunk multiply(const Chunk* A, const Chunk& x) {
    Chunk even = A[0] * x[0], odd = A[1] * x[1];
    even += A[2] * x[2];
    odd += A[3] * x[3];
    even += A[4] * x[4];
    odd += A[5] * x[5];
    return even + odd;
}

inline Chunk loadSix(const double* values) {
    return Chunk{values[0], values[1], values[2], values[3], values[4], values[5], 0, 0};
}

/** A⁻¹ for symmetric positive definite A of size n ≤ 6, rows and columns from `first` on.
@returns false if A is not positive definite. **/
template <int Size>
bool invert(const double (&A)[6][6], int first, std::array<Chunk, 6>& inverse) {
    double L[Size][Size], invL[Size][Size];  // A = LLᵀ; lower triangles
    for (int j = 0; j < Size; ++j) {
        double pivot = A[first + j][first + j];
        for (int k = 0; k < j; ++k) pivot -= L[j][k] * L[j][k];
        if (!(pivot > 0) || !std::isfinite(pivot)) return false;
        invL[j][j] = 1 / std::sqrt(pivot);
        for (int i = j + 1; i < Size; ++i) {
            double sum = A[first + i][first + j];
            for (int k = 0; k < j; ++k) sum -= L[i][k] * L[j][k];
            L[i][j] = sum * invL[j][j];
        }
    }
    for (int j = 0; j < Size; ++j)
        for (int i = j + 1; i < Size; ++i) {
            double sum = 0;
            for (int k = j; k < i; ++k) sum -= L[i][k] * invL[k][j];
            invL[i][j] = sum * invL[i][i];
        }
    for (int j = 0; j < Size; ++j)
        for (int i = j; i < Size; ++i) {
            double sum = 0;
            for (int k = i; k < Size; ++k) sum += invL[k][i] * invL[k][j];
            inverse[size_t(first + j)][first + i] = inverse[size_t(first + i)][first + j] = sum;
        }
    return true;
}

/** The same for all six rows; rotation and translation apart where nothing couples them. **/
bool invertHead(const double (&H)[6][6], std::array<Chunk, 6>& inverse) {
    inverse.fill(Chunk{});
    bool isCoupled = H[4][3] != 0 || H[5][3] != 0 || H[5][4] != 0;
    for (int i = 3; i < 6; ++i)
        for (int j = 0; j < 3; ++j) isCoupled = isCoupled || H[i][j] != 0;
    if (isCoupled) return invert<6>(H, 0, inverse);
    for (int i = 3; i < 6; ++i) {
        if (!(H[i][i] > 0) || !std::isfinite(H[i][i])) return false;
        inverse[size_t(i)][i] = 1 / H[i][i];
    }
    return invert<3>(H, 0, inverse);
}

}  // namespace

ArrowFactors::ArrowFactors(const NewtonSystem::Block& block, PartFactors& part)
    : m_part(&part),
      m_numModes(part.numModes()),
      m_stride(part.getStride()),
      m_numColumns(block.numColumns()),
      m_columns(2 * block.rows.size(), Chunk{}),
      m_ownsColumns(block.columns == NewtonSystem::Block::Columns::Own),
      m_dE(3 * size_t(part.getStride())),
      m_products(3 * size_t(part.getNumProductRows())) {
    m_inverseHead.fill(Chunk{});
    if (m_ownsColumns) {
        m_g.assign(size_t(m_stride) * block.rows.size(), 0);
        m_dg = m_g;
    }
    for (const NewtonSystem::Side& side : block.sides) {
        m_frames.push_back(side.frame);
        for (const NewtonSystem::Side& other : block.sides)
            part.requestPair(side.frame, other.frame);
    }
    std::sort(m_frames.begin(), m_frames.end());
    m_frames.erase(std::unique(m_frames.begin(), m_frames.end()), m_frames.end());
    m_frameForces.assign(m_frames.size(), Chunk{});
    int column = 0;
    for (const NewtonSystem::Side& side : block.sides) {
        const int place =
            int(std::lower_bound(m_frames.begin(), m_frames.end(), side.frame) - m_frames.begin());
        m_sides.push_back({side.frame, place, column, column + side.numColumns});
        column += side.numColumns;
    }
}

bool ArrowFactors::condenseHead(const NewtonSystem::Block& block) {
    const int n = m_numModes;
    const double *E = block.coupling.data(), *inverseDiagonal = m_part->getInverseDiagonal();
    Chunk sums[6] = {};
    for (int i = 0; i < n; i += ChunkSize) {
        const int count = std::min(n - i, ChunkSize);
        const Chunk inverse = loadChunk(inverseDiagonal + i);
        Chunk columns[3];
        for (int a = 0, k = 0; a < 3; ++a) {
            columns[a] = loadChunk(E + a * n + i, count);
            const Chunk scaled = inverse * columns[a];
            storeChunk(scaled, m_dE.data() + a * m_stride + i);
            for (int b = 0; b <= a; ++b) sums[k++] += scaled * columns[b];
        }
    }
    double H[6][6];
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) H[i][j] = block.head[size_t(i + 6 * j)];
    for (int a = 0, k = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) H[a][b] -= sumChunk(sums[k++]);
    return invertHead(H, m_inverseHead);
}

void ArrowFactors::condenseColumns(const NewtonSystem::Block& block) {
    const double* E = block.coupling.data();
    const int rows = m_part->getNumProductRows();
    const double* const couplings[3] = {E, E + m_numModes, E + 2 * m_numModes};
    double* Q = m_products.data();  // (d⁻¹A)ᵀE
    double* const products[3] = {Q, Q + rows, Q + 2 * rows};
    m_part->multiplyByFlexibility(3, couplings, products);
    for (const Side& side : m_sides) {
        Chunk QTransposed[6];
        for (int c = 0; c < 6; ++c) {
            const double* row = Q + 6 * side.frame + c;
            QTransposed[c] = Chunk{row[0], row[rows], row[2 * rows], 0, 0, 0, 0, 0};
        }
        for (int k = side.firstColumn; k < side.endColumn; ++k) {
            const Chunk K = loadSix(block.coefficients.data() + 6 * k);
            m_columns[size_t(2 * k)] = K;
            m_columns[size_t(2 * k + 1)] =
                loadSix(block.Gt.data() + 6 * k) - multiply(QTransposed, K);
        }
    }
}

void ArrowFactors::condenseOwnColumns(const NewtonSystem::Block& block) {
    const double *E = block.coupling.data(), *inverseDiagonal = m_part->getInverseDiagonal();
    for (int k = 0; k < m_numColumns; ++k) {
        const double* column = block.Gt.data() + size_t(k) * size_t(block.size);
        double *g = m_g.data() + k * m_stride, *dg = m_dg.data() + k * m_stride;
        Chunk sums[3] = {};
        for (int i = 0; i < m_numModes; i += ChunkSize) {
            const int count = std::min(m_numModes - i, ChunkSize);
            const Chunk chunk = loadChunk(column + 6 + i, count);
            const Chunk scaled = loadChunk(inverseDiagonal + i) * chunk;
            storeChunk(chunk, g + i);
            storeChunk(scaled, dg + i);
            for (int a = 0; a < 3; ++a)
                sums[a] += loadChunk(E + a * m_numModes + i, count) * scaled;
        }
        m_columns[size_t(2 * k + 1)] =
            loadSix(column) -
            Chunk{sumChunk(sums[0]), sumChunk(sums[1]), sumChunk(sums[2]), 0, 0, 0, 0, 0};
    }
}

bool ArrowFactors::formOwnSchur(double* schur) const {
    const int m = m_numColumns;
    double sum = 0;
    for (int k = 0; k < m; ++k) {
        const Chunk Y = multiply(m_inverseHead.data(), m_columns[size_t(2 * k + 1)]);
        const double* dg = m_dg.data() + k * m_stride;
        for (int i = 0; i <= k; ++i) {
            const double* g = m_g.data() + i * m_stride;
            Chunk product = m_columns[size_t(2 * i + 1)] * Y;
            for (int j = 0; j < m_stride; j += ChunkSize)
                product += loadChunk(g + j) * loadChunk(dg + j);
            schur[i + m * k] = schur[k + m * i] = sumChunk(product);
            sum += schur[i + m * k];
        }
    }
    return std::isfinite(sum);
}

bool ArrowFactors::factor(const NewtonSystem::Block& block, double* schur) {
    if (!condenseHead(block)) return false;
    if (m_numColumns == 0) return true;
    if (m_ownsColumns) {
        condenseOwnColumns(block);
        return formOwnSchur(schur);
    }
    condenseColumns(block);
    return formSchur(schur);
}

bool ArrowFactors::formSchur(double* schur) const {
    const int m = m_numColumns;
    double sum = 0;
    for (const Side& side : m_sides)
        for (int k = side.firstColumn; k < side.endColumn; ++k) {
            const Chunk K = m_columns[size_t(2 * k)];
            const Chunk Y = multiply(m_inverseHead.data(), m_columns[size_t(2 * k + 1)]);
            for (const Side& other : m_sides) {
                if (other.firstColumn > k) break;
                const Chunk force = multiply(m_part->getCompliance(other.frame, side.frame), K);
                for (int i = other.firstColumn; i < std::min(other.endColumn, k + 1); ++i) {
                    const double entry = sumChunk(m_columns[size_t(2 * i)] * force +
                                                  m_columns[size_t(2 * i + 1)] * Y);
                    schur[i + m * k] = schur[k + m * i] = entry;
                    sum += entry;
                }
            }
        }
    return std::isfinite(sum);
}

void ArrowFactors::eliminate(const double* r, double* Gz) {
    const double* modes = r + 6;
    Chunk sums[3] = {};
    for (int i = 0; i < m_numModes; i += ChunkSize) {
        const Chunk chunk = loadChunk(modes + i, std::min(m_numModes - i, ChunkSize));
        for (int a = 0; a < 3; ++a) sums[a] += loadChunk(m_dE.data() + a * m_stride + i) * chunk;
    }
    const Chunk top{r[0] - sumChunk(sums[0]),
                    r[1] - sumChunk(sums[1]),
                    r[2] - sumChunk(sums[2]),
                    r[3],
                    r[4],
                    r[5],
                    0,
                    0};
    m_top = multiply(m_inverseHead.data(), top);
    if (m_numColumns == 0) return;
    if (m_ownsColumns) {
        for (int k = 0; k < m_numColumns; ++k) {
            const double* dg = m_dg.data() + k * m_stride;
            Chunk product = m_columns[size_t(2 * k + 1)] * m_top;
            for (int i = 0; i < m_numModes; i += ChunkSize)
                product +=
                    loadChunk(dg + i) * loadChunk(modes + i, std::min(m_numModes - i, ChunkSize));
            Gz[k] = sumChunk(product);
        }
        return;
    }
    double* products = m_products.data();
    m_part->multiplyByFlexibility(1, &modes, &products);
    for (const Side& side : m_sides) {
        const Chunk force = loadSix(products + 6 * side.frame);
        for (int k = side.firstColumn; k < side.endColumn; ++k)
            Gz[k] =
                sumChunk(m_columns[size_t(2 * k)] * force + m_columns[size_t(2 * k + 1)] * m_top);
    }
}

void ArrowFactors::substitute(const double* r, const double* lambda, double* deltaU) {
    Chunk columns{};
    std::fill(m_frameForces.begin(), m_frameForces.end(), Chunk{});
    for (const Side& side : m_sides)
        for (int k = side.firstColumn; k < side.endColumn; ++k) {
            m_frameForces[size_t(side.place)] += m_columns[size_t(2 * k)] * lambda[k];
            columns += m_columns[size_t(2 * k + 1)] * lambda[k];
        }
    if (m_ownsColumns)
        for (int k = 0; k < m_numColumns; ++k) columns += m_columns[size_t(2 * k + 1)] * lambda[k];
    Chunk top = multiply(m_inverseHead.data(), columns);
    if (r) top += m_top;
    storeChunk(-top, deltaU, 6);
    const double* inverseDiagonal = m_part->getInverseDiagonal();
    for (int i = 0; i < m_numModes; i += ChunkSize) {
        const int count = std::min(m_numModes - i, ChunkSize);
        Chunk delta{};
        if (r) delta = -loadChunk(inverseDiagonal + i) * loadChunk(r + 6 + i, count);
        for (int a = 0; a < 3; ++a) delta += loadChunk(m_dE.data() + a * m_stride + i) * top[a];
        for (int k = 0; m_ownsColumns && k < m_numColumns; ++k)
            delta -= loadChunk(m_dg.data() + k * m_stride + i) * lambda[k];
        for (size_t f = 0; f < m_frames.size(); ++f) {
            const double* flexibility = m_part->getFlexibility(m_frames[f]) + i;
            for (int a = 0; a < 6; ++a)
                delta -= loadChunk(flexibility + a * m_stride) * m_frameForces[f][a];
        }
        storeChunk(delta, deltaU + 6 + i, count);
    }
}

}  // namespace simflex
