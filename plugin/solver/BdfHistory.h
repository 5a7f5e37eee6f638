#pragma once
/** @file
Past solution points of a variable-step BDF method, and the polynomials through them (private
header).

With Δ_i = t_{n+1} − t_{n+1−i}, the derivative at t_{n+1} of the polynomial through k+1 points is

    ẏ = α₀ y_{n+1} + Σ_{j=1..k} α_j y_{n+1−j},   α₀ = Σ_{i=1..k} 1/Δ_i,   γ = 1/α₀,   y_hist = −γ
Σ_{j≥1} α_j y_{n+1−j}.

Local error of order k from the predictor through k+1 past points: γ (y − y_pred)/Δ_{k+1}. **/

#include <vector>

namespace simflex {

/** One accepted point. **/
struct BdfPoint {
    double t = 0, work = 0;
    double constraintError = 0;  ///< largest joint position error [m, rad]
    std::vector<double> q, u, lambda, uDot;
};

class BdfHistory {
public:
    static constexpr int MaxOrder = 5;
    static constexpr int Capacity = MaxOrder + 2;

    void clear() { m_size = 0; }
    int size() const { return m_size; }

    /** Point `age` steps back; 0 is the newest. **/
    const BdfPoint& operator[](int age) const {
        return m_points[(m_newest + Capacity - age) % Capacity];
    }
    BdfPoint& newest() { return m_points[m_newest]; }

    /** Opens a slot for a new newest point, the oldest gives way; its arrays keep their storage.
     * **/
    BdfPoint& push();

    /** γ of the order-k formula for a step to tNew. @pre size() ≥ order. **/
    double calcGamma(int order, double tNew) const;

    /** Writes q_hist, u_hist and returns the work's part; sizes are those of the points. **/
    double calcHistoryPart(int order, double tNew, std::vector<double>& qHist,
                           std::vector<double>& uHist) const;

    /** Values at t of the polynomials through the newest `points` points. @pre 1 ≤ points ≤ size().
     * **/
    void extrapolateQ(int points, double t, std::vector<double>& q) const;
    void extrapolateU(int points, double t, std::vector<double>& u) const;
    void extrapolateLambda(int points, double t, std::vector<double>& lambda) const;
    double extrapolateWork(int points, double t) const;

    /** Factor of (y − y_pred) in the local error of order k at tNew, y_pred through k+1 past
     * points. **/
    double calcErrorFactor(int order, double tNew) const;

private:
    /** Lagrange weights at t of the newest `points` points. **/
    void calcWeights(int points, double t, double* weights) const;

    BdfPoint m_points[Capacity];
    int m_newest = 0, m_size = 0;
};

}  // namespace simflex
