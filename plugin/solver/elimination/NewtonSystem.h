#pragma once
/** @file
One linear system of the Newton iteration, in blocks:

    [ J₁          G₁ᵀ ] [Δu₁]     [r₁]
    [    J₂       G₂ᵀ ] [Δu₂] = − [r₂]
    [        ⋱     ⋮  ] [ ⋮ ]     [⋮ ]
    [ G₁ G₂  ⋯   −D  ] [Δλ ]     [c ]

D is a diagonal of compliances, except for couplings: zero in rows of constraints, ±1 in rows that
represent a force element's stiffness and damping. Two such rows, l and r, may form a pair: with
PairFactor times the compliance beside the first and the compliance itself beside the second they
add l·rᵀ to J, where l and r may act on any bodies. A block is a flexible body or a tree of rigid
bodies. A flexible body's J is an *arrow*,

    [ H   E ]    H: 6×6 (rotation, translation),  E: only the 3 rotation rows are nonzero,
    [ Eᵀ  d ]    d: a diagonal, the same for all bodies of one part,

or dense where gyroscopic terms are needed. J of a long tree is stored by bodies (TreeMatrix.h).
Constraints act on a flexible body through frames: the modal part of a column of Gᵀ is (shapes of
the frame)·(6 coefficients), so only 12 numbers per column are stored, and a part's shapes once.
Where shapes change with the deformation (stiffening), and where modes are constrained or locked,
the block has its own columns; J can still be an arrow. Standard types only; matrices are
column-major.

J, r, c and D are real or complex, the columns always real. A complex J is symmetric where a real
one is, never Hermitian: transposes do not conjugate. **/

#include <complex>
#include <iosfwd>
#include <memory>
#include <vector>

#include "simflex/solver/TreeMatrix.h"

namespace simflex {

class Checkpoint;

/** Sizes of a block and its columns of Gᵀ, independent of the scalar type. **/
struct NewtonBlock {
    enum class Form {
        Arrow,      ///< head, coupling, and the part's diagonal
        Symmetric,  ///< matrix, symmetric and positive definite
        General,    ///< matrix
        Tree        ///< tree
    };
    /** Storage of Gᵀ, independent of the form of J. **/
    enum class Columns {
        Shared,  ///< through frames of the part
        Own      ///< written out
    };
    /** Consecutive columns of Gᵀ that act through one frame. **/
    struct Side {
        int frame = 0;  ///< of the part
        int numColumns = 0;
    };

    int size = 0;   ///< n: speeds of the block; 6 + n_f if it has a part
    int part = -1;  ///< index of its part; −1: none, and the columns are Own
    Form form = Form::General;
    Columns columns = Columns::Own;
    std::vector<int> rows;             ///< row of Δλ of each column of Gt
    std::vector<Side> sides;           ///< in the order of the columns, if shared
    std::vector<double> Gt;            ///< shared: 6×m, rigid rows of Gᵀ; own: n×m
    std::vector<double> coefficients;  ///< shared: 6×m

    int numColumns() const { return int(rows.size()); }
    /** Number of rows of Gt. **/
    int heightOfGt() const { return columns == Columns::Shared ? 6 : size; }
};

/** @tparam Scalar  double or std::complex<double> **/
template <class Scalar>
struct BasicNewtonSystem {
    using Side = NewtonBlock::Side;

    /** Data shared by the flexible bodies of one part. **/
    struct Part {
        int numModes = 0;              ///< n_f
        int numFrames = 0;             ///< number of frames that constraints act through
        std::vector<Scalar> diagonal;  ///< n_f: d
        /** n_f×6·numFrames: 3 translation and 3 rotation shapes per frame; constant. **/
        std::shared_ptr<const std::vector<double>> shapes;
    };

    struct Block : NewtonBlock {
        std::vector<Scalar> head;      ///< 6×6, if there is a part
        std::vector<Scalar> coupling;  ///< n_f×3, if there is a part: Eᵀ
        std::vector<Scalar> matrix;    ///< n×n; empty while the form is Arrow
        BasicTreeMatrix<Scalar> tree;  ///< for form Tree

        /** Sizes a block without a part. **/
        void resize(int numSpeeds, std::vector<int> constraintRows);
        /** Sizes a block of system.parts[partIndex] with its own columns. **/
        void resize(int partIndex, int numModes, std::vector<int> constraintRows);
        /** Sizes a block of system.parts[partIndex] with shared columns. **/
        void resize(int partIndex, int numModes, std::vector<Side> columnSides,
                    std::vector<int> constraintRows);
    };

    std::vector<Part> parts;
    std::vector<Block> blocks;
    std::vector<Scalar> r;  ///< residual of all speeds, block after block
    std::vector<Scalar> c;  ///< constraint residual
    /** D, of the size of c; nonzero entries at analysis stay nonzero. Empty: all zero. **/
    std::vector<Scalar> compliance;
    /** First rows of pairs, ascending; the next row is the second, with the same compliance. **/
    std::vector<int> pairs;
    /** An unsymmetric addition to D between some rows: a friction force and the multipliers that it
    depends on. Each of its rows has a diagonal entry in it, unless its columns have one. **/
    struct Coupling {
        std::vector<int> rows;
        std::vector<Scalar> values;  ///< k×k, column-major
    };
    std::vector<Coupling> couplings;
    /** K of a pair's D = D_l·[1 K; 1 1]. The pair also adds r·lᵀ/K to J, which is round-off for
    Newton's method, as l and r are of similar size. **/
    static constexpr double PairFactor = 1 << 20;

    int numMultipliers() const { return int(c.size()); }
    int numSpeeds() const;

    /** Writes the full n×m matrix Gᵀ of a block. **/
    void expandGt(const NewtonBlock& block, double* Gt) const;

    /** @throws std::invalid_argument naming the block whose sizes, frames or rows do not fit. **/
    void checkSizes() const;

    /** @name Real systems only **/
    /**@{**/
    /** Writes the whole system as text in full precision; read() restores it exactly.
    @throws std::runtime_error from read() on a damaged stream. **/
    void write(std::ostream& stream) const;
    static BasicNewtonSystem read(std::istream& stream);

    /** Saves or restores the matrices, for the same topology. **/
    void visit(Checkpoint& checkpoint);
    /**@}**/
};

using NewtonSystem = BasicNewtonSystem<double>;
using ComplexNewtonSystem = BasicNewtonSystem<std::complex<double>>;

template <>
void NewtonSystem::write(std::ostream& stream) const;
template <>
NewtonSystem NewtonSystem::read(std::istream& stream);
template <>
void NewtonSystem::visit(Checkpoint& checkpoint);

}  // namespace simflex
