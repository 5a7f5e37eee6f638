// What loads and motions do inside of a step.

#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

namespace {

/** With both ends Lobatto's points of order 6, as fractions of a step. **/
constexpr double Inside[] = {0.1174723380352676, 0.3573842417596774, 0.6426157582403226,
                             0.8825276619647324};

}  // namespace

void ImplicitIntegrator::Implementation::Samples::resize(int numQ, int numU, int numMultipliers) {
    const size_t size = size_t(numU + numMultipliers);
    for (std::vector<double>& vector : loads) vector.assign(size, 0);
    for (std::vector<double>& vector : atNodes) vector.assign(size, 0);
    unseen.assign(size, 0);
    q.assign(size_t(numQ), 0);
    u.assign(size_t(numU), 0);
}

double ImplicitIntegrator::Implementation::calcUnseenError(int order) {
    return std::max(calcUnseenLoads(order), calcUnseenMotions(order)) / accuracy;
}

double ImplicitIntegrator::Implementation::calcUnseenLoads(int order) {
    if (!m_equations->getTimedLoads().hasLoads()) return 0;
    const double end = m_new.t, h = end - m_history[0].t;
    const auto evaluate = [&](double t, std::vector<double>& loads) {
        m_equations->calcTimedLoads(t, m_formula.factors, m_new.q.data(), m_new.u.data(),
                                    m_new.uDot.data(), loads.data(), loads.data() + m_new.u.size());
    };
    evaluate(end, m_samples.atNodes[0]);
    bool isSteady = true;
    for (int k = 0; k < Samples::Count; ++k) {
        evaluate(m_history[0].t + Inside[k] * h, m_samples.loads[k]);
        isSteady = isSteady && m_samples.loads[k] == m_samples.atNodes[0];
    }
    if (isSteady) return 0;

    // Nodes in front of a break belong to another course.
    double nodes[6] = {end};
    int count = 1;
    while (count <= std::min(order, m_history.size()) &&
           (count == 1 || m_history[count - 1].t >= breaks.getFirst())) {
        nodes[count] = m_history[count - 1].t;
        evaluate(nodes[count], m_samples.atNodes[count]);
        ++count;
    }
    std::vector<double>& unseen = m_samples.unseen;
    std::fill(unseen.begin(), unseen.end(), 0.0);
    for (int k = 0; k < Samples::Count; ++k) {
        const double t = m_history[0].t + Inside[k] * h;
        double weights[6];
        for (int j = 0; j < count; ++j) {
            weights[j] = 1;
            for (int i = 0; i < count; ++i)
                if (i != j) weights[j] *= (t - nodes[i]) / (nodes[j] - nodes[i]);
        }
        for (size_t i = 0; i < unseen.size(); ++i) {
            double distance = m_samples.loads[k][i];
            for (int j = 0; j < count; ++j) distance -= weights[j] * m_samples.atNodes[j][i];
            if (std::abs(distance) > std::abs(unseen[i])) unseen[i] = distance;
        }
    }
    return m_step->calcResponse(m_formula.factors.stiffness, unseen);
}

double ImplicitIntegrator::Implementation::calcUnseenMotions(int order) {
    if (!m_equations->getTimedLoads().hasMotions()) return 0;
    const double h = m_new.t - m_history[0].t;
    const int nodes = std::min(order, m_history.numNodes());
    const double endProduct = m_history.calcNodeProduct(nodes, m_new.t);
    const SolutionHistory::Weights atEnd = m_history.calcInterpolation(nodes, m_new.t);
    std::vector<double>&q = m_samples.q, &u = m_samples.u;
    double largest = 0;
    for (const double fraction : Inside) {
        const double t = m_history[0].t + fraction * h;
        const double ofEnd = m_history.calcNodeProduct(nodes, t) / endProduct;
        // The polynomial through the nodes and the new point.
        m_history.combineQ(atEnd, q);
        m_history.combineU(atEnd, u);
        const SolutionHistory::Weights here = m_history.calcInterpolation(nodes, t);
        m_history.combineQ(here, m_trial.q);
        m_history.combineU(here, m_trial.u);
        for (size_t i = 0; i < q.size(); ++i) q[i] = m_trial.q[i] += ofEnd * (m_new.q[i] - q[i]);
        for (size_t i = 0; i < u.size(); ++i) u[i] = m_trial.u[i] += ofEnd * (m_new.u[i] - u[i]);
        m_equations->calcTimedMotions(t, q.data(), u.data());
        for (size_t i = 0; i < q.size(); ++i) q[i] -= m_trial.q[i];
        for (size_t i = 0; i < u.size(); ++i) u[i] -= m_trial.u[i];
        largest = std::max(largest, m_equations->updErrorNorm().calcSize(q.data(), u.data(), h));
    }
    return largest;
}

}  // namespace simflex
