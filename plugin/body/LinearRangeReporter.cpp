#include "simflex/body/LinearRangeReporter.h"

#include <Eigen/Dense>
#include <cmath>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/ReportInterval.h"

namespace simflex {

using namespace SimTK;
using ::Eigen::Map;
using ::Eigen::MatrixXd;

LinearRangeReporter::LinearRangeReporter(const FlexibleBodySubsystem& subsystem, Real interval,
                                         Warn warn)
    : PeriodicEventReporter(checkReportInterval(interval, "LinearRangeReporter")),
      m_subsystem(subsystem),
      m_warn(std::move(warn)) {
    if (!m_warn) m_warn = [](const std::string& text) { std::cerr << "simflex: " << text << '\n'; };
}

void LinearRangeReporter::warnOnce(int body, bool isRotation, const std::string& message) const {
    if (m_warned.emplace(body, isRotation).second) m_warn(message);
}

void LinearRangeReporter::handleEvent(const State& state) const {
    for (FlexibleBodyIndex b(0); b < m_subsystem.getNumBodies(); ++b) {
        const FlexibleBody body = m_subsystem.getBody(b);
        const ReducedBody& part = body.getPart();
        const Vector modes = body.getModalCoordinates(state);
        ::Eigen::VectorXd xi(part.numModes);
        for (int i = 0; i < part.numModes; ++i) xi[i] = modes[i];
        const auto describe = [&](const std::string& what) {
            std::ostringstream text;
            text.precision(3);
            text << "'" << body.getName() << "' at t = " << state.getTime() << " s: " << what;
            return text.str();
        };
        const auto number = [](Real value) {
            std::ostringstream text;
            text.precision(3);
            text << value;
            return text.str();
        };

        const int nodes = part.mesh.numNodes();
        if (nodes > 0 && !m_warned.count({int(b), false})) {
            const ::Eigen::VectorXd u =
                Map<const MatrixXd>(part.Phi.data(), 3 * nodes, part.numModes) * xi;
            int worst = 0;
            const Real largest = std::sqrt(Map<const ::Eigen::Matrix3Xd>(u.data(), 3, nodes)
                                               .colwise()
                                               .squaredNorm()
                                               .maxCoeff(&worst));
            const Real size = 2 * part.calcRadius();
            if (largest > LargestShare * size)
                warnOnce(int(b), false,
                         describe("node " + std::to_string(part.mesh.nodeNumbers[size_t(worst)]) +
                                  " is displaced by " + number(largest) + " m, " +
                                  number(100 * largest / size) + " % of the part's size (" +
                                  number(size) +
                                  " m); modes describe deformations up to 10 % of it. Divide the "
                                  "part into several, or load it less."));
        }
        for (const ReducedBody::Interface& interface : part.interfaces) {
            const Real angle =
                (Map<const MatrixXd>(interface.Psi.data(), 3, part.numModes) * xi).norm();
            if (angle > LargestRotation)
                warnOnce(
                    int(b), true,
                    describe("interface '" + interface.name + "' is turned by " + number(angle) +
                             " rad against the body's frame; modes describe up to 0.2 rad. "
                             "Divide the part into several, or load it less."));
        }
    }
}

}  // namespace simflex
