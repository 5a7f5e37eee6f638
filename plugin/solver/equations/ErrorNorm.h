#pragma once
/** @file
Norm of errors, in metres or as in SimTK::Integrator (private header). Simbody's norm is the largest
of three infinity or root-mean-square norms: of N W N⁺ δq with the State's weights W of speeds, and
of δu and δz relative to the larger of value and 1/weight.

A *part* is a flexible body, or a tree of rigid bodies rooted at Ground. In metres each part is
measured separately and the largest counts. Root mean squares are taken over the whole system, as in
Simbody, so bodies at rest reduce the errors of moving ones. **/

#include <cmath>
#include <vector>

#include "simflex/solver/equations/Blocks.h"

namespace simflex {

class ErrorNorm {
public:
    enum class Kind { Displacement, Infinity, RootMeanSquare };

    /** @param state  gives the weights **/
    ErrorNorm(const Blocks& blocks, const SimTK::State& state);

    /** Default: Displacement. @pre all bodies are rigid for other norms. **/
    void setKind(Kind kind) { m_kind = kind; }
    bool isInMetres() const { return m_kind == Kind::Displacement; }
    /** Makes a change of z_i by `scale` count as a metre. **/
    void setZScale(int i, double scale) {
        m_zScales[size_t(i)] = m_zWeights[size_t(i)] = 1 / scale;
    }
    /** Sets the values that errors are relative to. **/
    void setReference(const double* q, const double* u, const double* z);

    /** Norm of an error at a step's end, NaN if something is; `worst` receives the block. **/
    double calcSize(const double* deltaQ, const double* deltaU, double h, int* worst = nullptr);
    /** Norm of a change of u at a step's end, and of q by stiffness times that.
    @param prepare  if given, writes a block's part of the change, from several threads **/
    double calcChange(const double* deltaU, double stiffness, int* worst = nullptr,
                      const std::function<void(int b)>& prepare = {}) const;
    double calcZSize(const double* deltaZ) const;

    /** An error of each coordinate, speed and z. **/
    struct Error {
        std::vector<double> q, u, z;
    };
    /** Multiplies the error of each part and of each z by factor(its size, its size in
    `other`). **/
    template <class Factor>
    void scaleByPart(Error& error, const Error& other, double h, const Factor& factor) {
        weigh(error.q.data(), m_weighed);
        weigh(other.q.data(), m_otherWeighed);
        for (const Part& part : m_parts) {
            const double scale = factor(calcPartSize(part, error, m_weighed, h),
                                        calcPartSize(part, other, m_otherWeighed, h));
            for (int i = 0; i < part.numQ; ++i) error.q[size_t(part.firstQ + i)] *= scale;
            for (int i = 0; i < part.numU; ++i) error.u[size_t(part.firstU + i)] *= scale;
        }
        for (size_t i = 0; i < error.z.size(); ++i)
            error.z[i] *=
                factor(std::abs(m_zScales[i] * error.z[i]), std::abs(m_zScales[i] * other.z[i]));
    }

private:
    struct Part {
        int block, root;  ///< root: index in a tree of rigid bodies, else −1
        int firstQ, numQ, firstU, numU;
    };
    double calcNorm(int size, const double* values, const double* scales) const;
    /** Writes N W N⁺ δq for Simbody's norm. **/
    void weigh(const double* deltaQ, std::vector<double>& weighed) const;
    double calcPartSize(const Part& part, const double* deltaQ, const double* deltaU,
                        const std::vector<double>& weighed, double h) const;
    double calcPartSize(const Part& part, const Error& error, const std::vector<double>& weighed,
                        double h) const {
        return calcPartSize(part, error.q.data(), error.u.data(), weighed, h);
    }

    const Blocks& m_blocks;
    std::vector<Part> m_parts;
    int m_numQ, m_numU, m_numZ;
    Kind m_kind = Kind::Displacement;
    std::vector<double> m_uWeights, m_zWeights;  ///< the State's
    std::vector<double> m_referenceQ, m_uScales, m_zScales;
    std::vector<double> m_weighed, m_otherWeighed, m_sizes;  ///< workspaces
};

}  // namespace simflex
