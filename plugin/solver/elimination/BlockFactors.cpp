#include "simflex/solver/elimination/BlockFactors.h"

#include <algorithm>
#include <cmath>

namespace simflex {

using Eigen::Map;

template <class Scalar>
BlockFactors<Scalar>::BlockFactors(const Block& block, std::vector<PartFactors<Scalar>>& parts)
    : m_schur(Matrix::Zero(block.numColumns(), block.numColumns())) {
    if (block.part >= 0) m_arrow.emplace(block, parts[size_t(block.part)]);
}

template <class Scalar>
bool BlockFactors<Scalar>::factor(const System& system, const Block& block) {
    m_form = block.form;
    const int n = block.size, m = block.numColumns();
    if (n == 0) return true;
    if (m_form == Form::Arrow) return m_arrow->factor(block, m_schur.data());

    m_Gt.resize(n, m);
    m_W.resize(n, m);
    m_r.resize(n);
    m_z.resize(n);
    m_Gz.resize(m);
    m_lambda.resize(m);
    system.expandGt(block, m_Gt.data());
    if (m_form == Form::Tree) {
        m_needsPivoting = !m_tree.factor(block.tree);
        if (m_needsPivoting) {
            m_expanded.resize(n, n);
            block.tree.expand(n, m_expanded.data(), m_workspace);
            m_pivoting.compute(m_expanded);
        }
        if (m_needsPivoting && !(m_pivoting.matrixLU().diagonal().cwiseAbs().minCoeff() > 0))
            return false;
        m_W = m_Gt.template cast<Scalar>();
        for (int k = 0; k < m; ++k) solveInPlace(m_W.col(k).data());
        if (m == 0) return true;
        m_schur.noalias() = m_Gt.transpose() * m_W;
        return m_schur.allFinite();
    }
    const Map<const Matrix> J(block.matrix.data(), n, n);
    if constexpr (IsReal<Scalar>) {
        if (m_form == Form::Symmetric) {
            m_symmetric.compute(J);
            if (m_symmetric.info() != Eigen::Success ||
                !isFinite(m_symmetric.matrixLLT().diagonal().sum()))
                return false;
            if (m == 0) return true;
            m_W = m_Gt;
            m_symmetric.matrixL().solveInPlace(m_W);
            m_schur.noalias() = m_W.transpose() * m_W;
            return m_schur.allFinite();
        }
    }
    m_needsPivoting = !m_general.factor(block.matrix.data(), n, m_Gt, m_W);
    if (m_needsPivoting) {
        m_pivoting.compute(J);
        if (!(m_pivoting.matrixLU().diagonal().cwiseAbs().minCoeff() > 0)) return false;
        m_W = m_pivoting.solve(m_Gt.template cast<Scalar>());
    }
    if (m == 0) return true;
    m_schur.noalias() = m_Gt.transpose() * m_W;
    return m_schur.allFinite();
}

template <class Scalar>
void BlockFactors<Scalar>::eliminate(const Scalar* r, Scalar* Gz) {
    if (m_form == Form::Arrow) return m_arrow->eliminate(r, Gz);
    std::copy_n(r, m_z.size(), m_z.data());
    if constexpr (IsReal<Scalar>) {
        if (m_form == Form::Symmetric) {
            m_symmetric.matrixL().solveInPlace(m_z);
            m_Gz.noalias() = m_W.transpose() * m_z;
            std::copy_n(m_Gz.data(), m_Gz.size(), Gz);
            return;
        }
    }
    solveInPlace(m_z.data());
    m_Gz.noalias() = m_Gt.transpose() * m_z;
    std::copy_n(m_Gz.data(), m_Gz.size(), Gz);
}

template <class Scalar>
void BlockFactors<Scalar>::solveInPlace(Scalar* x) {
    if (m_needsPivoting) {
        m_r = Map<const Vector>(x, m_r.size());
        Map<Vector>(x, m_r.size()) = m_pivoting.solve(m_r);
    } else if (m_form == Form::Tree) {
        m_tree.solveInPlace(x);
    } else {
        m_general.solveInPlace(x);
    }
}

template <class Scalar>
void BlockFactors<Scalar>::substitute(const Scalar* r, const Scalar* lambda, Scalar* deltaU) {
    if (m_form == Form::Arrow) return m_arrow->substitute(r, lambda, deltaU);
    std::copy_n(lambda, m_lambda.size(), m_lambda.data());
    if (!r) m_z.setZero();
    m_z.noalias() += m_W * m_lambda;
    if constexpr (IsReal<Scalar>)
        if (m_form == Form::Symmetric) m_symmetric.matrixU().solveInPlace(m_z);
    for (Eigen::Index i = 0; i < m_z.size(); ++i) deltaU[i] = -m_z[i];
}

template class BlockFactors<double>;
template class BlockFactors<std::complex<double>>;

}  // namespace simflex
