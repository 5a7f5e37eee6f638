#include "simflex/body/VtkReporter.h"

#include <fcntl.h>
#include <unistd.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "simflex/base/UnfinishedFile.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/ReportInterval.h"
#include "simflex/part/VtuFile.h"

namespace simflex {

using namespace SimTK;
namespace fs = std::filesystem;

namespace {

constexpr const char* Head =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
constexpr const char* Foot = "</Collection>\n</VTKFile>\n";

/** Makes a unique file name: letters, digits, and '_' for everything else. **/
std::string makeFileName(const std::string& body, const std::vector<std::string>& taken) {
    std::string name;
    for (const char c : body) {
        const bool isPlain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                             (c >= '0' && c <= '9') || c == '-' || (c == '.' && !name.empty());
        name += isPlain ? c : '_';
    }
    if (name.empty()) name = "body";
    constexpr size_t Longest = 100;
    name.resize(std::min(name.size(), Longest));
    std::string unique = name;
    for (int k = 2; std::find(taken.begin(), taken.end(), unique) != taken.end(); ++k)
        unique = name + "_" + std::to_string(k);
    return unique;
}

std::string makeFrameName(const std::string& body, int frame) {
    char number[32];
    std::snprintf(number, sizeof number, "_%05d.vtu", frame);
    return body + number;
}

/** Returns the shortest text that reads back to the same number, in any locale. **/
std::string formatExactly(Real value) {
    char text[40];
    return std::string(text, std::to_chars(text, text + sizeof text, double(value)).ptr);
}

void writeFrame(const std::string& path, const FlexibleBody& body, const State& state) {
    const ReducedBody& part = body.getPart();
    const int nodes = part.mesh.numNodes();
    const Vector modes = body.getModalCoordinates(state), speeds = body.getModalSpeeds(state);
    ::Eigen::VectorXd xi(part.numModes), xiDot(part.numModes);
    for (int i = 0; i < part.numModes; ++i) {
        xi[i] = modes[i];
        xiDot[i] = speeds[i];
    }
    const ::Eigen::Map<const ::Eigen::MatrixXd> Phi(part.Phi.data(), 3 * nodes, part.numModes);
    const ::Eigen::VectorXd u = Phi * xi, uDot = Phi * xiDot;
    const Transform X_GB = body.getFramePose(state);
    const SpatialVec V_GB = body.getFrameVelocity(state);

    std::vector<double> points;
    std::vector<float> displacements, velocities;
    for (int node = 0; node < nodes; ++node) {
        const auto vectorOf = [node](const auto& all) {
            return Vec3(all[3 * node], all[3 * node + 1], all[3 * node + 2]);
        };
        const Vec3 u_G = X_GB.R() * vectorOf(u);
        const Vec3 r_G = X_GB.R() * vectorOf(part.mesh.positions.data()) + u_G;
        const Vec3 v_G = V_GB[1] + V_GB[0] % r_G + X_GB.R() * vectorOf(uDot);
        for (int axis = 0; axis < 3; ++axis) {
            points.push_back(X_GB.p()[axis] + r_G[axis]);
            displacements.push_back(float(u_G[axis]));
            velocities.push_back(float(v_G[axis]));
        }
    }

    VtuFile file(part.mesh);
    file.setTime(state.getTime());
    file.addTexts("body", {body.getName()});
    file.setPoints(std::move(points));
    file.addPointNumbers("node number", part.mesh.nodeNumbers);
    file.addPointField("displacement [m]", 3, std::move(displacements));
    file.addPointField("velocity [m/s]", 3, std::move(velocities));
    if (part.modalStress) {
        const ReducedBody::ModalStress& modal = *part.modalStress;
        const size_t rows = 6 * modal.nodes.size();
        const ::Eigen::Map<const ::Eigen::MatrixXf> S(modal.stress.data(), ::Eigen::Index(rows),
                                                      part.numModes);
        const ::Eigen::VectorXf sigma = S * xi.cast<float>();
        const float none = std::numeric_limits<float>::quiet_NaN();
        std::vector<float> stress(6 * size_t(nodes), none), vonMises(size_t(nodes), none);
        for (size_t k = 0; k < modal.nodes.size(); ++k) {
            const size_t node = size_t(modal.nodes[k]);
            std::array<double, 6> tensor{};
            for (size_t c = 0; c < 6; ++c) {
                stress[6 * node + c] = sigma[::Eigen::Index(6 * k + c)];
                tensor[c] = double(stress[6 * node + c]);
            }
            vonMises[node] = float(calcVonMises(tensor));
        }
        file.addPointField("stress [Pa]", 6, std::move(stress));
        file.addPointField("von Mises [Pa]", 1, std::move(vonMises));
    }
    file.write(path);
}

}  // namespace

VtkReporter::VtkReporter(const FlexibleBodySubsystem& subsystem, Real interval,
                         const std::string& pvdFile)
    : PeriodicEventReporter(checkReportInterval(interval, "VtkReporter")),
      m_subsystem(subsystem),
      m_pvdFile(pvdFile) {
    if (fs::path(pvdFile).extension() != ".pvd")
        throw std::invalid_argument("VtkReporter: the file '" + pvdFile +
                                    "' must have the suffix .pvd");
}

VtkReporter::~VtkReporter() {
    if (m_file >= 0) close(m_file);
}

void VtkReporter::start() const {
    m_names.clear();
    for (FlexibleBodyIndex b(0); b < m_subsystem.getNumBodies(); ++b)
        m_names.push_back(makeFileName(m_subsystem.getBody(b).getName(), m_names));

    const fs::path folder = fs::path(m_pvdFile).replace_extension();
    std::error_code error;
    fs::create_directories(folder, error);
    if (error || !fs::is_directory(folder))
        throw std::runtime_error("VtkReporter: cannot make the folder '" + folder.string() +
                                 "' for frames: " + error.message());
    refuseLinkedFolder(folder);
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        for (const std::string& body : m_names) {
            int frame = 0, length = 0;
            if (name.compare(0, body.size(), body) == 0 &&
                std::sscanf(name.c_str() + body.size(), "_%5d.vtu%n", &frame, &length) == 1 &&
                body.size() + size_t(length) == name.size())
                fs::remove(entry.path(), error);
        }
    }
    m_file = open(m_pvdFile.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    m_end = 0;
    append(Head);
}

// Entries and footer are written at once, so the file is complete before and after.
void VtkReporter::append(const std::string& entries) const {
    const std::string text = entries + Foot;
    if (m_file < 0 ||
        pwrite(m_file, text.data(), text.size(), off_t(m_end)) != ssize_t(text.size()))
        throw std::runtime_error("VtkReporter: cannot write '" + m_pvdFile +
                                 "': " + std::strerror(errno));
    m_end += (long long)(entries.size());
}

void VtkReporter::handleEvent(const State& state) const {
    if (m_file < 0) start();
    const fs::path folder = fs::path(m_pvdFile).replace_extension();
    std::string entries;
    for (FlexibleBodyIndex b(0); b < m_subsystem.getNumBodies(); ++b) {
        const FlexibleBody body = m_subsystem.getBody(b);
        body.getFrame().getMatterSubsystem().getSystem().realize(state, Stage::Velocity);
        const std::string name = makeFrameName(m_names[size_t(b)], m_numFrames);
        writeFrame((folder / name).string(), body, state);
        entries += "<DataSet timestep=\"" + formatExactly(state.getTime()) + "\" part=\"" +
                   std::to_string(int(b)) + "\" name=\"" + escapeXml(body.getName()) +
                   "\" file=\"" + escapeXml((folder.filename() / name).string()) + "\"/>\n";
    }
    append(entries);
    ++m_numFrames;
}

}  // namespace simflex
