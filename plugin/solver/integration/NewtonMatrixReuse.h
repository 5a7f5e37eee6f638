#pragma once
/** @file
For how long a factored Newton matrix serves (private header). J belongs to one γ and to one place;
a modified Newton iteration goes on with it over many steps, as long as it converges well:

    a new matrix if  |γ/γ_J − 1| > LargestChange,  or it is LongestUse steps old,
                     or the iteration is slow with a matrix that is older than the step before

Sources: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.8; CVODE (`dgmax`,
`msbp`), whose limits are 0.3 and 20 where a matrix costs less beside an evaluation. **/

#include <algorithm>
#include <cmath>

#include "simflex/base/Checkpoint.h"
#include "simflex/solver/equations/NewtonFactors.h"

namespace simflex {

class NewtonMatrixReuse {
public:
    /** Relative change of the stiffness factor that a matrix bears. **/
    static constexpr double LargestChange = 0.1;
    /** Steps that it serves at most. **/
    static constexpr int LongestUse = 50;
    /** Ratio of successive changes from which on an iteration is slow; a step that ends so ages the
    matrix by SlowAge steps more. **/
    static constexpr double SlowRate = 0.5;
    static constexpr int SlowAge = 5;

    bool hasMatrix() const { return m_factors.mass != 0; }
    /** Those that it was made with. **/
    const NewtonFactors& getFactors() const { return m_factors; }
    void take(const NewtonFactors& factors) {
        m_factors = factors;
        m_age = 0;
    }
    /** There is no matrix from now on. **/
    void forget() { m_factors = {}; }

    /** @param slowest  rate of the last iteration up to which the matrix is kept
    @returns true if the step needs a new matrix. **/
    bool beginStep(const NewtonFactors& factors, double slowest = 1e9) {
        const bool isGood =
            hasMatrix() && m_age < LongestUse && m_rate <= slowest &&
            !(std::abs(factors.stiffness / m_factors.stiffness - 1) > LargestChange);
        ++m_age;
        return !isGood;
    }
    /** An iteration with a new matrix begins: nothing is known of its convergence. **/
    void resetRate() { m_rate = 0.5; }
    /** @param ratio  of the last change to the one before **/
    void noteRate(double ratio) { m_rate = std::max(0.1, ratio); }
    double getRate() const { return m_rate; }
    bool isSlow() const { return m_rate > SlowRate; }
    /** What is left of the error after a change, in units of that change. **/
    double calcRemaining() const { return m_rate < 0.9 ? m_rate / (1 - m_rate) : 10; }
    void endStep() {
        if (isSlow()) m_age += SlowAge;
    }

    /** True if it was made in this step. **/
    bool isFresh() const { return m_age == 0; }
    /** True if a new one may do better in this step: it is older than the step before. **/
    bool isOld() const { return m_age > 1; }

    void visit(Checkpoint& checkpoint) {
        checkpoint.visit(m_factors.mass, m_factors.stiffness, m_rate, m_age);
    }

private:
    NewtonFactors m_factors;  ///< zero: no matrix
    double m_rate = 1;        ///< convergence rate seen in the last iterations
    int m_age = 0;            ///< steps since it was made
};

}  // namespace simflex
