#include "solver/RandomNewtonSystem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "support/NewtonReference.h"

namespace simflex::test {
namespace {

using Eigen::Map;
using Eigen::MatrixXd;
using Block = NewtonSystem::Block;

class Generator {
public:
    Generator(std::mt19937& random, const RandomSystemOptions& options)
        : m_random(random), m_options(options) {}

    NewtonSystem make() {
        makeParts();
        makeBodies();
        makeJoints();
        for (int k = 0; k < m_options.numCopiedRows; ++k) copyRow();
        for (double& value : m_system.c) value = uniform();
        m_system.r.resize(size_t(m_system.numSpeeds()));
        for (double& value : m_system.r) value = uniform();
        for (const auto& [copy, original] : m_copies)
            m_system.c[size_t(copy)] = m_system.c[size_t(original)];
        for (Block& block : m_system.blocks) fillMatrix(block);
        return m_system;
    }

private:
    double uniform() { return std::uniform_real_distribution<double>(-1, 1)(m_random); }
    int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(m_random); }
    MatrixXd randomMatrix(int rows, int columns) {
        return MatrixXd::NullaryExpr(rows, columns, [&] { return uniform(); });
    }

    void makeParts() {
        for (int p = 0; m_options.mostModes > 0 && p < 3; ++p) {
            NewtonSystem::Part part;
            part.numModes = pick(1, m_options.mostModes);
            part.numFrames = pick(1, 4);
            for (int i = 0; i < part.numModes; ++i)  // increasingly stiff modes
                part.diagonal.push_back((1.5 + uniform()) * std::pow(1.2, i));
            auto shapes = std::make_shared<std::vector<double>>();
            for (int k = 0; k < 6 * part.numModes * part.numFrames; ++k)
                shapes->push_back(uniform());
            part.shapes = shapes;
            m_system.parts.push_back(part);
        }
    }

    void makeBodies() {
        m_system.blocks.resize(size_t(m_options.numBodies));
        for (Block& block : m_system.blocks) {
            if (!m_system.parts.empty() && pick(0, 2) > 0) {
                const int part = pick(0, int(m_system.parts.size()) - 1);
                const int numModes = m_system.parts[size_t(part)].numModes;
                if (pick(0, 2) == 0)
                    block.resize(part, numModes, std::vector<int>());
                else
                    block.resize(part, numModes, {}, {});
            } else {
                block.resize(pick(6, 9), {});
            }
        }
    }

    std::vector<std::pair<int, int>> listJoints() {
        const int n = m_options.numBodies, side = std::max(1, int(std::sqrt(n)));
        std::vector<std::pair<int, int>> pairs;
        if (m_options.graph != Graph::Random) pairs.emplace_back(-1, 0);
        for (int b = 1; b < n; ++b) {
            switch (m_options.graph) {
                case Graph::Chain:
                case Graph::Ring:
                    pairs.emplace_back(b - 1, b);
                    break;
                case Graph::Tree:
                    pairs.emplace_back(pick(0, b - 1), b);
                    break;
                case Graph::Star:
                    pairs.emplace_back(0, b);
                    break;
                case Graph::Grid:
                    if (b % side) pairs.emplace_back(b - 1, b);
                    if (b >= side) pairs.emplace_back(b - side, b);
                    break;
                case Graph::Random:
                    pairs.emplace_back(pick(-1, n - 1), pick(0, n - 1));
                    break;
            }
        }
        if (m_options.graph == Graph::Ring && n > 2) pairs.emplace_back(n - 1, 0);
        return pairs;
    }

    /** Adds columns for λ rows first … first+count−1; in a flexible block through a frame. **/
    void addColumns(int b, int first, int count) {
        Block& block = m_system.blocks[size_t(b)];
        const int height = block.heightOfGt();
        for (int k = 0; k < count; ++k) block.rows.push_back(first + k);
        for (int k = 0; k < height * count; ++k) block.Gt.push_back(uniform());
        if (block.columns == Block::Columns::Own) return;
        const int frames = m_system.parts[size_t(block.part)].numFrames;
        block.sides.push_back({pick(0, frames - 1), count});
        for (int k = 0; k < 6 * count; ++k) block.coefficients.push_back(uniform());
    }

    void makeJoints() {
        std::vector<int> used(m_system.blocks.size(), 0);
        for (const auto& [first, second] : listJoints()) {
            // A joint uses at most the remaining speeds of a body, so that the rows stay
            // independent.
            const auto left = [&](int b) {
                if (b < 0) return 0;
                const Block& block = m_system.blocks[size_t(b)];
                return block.size - used[size_t(b)];
            };
            const int available = std::max(left(first), left(second));
            if (available < 1) continue;
            const int count = pick(1, std::min(available, m_options.graph == Graph::Grid ? 3 : 6));
            used[size_t(left(second) >= left(first) ? second : first)] += count;
            const int row = m_system.numMultipliers();
            m_system.c.resize(m_system.c.size() + size_t(count));
            if (m_options.hasCompliantRows) {
                const bool isSpring = pick(0, 2) == 0;
                for (int k = 0; k < count; ++k)
                    m_system.compliance.push_back(isSpring ? 1 + 0.5 * uniform() : 0);
                if (isSpring && count > 1 && pick(0, 1)) {
                    m_system.pairs.push_back(row);
                    m_system.compliance[size_t(row) + 1] = m_system.compliance[size_t(row)];
                }
            }
            if (first >= 0) addColumns(first, row, count);
            if (second >= 0 && second != first) addColumns(second, row, count);
        }
        for (int k = 0; k < m_options.numCouplers; ++k) {
            const int first = pick(0, m_options.numBodies - 1);
            if (m_system.blocks[size_t(first)].size - used[size_t(first)] < 1) continue;
            ++used[size_t(first)];
            const int row = m_system.numMultipliers();
            m_system.c.push_back(0);
            if (m_options.hasCompliantRows) m_system.compliance.push_back(0);
            addColumns(first, row, 1);
            for (int side = 1; side < 4; ++side)
                addColumns(pick(0, m_options.numBodies - 1), row, 1);
        }
    }

