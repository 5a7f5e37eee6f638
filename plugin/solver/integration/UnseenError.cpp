// Errors of loads and motions inside a step.

#include "simflex/solver/integration/Stepper.h"

namespace simflex {

namespace {

/** Inner nodes of Lobatto's rule with 6 points, as fractions of a step. **/
constexpr double Inside[] = {0.1174723380352676, 0.3573842417596774, 0.6426157582403226,
                             0.8825276619647324};

}  // namespace

void Stepper::Samples::resize(int numQ, int numU, int numMultipliers) {
    const size_t size = size_t(numU + numMultipliers);
    for (std::vector<double>& vector : loads) vector.assign(size, 0);
    for (std::vector<double>& vector : atNodes) vector.assign(size, 0);
    unseen.assign(size, 0);
    q.assign(size_t(numQ), 0);
    u.assign(size_t(numU), 0);
}

double Stepper::calcUnseenError(int order) {
    return largerOrNaN(calcUnseenLoads(order), calcUnseenMotions(order)) / m_settings.accuracy;
}

double Stepper::calcUnseenLoads(int order) {
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

    // Loads before a break follow another polynomial.
    double nodes[6] = {end};
    int count = 1;
    if (solvesStages()) {
        order = 1;  // only points of this step
        for (int i = radau::NumStages - 1; i-- > 0; ++count) {
            nodes[count] = updStages().updStage(i).t;
            evaluate(nodes[count], m_samples.atNodes[count]);
        }
    }
    for (int age = 0; age < std::min(order, m_history.size()) &&
                      (age == 0 || m_history[age].t >= m_breaks.getFirst());
         ++age, ++count) {
        nodes[count] = m_history[age].t;
        evaluate(nodes[count], m_samples.atNodes[count]);
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

double Stepper::calcUnseenMotions(int order) {
    if (!m_equations->getTimedLoads().hasMotions()) return 0;
    const double h = m_new.t - m_history[0].t;
    std::vector<double>&q = m_samples.q, &u = m_samples.u;
    double largest = 0;
    for (const double fraction : Inside) {
        const double t = m_history[0].t + fraction * h;
        interpolateNew(order, t, m_trial);
        q = m_trial.q;
        u = m_trial.u;
        m_equations->calcTimedMotions(t, q.data(), u.data());
        for (size_t i = 0; i < q.size(); ++i) q[i] -= m_trial.q[i];
        for (size_t i = 0; i < u.size(); ++i) u[i] -= m_trial.u[i];
        largest = largerOrNaN(largest, m_equations->updErrorNorm().calcSize(q.data(), u.data(), h));
    }
    return largest;
}

void Stepper::interpolateNew(int order, double t, SolutionPoint& point) {
    std::vector<double>&q = point.q, &u = point.u;
    if (solvesStages()) {
        const SolutionPoint* points[] = {&m_history[0], &updStages().updStage(0),
                                         &updStages().updStage(1), &m_new};
        std::fill(q.begin(), q.end(), 0.0);
        std::fill(u.begin(), u.end(), 0.0);
        for (const SolutionPoint* node : points) {
            double weight = 1;
            for (const SolutionPoint* other : points)
                if (other != node) weight *= (t - other->t) / (node->t - other->t);
            for (size_t i = 0; i < q.size(); ++i) q[i] += weight * node->q[i];
            for (size_t i = 0; i < u.size(); ++i) u[i] += weight * node->u[i];
        }
        return;
    }
    const int nodes = std::min(order, m_history.numNodes());
    const double ofEnd =
        m_history.calcNodeProduct(nodes, t) / m_history.calcNodeProduct(nodes, m_new.t);
    const SolutionHistory::Weights atEnd = m_history.calcInterpolation(nodes, m_new.t);
    const SolutionHistory::Weights here = m_history.calcInterpolation(nodes, t);
    m_history.combineQ(atEnd, m_samples.q);
    m_history.combineU(atEnd, m_samples.u);
    m_history.combineQ(here, q);
    m_history.combineU(here, u);
    for (size_t i = 0; i < q.size(); ++i) q[i] += ofEnd * (m_new.q[i] - m_samples.q[i]);
    for (size_t i = 0; i < u.size(); ++i) u[i] += ofEnd * (m_new.u[i] - m_samples.u[i]);
}

}  // namespace simflex
