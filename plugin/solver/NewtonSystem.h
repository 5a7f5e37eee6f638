#pragma once
/** @file
One linear system of the Newton iteration, in blocks:

    [ J₁          G₁ᵀ ] [Δu₁]     [r₁]
    [    J₂       G₂ᵀ ] [Δu₂] = − [r₂]
    [        ⋱     ⋮  ] [ ⋮ ]     [⋮ ]
    [ G₁ G₂  ⋯    0  ] [Δλ ]     [c ]

A block is a flexible body or a tree of rigid bodies. Its J is either a dense matrix or an *arrow*:
6 rigid rows, a diagonal tail. Standard types only; matrices are column-major. **/

#include <iosfwd>
#include <vector>

namespace simflex {

struct NewtonSystem {
    struct Block {
        enum class Form { Arrow, Dense };

        int size = 0;  ///< n: speeds of the block
        Form form = Form::Dense;
        std::vector<double> head;  ///< Arrow: 6×6, symmetric
        std::vector<double>
            coupling;  ///< Arrow: 6×(n−6) upper right part; the lower left is its transpose
        std::vector<double> diagonal;  ///< Arrow: n−6
        std::vector<double> dense;     ///< Dense: n×n
        std::vector<int> rows;         ///< rows of Δλ that act on this block, in increasing order
        std::vector<double> Gt;        ///< n×rows.size(): G_bᵀ restricted to those rows
        std::vector<double> r;         ///< n: residual

        /** Sizes every array. **/
        void resize(int numSpeeds, std::vector<int> constraintRows);
    };

    std::vector<Block> blocks;
    std::vector<double> c;  ///< constraint residual

    int numMultipliers() const { return int(c.size()); }
    int numSpeeds() const;

    /** Writes the whole system as text, full precision; read() takes it back exactly.
    @throws std::runtime_error from read() on a damaged stream. **/
    void write(std::ostream& stream) const;
    static NewtonSystem read(std::istream& stream);
};

}  // namespace simflex
