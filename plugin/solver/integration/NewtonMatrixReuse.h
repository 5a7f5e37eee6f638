#pragma once
/** @file
Lifetime of a factored Newton matrix (private header). J depends on γ and on the point; the modified
Newton iteration keeps it over many steps while it converges well:

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
    /** Largest relative change of the stiffness factor. **/
    static constexpr double LargestChange = 0.1;
    /** Largest number of steps with one matrix. **/
    static constexpr int LongestUse = 50;
    /** Ratio of successive changes above which convergence is slow; a step that ends so adds
    SlowAge steps to the age of the matrix. **/
    static constexpr double SlowRate = 0.5;
    static constexpr int SlowAge = 5;

    bool hasMatrix() const { return m_factors.mass != 0; }
    /** Factors with which it was formed. **/
    const NewtonFactors& getFactors() const { return m_factors; }
    void take(const NewtonFactors& factors) {
        m_factors = factors;
        m_age = 0;
    }
    /** Discards the matrix. **/
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
    /** Resets the convergence rate, for a new matrix. **/
    void resetRate() { m_rate = 0.5; }
    /** @param ratio  of the last change to the one before **/
    void noteRate(double ratio) { m_rate = std::max(0.1, ratio); }
    double getRate() const { return m_rate; }
    bool isSlow() const { return m_rate > SlowRate; }
    /** Estimated error after a change, in units of that change. **/
    double calcRemaining() const { return m_rate < 0.9 ? m_rate / (1 - m_rate) : 10; }
    void endStep() {
        if (isSlow()) m_age += SlowAge;
    }

    /** True if the matrix was formed in this step. **/
    bool isFresh() const { return m_age == 0; }
    /** True if a new one may be better in this step, as it is older than the last step. **/
    bool isOld() const { return m_age > 1; }

    void visit(Checkpoint& checkpoint) {
        checkpoint.visit(m_factors.mass, m_factors.stiffness, m_rate, m_age);
    }

private:
    NewtonFactors m_factors;  ///< zero: no matrix
    double m_rate = 1;        ///< convergence rate of the last iterations
    int m_age = 0;            ///< steps since it was formed
};

}  // namespace simflex
