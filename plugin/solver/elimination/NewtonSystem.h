#pragma once
/** @file
One linear system of the Newton iteration, in blocks:

    [ J₁          G₁ᵀ ] [Δu₁]     [r₁]
    [    J₂       G₂ᵀ ] [Δu₂] = − [r₂]
    [        ⋱     ⋮  ] [ ⋮ ]     [⋮ ]
    [ G₁ G₂  ⋯   −D  ] [Δλ ]     [c ]

D is a diagonal of compliances, but for couplings: zero in rows of constraints, ±1 in rows that
stand for a force element's stiffness and damping. Two such rows, l and r, may be a pair: with
PairFactor times the compliance beside the first and the compliance itself beside the second they
add l·rᵀ to J, and l and r may act on any bodies. A block is a flexible body or a tree of rigid
bodies. A flexible body's J is an *arrow*,

    [ H   E ]    H: 6×6 (rotation, translation),  E: only the 3 rotation rows are filled,
    [ Eᵀ  d ]    d: a diagonal, the same for all bodies of one part,

or dense when gyroscopic terms are wanted. A long tree's J is given body by body (TreeMatrix.h). A
flexible body's constraints act through frames: the modal part of a
column of Gᵀ is (shapes of the frame)·(6 coefficients), so that only 12 numbers a column are stored
and a part's shapes once. Where shapes change with the deformation (stiffening), and where modes are
constrained or held, the columns are the block's own; J is an arrow all the same. Standard types
only; matrices are column-major.

J, r, c and D are real or complex, the columns always real. A complex J is symmetric where a real
one is, never Hermitian: no transpose conjugates. **/

#include <complex>
#include <iosfwd>
#include <memory>
#include <vector>

#include "simflex/solver/TreeMatrix.h"

namespace simflex {

class Checkpoint;

/** What a block is but for its J: sizes, and its columns of Gᵀ. **/
struct NewtonBlock {
    enum class Form {
        Arrow,      ///< head, coupling, and the part's diagonal
        Symmetric,  ///< matrix, symmetric and positive definite
        General,    ///< matrix
        Tree        ///< tree
    };
    /** Of Gᵀ, whatever the form of J. **/
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
    int part = -1;  ///< index of its part; −1: none, columns are its own then
    Form form = Form::General;
    Columns columns = Columns::Own;
    std::vector<int> rows;             ///< the row of Δλ that each column of Gt belongs to
    std::vector<Side> sides;           ///< in the order of the columns, if they are shared
    std::vector<double> Gt;            ///< shared: 6×m, rigid rows of Gᵀ; else n×m
    std::vector<double> coefficients;  ///< shared: 6×m

    int numColumns() const { return int(rows.size()); }
    /** Rows of Gt. **/
    int heightOfGt() const { return columns == Columns::Shared ? 6 : size; }
};

/** @tparam Scalar  double or std::complex<double> **/
template <class Scalar>
struct BasicNewtonSystem {
    using Side = NewtonBlock::Side;

    /** What the flexible bodies of one part share. **/
    struct Part {
        int numModes = 0;              ///< n_f
        int numFrames = 0;             ///< frames that constraints act through
        std::vector<Scalar> diagonal;  ///< n_f: d
        /** n_f×6·numFrames: for each frame its 3 translation and 3 rotation shapes; constant. **/
        std::shared_ptr<const std::vector<double>> shapes;
    };

    struct Block : NewtonBlock {
        std::vector<Scalar> head;      ///< 6×6, if there is a part
        std::vector<Scalar> coupling;  ///< n_f×3, if there is a part: Eᵀ
        std::vector<Scalar> matrix;    ///< n×n; empty as long as the form is Arrow
        BasicTreeMatrix<Scalar> tree;  ///< of a tree

        /** Sizes a block without part. **/
        void resize(int numSpeeds, std::vector<int> constraintRows);
        /** Sizes a block of system.parts[partIndex] with columns of its own. **/
        void resize(int partIndex, int numModes, std::vector<int> constraintRows);
        /** The same with shared ones. **/
        void resize(int partIndex, int numModes, std::vector<Side> columnSides,
                    std::vector<int> constraintRows);
    };

    std::vector<Part> parts;
    std::vector<Block> blocks;
    std::vector<Scalar> r;  ///< residual of all speeds, block after block
    std::vector<Scalar> c;  ///< constraint residual
    /** D, as long as c; rows that are not zero at analysis stay so. Empty: all zero. **/
    std::vector<Scalar> compliance;
    /** First rows of pairs, ascending; the next row is the second, of the same compliance. **/
    std::vector<int> pairs;
    /** More of D between some rows, in no way symmetric: a friction force and the multipliers that
    it follows. Each of its rows has some of it on the diagonal, unless its columns have. **/
    struct Coupling {
        std::vector<int> rows;
        std::vector<Scalar> values;  ///< k×k, column-major
    };
    std::vector<Coupling> couplings;
    /** K of a pair's D = D_l·[1 K; 1 1]: r·lᵀ/K, which it adds to J as well, is round-off to
    Newton's method. l and r are of about the same size. **/
    static constexpr double PairFactor = 1 << 20;

    int numMultipliers() const { return int(c.size()); }
    int numSpeeds() const;

    /** Writes the whole n×m matrix Gᵀ of a block. **/
    void expandGt(const NewtonBlock& block, double* Gt) const;

    /** @throws std::invalid_argument that names the block whose sizes, frames or rows do not fit.
     * **/
    void checkSizes() const;

    /** @name Of a real system alone **/
    /**@{**/
    /** Writes the whole system as text, full precision; read() takes it back exactly.
    @throws std::runtime_error from read() on a damaged stream. **/
    void write(std::ostream& stream) const;
    static BasicNewtonSystem read(std::istream& stream);

    /** The matrices, of this topology. **/
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
