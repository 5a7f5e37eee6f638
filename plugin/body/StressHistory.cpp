#include "simflex/body/StressHistory.h"

#include <stdexcept>

#include "simflex/body/ReportInterval.h"

namespace simflex {

using namespace SimTK;
using Quantity = StressHistory::Quantity;

namespace {

struct Channels {
    std::vector<std::string> names;
    const char* unit;
};

Channels getChannels(Quantity quantity) {
    const auto tensor = [](const std::string& name) {
        std::vector<std::string> names;
        for (const char* axes : {"xx", "yy", "zz", "xy", "xz", "yz"})
            names.push_back(name + "_" + axes);
        return names;
    };
    switch (quantity) {
        case Quantity::Stress:
            return {tensor("stress"), "Pa"};
        case Quantity::StressInGround:
            return {tensor("stress_ground"), "Pa"};
        case Quantity::Strain:
            return {tensor("strain"), "1"};
        case Quantity::VonMises:
            return {{"von_mises"}, "Pa"};
        case Quantity::SignedVonMises:
            return {{"signed_von_mises"}, "Pa"};
        case Quantity::PrincipalStress:
            return {{"principal_1", "principal_2", "principal_3"}, "Pa"};
        case Quantity::Displacement:
            return {{"displacement_x", "displacement_y", "displacement_z"}, "m"};
    }
    throw std::invalid_argument("StressHistory: unknown quantity");
}

void takeTensor(const SymMat33& t, std::vector<double>& row) {
    for (const double component : {t(0, 0), t(1, 1), t(2, 2), t(1, 0), t(2, 0), t(2, 1)})
        row.push_back(component);
}

}  // namespace

StressHistory::StressHistory(const std::string& path, Real interval)
    : PeriodicEventReporter(checkReportInterval(interval, "StressHistory")), m_path(path) {}

StressHistory::~StressHistory() = default;

void StressHistory::addChannels(const FlexibleBody& body, Quantity quantity,
                                const std::vector<int>& nodeNumbers) {
    if (m_file)
        throw std::logic_error("StressHistory '" + m_path +
                               "': channels cannot be added once the run has begun");
    StressRecovery nodes(body, nodeNumbers);
    if (quantity != Quantity::Displacement) nodes.checkStress();
    const Channels channels = simflex::getChannels(quantity);
    for (const int number : nodeNumbers)
        for (const std::string& name : channels.names)
            m_columns.push_back(
                {body.getName() + "." + std::to_string(number) + "." + name, channels.unit});
    m_sources.push_back({quantity, std::move(nodes)});
}

void StressHistory::flush() const {
    if (m_file) m_file->flush();
}

void StressHistory::takeRow(const State& state, Source& source) const {
    StressRecovery& nodes = source.nodes;
    switch (source.quantity) {
        case Quantity::Stress:
        case Quantity::StressInGround:
            nodes.calcStress(state, m_tensors,
                             source.quantity == Quantity::Stress ? StressRecovery::Axes::Body
                                                                 : StressRecovery::Axes::Ground);
            for (const SymMat33& stress : m_tensors) takeTensor(stress, m_row);
            break;
        case Quantity::Strain:
            nodes.calcStrain(state, m_tensors);
            for (const SymMat33& strain : m_tensors) takeTensor(strain, m_row);
            break;
        case Quantity::VonMises:
            nodes.calcVonMises(state, m_numbers);
            for (int k = 0; k < m_numbers.size(); ++k) m_row.push_back(m_numbers[k]);
            break;
        case Quantity::SignedVonMises:
            nodes.calcStress(state, m_tensors);
            for (const SymMat33& stress : m_tensors) m_row.push_back(calcSignedVonMises(stress));
            break;
        case Quantity::PrincipalStress:
        case Quantity::Displacement:
            if (source.quantity == Quantity::Displacement)
                nodes.calcDisplacement(state, m_vectors);
            else
                nodes.calcPrincipalStress(state, m_vectors);
            for (const Vec3& v : m_vectors) m_row.insert(m_row.end(), &v[0], &v[0] + 3);
            break;
    }
}

void StressHistory::handleEvent(const State& state) const {
    const Real time = state.getTime(), apart = 1e-6 * getEventInterval();
    if (time < m_lastTime - apart)
        throw std::runtime_error("StressHistory '" + m_path + "': time went back from " +
                                 std::to_string(m_lastTime) + " to " + std::to_string(time) +
                                 " s; give each run a history of its own");
    if (time < m_lastTime + apart) return;
    if (!m_file) m_file = std::make_unique<TableFile>(m_path, m_columns);
    m_row.clear();
    for (Source& source : m_sources) takeRow(state, source);
    m_file->append(time, m_row.data());
    m_lastTime = time;
}

}  // namespace simflex
