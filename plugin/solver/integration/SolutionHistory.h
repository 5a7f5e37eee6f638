#pragma once
/** @file
Past points of an integration and the polynomials through them (private header).

The polynomials interpolate values at every point and also derivatives at a point where the
integration started or restarted: that point is a *double node*. A new history of one point thus
gives polynomials through 2 nodes, which turn BDF2 into the trapezoidal rule, and no step is taken
at order 1. **/

#include <vector>

namespace simflex {

class Checkpoint;

/** One accepted point. **/
struct SolutionPoint {
    double t = 0;
    double work = 0, power = 0;
    double constraintError = 0;  ///< largest joint position error [m, rad]
    std::vector<double> q, u, lambda, z;
    std::vector<double> qDot, uDot, zDot;
    /** Generalized-α's own acceleration, an average of u̇ around t; else empty. **/
    std::vector<double> a;

    void resize(int numQ, int numU, int numMultipliers, int numZ);
    void visit(Checkpoint& checkpoint);
};

class SolutionHistory {
public:
    static constexpr int Capacity = 7;
    static constexpr int MaxNodes = Capacity + 1;

    /** Sizes all points and clears the history. **/
    void resize(int numQ, int numU, int numMultipliers, int numZ);
    void clear() { m_size = m_pushed = 0; }
    /** Threads for long combinations. **/
    void setNumThreads(int threads) { m_numThreads = threads; }

    /** Current number of points, at most Capacity. **/
    int size() const { return m_size; }
    /** Number of nodes: one more than points while the start is among them. **/
    int numNodes() const { return m_size + (hasDoubleNode() ? 1 : 0); }

    /** Point `age` steps back; 0 is the newest. **/
    const SolutionPoint& operator[](int age) const {
        return m_points[(m_newest + Capacity - age) % Capacity];
    }
    SolutionPoint& newest() { return m_points[m_newest]; }

    /** Returns a slot for a new newest point in place of the oldest; its arrays keep their
    sizes. **/
    SolutionPoint& push();

    /** Overwrites the newest points, oldest of them first. **/
    void replaceNewest(const std::vector<SolutionPoint>& points);

    /** Keeps the newest point only, whose derivatives are exact, as a double node. **/
    void startAtNewest();

    /** Weights of a linear combination of nodes: values by age, and the derivative at the
    start. **/
    struct Weights {
        int numPoints = 0;
        double value[Capacity];
        double derivative = 0;  ///< of the oldest point among numPoints
    };

    /** Times of the points among the newest `nodes` nodes, and whether the oldest is a double node.
    @returns their number **/
    int collectNodes(int nodes, double* times, bool& isDouble) const;

    /** Value at t of the polynomial through the newest `nodes` nodes. @pre nodes ≤ numNodes(). **/
    Weights calcInterpolation(int nodes, double t) const;

    /** Π (t − t_i) over the newest `nodes` nodes. **/
    double calcNodeProduct(int nodes, double t) const;

    void combineQ(const Weights& weights, std::vector<double>& q) const;
    void combineU(const Weights& weights, std::vector<double>& u) const;
    /** Weights of a value; values that are equal at all points, as they change at events only, are
    reproduced exactly. **/
    void combineZ(const Weights& weights, std::vector<double>& z) const;
    double combineWork(const Weights& weights) const;
    /** Polynomial of λ through the newest `points` points; λ has no derivatives. **/
    void extrapolateLambda(int points, double t, std::vector<double>& lambda) const;
    /** The same for u̇. **/
    void interpolateUDot(int points, double t, std::vector<double>& uDot) const;

    void visit(Checkpoint& checkpoint);

private:
    using Member = std::vector<double> SolutionPoint::*;
    bool hasDoubleNode() const { return m_size > 0 && m_startsDouble && m_pushed < Capacity; }
    void combine(const Weights& weights, Member value, Member derivative,
                 std::vector<double>& sum) const;

    SolutionPoint m_points[Capacity];
    int m_newest = 0, m_size = 0;
    int m_pushed = 0;  ///< since the start
    bool m_startsDouble = false;
    int m_numThreads = 1;
};

}  // namespace simflex
