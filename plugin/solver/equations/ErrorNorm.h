#pragma once
/** @file
Size of errors, in metres or as SimTK::Integrator has it (private header). With Simbody's norms: the
largest of three, infinity or root-mean-square norms of N W N⁺ δq with the State's weights W of
speeds, and of δu and δz by the larger of value and 1/weight. **/

#include <vector>

#include "simflex/solver/equations/Blocks.h"

namespace simflex {

class ErrorNorm {
public:
    enum class Kind { Displacement, Infinity, RootMeanSquare };

    /** @param state  gives the weights **/
    ErrorNorm(const Blocks& blocks, const SimTK::State& state);

    /** Displacement unless told. @pre all is rigid, if not Displacement. **/
    void setKind(Kind kind) { m_kind = kind; }
    bool isInMetres() const { return m_kind == Kind::Displacement; }
    /** A change of z_i by `scale` counts as much as a metre. **/
    void setZScale(int i, double scale) {
        m_zScales[size_t(i)] = m_zWeights[size_t(i)] = 1 / scale;
    }
    /** Values that errors are relative to from now on. **/
    void setReference(const double* q, const double* u, const double* z);

    /** Of a step's end; `worst` receives the block. **/
    double calcSize(const double* deltaQ, const double* deltaU, double h, int* worst = nullptr);
    /** Of a change of u at a step's end, and of q by stiffness times that.
    @param prepare  if given, writes a block's part of the change, from several threads **/
    double calcChange(const double* deltaU, double stiffness, int* worst = nullptr,
                      const std::function<void(int b)>& prepare = {}) const;
    double calcZSize(const double* deltaZ) const;

private:
    double calcNorm(int size, const double* values, const double* scales, int* worst) const;

    const Blocks& m_blocks;
    int m_numQ, m_numU, m_numZ;
    Kind m_kind = Kind::Displacement;
    std::vector<double> m_uWeights, m_zWeights;  ///< the State's
    std::vector<double> m_referenceQ, m_uScales, m_zScales;
    std::vector<double> m_weighed;  ///< numQ, used within calcSize()
};

}  // namespace simflex