    /** Appends a row that repeats a random one on all bodies. **/
    void copyRow() {
        if (m_system.numMultipliers() == 0) return;
        const int original = pick(0, m_system.numMultipliers() - 1);
        const int copy = m_system.numMultipliers();
        m_system.c.push_back(0);
        if (m_options.hasCompliantRows) m_system.compliance.push_back(0);
        m_copies.emplace_back(copy, original);
        for (Block& block : m_system.blocks) {
            const size_t column = size_t(std::find(block.rows.begin(), block.rows.end(), original) -
                                         block.rows.begin());
            if (column == block.rows.size()) continue;
            int frame = 0, first = 0;
            for (const NewtonSystem::Side& side : block.sides) {
                if (int(column) < first + side.numColumns) {
                    frame = side.frame;
                    break;
                }
                first += side.numColumns;
            }
            const size_t height = size_t(block.heightOfGt());
            block.rows.push_back(copy);
            for (size_t a = 0; a < height; ++a)
                block.Gt.push_back(double(block.Gt[column * height + a]));
            if (block.columns == Block::Columns::Own) continue;
            block.sides.push_back({frame, 1});
            for (size_t a = 0; a < 6; ++a)
                block.coefficients.push_back(double(block.coefficients[column * 6 + a]));
        }
    }

    void fillMatrix(Block& block) {
        const int n = block.size;
        const bool isGeneral = m_options.hasGeneralBlocks && pick(0, 3) == 0;
        if (block.part >= 0) {
            // The coupling stays small enough for J to be positive definite.
            const MatrixXd root = randomMatrix(6, 6);
            Map<MatrixXd>(block.head.data(), 6, 6) =
                root * root.transpose() + 6 * MatrixXd::Identity(6, 6);
            for (double& value : block.coupling) value = 0.2 * uniform();
            if (isGeneral) {
                const MatrixXd J = assembleBlock(m_system, block);
                const MatrixXd gyroscopic = 0.3 * randomMatrix(n, n);
                block.matrix.resize(size_t(n) * size_t(n));
                Map<MatrixXd>(block.matrix.data(), n, n) = J + gyroscopic - gyroscopic.transpose();
                block.form = Block::Form::General;
            }
            return;
        }
        const MatrixXd root = randomMatrix(n, n);
        Map<MatrixXd> matrix(block.matrix.data(), n, n);
        matrix = root * root.transpose() + MatrixXd::Identity(n, n);
        block.form = Block::Form::Symmetric;
        if (isGeneral) {
            matrix += root - root.transpose();
            block.form = Block::Form::General;
        }
    }

    std::mt19937& m_random;
    RandomSystemOptions m_options;
    NewtonSystem m_system;
    std::vector<std::pair<int, int>> m_copies;
};

}  // namespace

NewtonSystem makeRandomNewtonSystem(std::mt19937& random, const RandomSystemOptions& options) {
    return Generator(random, options).make();
}

ComplexNewtonSystem makeComplex(std::mt19937& random, const NewtonSystem& real) {
    const auto uniform = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    const auto addToVector = [&](const std::vector<double>& values, double scale) {
        std::vector<std::complex<double>> result(values.begin(), values.end());
        for (auto& value : result) value.imag(scale * uniform());
        return result;
    };
    // The imaginary part may be large, except for its unsymmetric part.
    const auto addToMatrix = [&](const std::vector<double>& values, int size, bool isSymmetric) {
        auto result = addToVector(values, 3);
        Map<Eigen::MatrixXcd> matrix(result.data(), values.empty() ? 0 : size, size);
        MatrixXd imaginary = matrix.imag();
        matrix.imag() += imaginary.transpose();
        if (!isSymmetric) matrix.imag() += 0.02 * imaginary;
        return result;
    };
    ComplexNewtonSystem system;
    for (const NewtonSystem::Part& part : real.parts)
        system.parts.push_back(
            {part.numModes, part.numFrames, addToVector(part.diagonal, 3), part.shapes});
    for (const NewtonSystem::Block& block : real.blocks) {
        system.blocks.emplace_back();
        ComplexNewtonSystem::Block& made = system.blocks.back();
        static_cast<NewtonBlock&>(made) = block;
        made.head = addToMatrix(block.head, 6, true);
        made.coupling = addToVector(block.coupling, 0.2);
        made.matrix =
            addToMatrix(block.matrix, block.size, block.form == NewtonBlock::Form::Symmetric);
    }
    system.r = addToVector(real.r, 1);
    for (double value : real.c) system.c.emplace_back(value, 0.5 * value);
    for (double value : real.compliance) system.compliance.emplace_back(value, -0.7 * value);
    system.pairs = real.pairs;
    return system;
}

}  // namespace simflex::test
