#include "ContourField.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "SkinProduct.h"
#include "simflex/base/Hash.h"
#include "simflex/render/scene/FrameSnapshot.h"

namespace simflex {

using SimTK::Vec3;

namespace {

constexpr float noValue = std::numeric_limits<float>::quiet_NaN();

// xx yy zz xy xz yz.
double calcVonMises(const float* s) {
    const double xx = s[0], yy = s[1], zz = s[2], xy = s[3], xz = s[4], yz = s[5];
    return std::sqrt(0.5 * ((xx - yy) * (xx - yy) + (yy - zz) * (yy - zz) + (zz - xx) * (zz - xx)) +
                     3 * (xy * xy + xz * xz + yz * yz));
}

struct PrincipalEnds {
    double largest, smallest;
};

// Solves the characteristic cubic by trigonometric functions.
PrincipalEnds calcPrincipalEnds(const float* s) {
    const double mean = (double(s[0]) + s[1] + s[2]) / 3;
    const double xx = s[0] - mean, yy = s[1] - mean, zz = s[2] - mean, xy = s[3], xz = s[4],
                 yz = s[5];
    const double J2 = 0.5 * (xx * xx + yy * yy + zz * zz) + xy * xy + xz * xz + yz * yz;
    if (!(J2 > 0)) return {mean, mean};
    const double J3 =
        xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    const double radius = 2 * std::sqrt(J2 / 3);
    const double cosine = 4 * J3 / (radius * radius * radius);
    const double angle = std::acos(std::min(1.0, std::max(-1.0, cosine))) / 3;
    return {mean + radius * std::cos(angle), mean + radius * std::cos(angle + 2 * SimTK::Pi / 3)};
}

double calcInvariant(Contour contour, const float* stress) {
    if (contour == Contour::VonMises) return calcVonMises(stress);
    const PrincipalEnds ends = calcPrincipalEnds(stress);
    if (contour == Contour::LargestPrincipalStress) return ends.largest;
    if (contour == Contour::SmallestPrincipalStress) return ends.smallest;
    const bool isCompressed = std::abs(ends.smallest) > std::abs(ends.largest);
    return isCompressed ? -calcVonMises(stress) : calcVonMises(stress);
}

double calcEnergyDensity(const float* s, const float* e) {
    return 0.5 * (double(s[0]) * e[0] + double(s[1]) * e[1] + double(s[2]) * e[2]) +
           double(s[3]) * e[3] + double(s[4]) * e[4] + double(s[5]) * e[5];
}

template <class Work>
void forNodes(std::size_t count, std::size_t costOfOne, const Work& work) {
    forSkinChunks(count, costOfOne * count, [&](std::size_t first, std::size_t end) {
        for (std::size_t k = first; k < end; ++k) work(k);
    });
}

Extremes findExtremes(const std::vector<float>& values) {
    float low = std::numeric_limits<float>::infinity(), high = -low;
    for (const float value : values) {  // comparisons with NaN are false
        if (value < low) low = value;
        if (value > high) high = value;
    }
    return {low, high};
}

int findAxis(Contour contour) {
    switch (contour) {
        case Contour::DisplacementX:
        case Contour::VelocityX:
            return 0;
        case Contour::DisplacementY:
        case Contour::VelocityY:
            return 1;
        case Contour::DisplacementZ:
        case Contour::VelocityZ:
            return 2;
        default:
            return -1;
    }
}

}  // namespace

ContourField::ContourField(std::shared_ptr<const SkinModes> skinModes, Contour shownContour,
                           const std::string& bodyName)
    : skin(std::move(skinModes)), contour(shownContour) {
    const ContourTraits& traits = getTraits(contour);
    if (traits.needsVelocity) {
        shapes.data = skin->Phi.data();
        shapes.numRows = shapes.stride = skin->restPositions.size();
    }
    if (!traits.needsStress) return;

    const ReducedBody& part = *skin->part;
    if (!part.modalStress)
        throw std::invalid_argument("cannot show " + std::string(traits.name) + " of body '" +
                                    bodyName + "': part '" + part.name +
                                    "' was reduced without stress; reduce it with "
                                    "'simflex reduce --stress'");
    const std::vector<int>& nodes = part.modalStress->nodes;
    const std::size_t expected = 6 * nodes.size() * std::size_t(part.numModes);
    if (part.modalStress->stress.size() != expected || part.modalStress->strain.size() != expected)
        throw std::invalid_argument("cannot show " + std::string(traits.name) + " of part '" +
                                    part.name + "': " + std::to_string(nodes.size()) +
                                    " nodes with stress need " + std::to_string(expected) +
                                    " values, it has " +
                                    std::to_string(part.modalStress->stress.size()));
    for (int k = 0; k < skin->numNodes(); ++k) {
        const auto found =
            std::lower_bound(nodes.begin(), nodes.end(), skin->nodes[std::size_t(k)]);
        if (found == nodes.end() || *found != skin->nodes[std::size_t(k)]) continue;
        stressNodes.push_back(k);
        stressPlaces.push_back(int(found - nodes.begin()));
    }
    if (stressNodes.empty())
        throw std::invalid_argument("cannot show " + std::string(traits.name) + " of body '" +
                                    bodyName + "': part '" + part.name +
                                    "' has stress at nodes inside only; reduce it with "
                                    "'simflex reduce --stress' for its whole surface");
    stress = pickRows(part.modalStress->stress);
    if (contour == Contour::StrainEnergyDensity) strain = pickRows(part.modalStress->strain);
}

ContourField::Rows ContourField::pickRows(const std::vector<float>& tensors) const {
    const int numModes = skin->part->numModes;
    const std::size_t stride = 6 * skin->part->modalStress->nodes.size();
    Rows rows;
    rows.numRows = 6 * stressNodes.size();
    const bool isRun =
        std::size_t(stressPlaces.back() - stressPlaces.front()) + 1 == stressPlaces.size();
    if (isRun) {  // used in place
        rows.stride = stride;
        rows.data = tensors.data() + 6 * std::size_t(stressPlaces.front());
        return rows;
    }
    rows.stride = rows.numRows;
    rows.own.resize(rows.numRows * std::size_t(numModes));
    for (std::size_t mode = 0; mode < std::size_t(numModes); ++mode)
        for (std::size_t k = 0; k < stressPlaces.size(); ++k)
            std::copy_n(&tensors[mode * stride + 6 * std::size_t(stressPlaces[k])], 6,
                        &rows.own[mode * rows.numRows + 6 * k]);
    rows.data = rows.own.data();
    return rows;
}

void ContourField::multiply(const Rows& rows, const SimTK::Vector& coordinates,
                            Workspace& workspace, std::vector<float>& product) const {
    const int numModes = skin->part->numModes;
    if (coordinates.size() != numModes)
        throw std::invalid_argument("part '" + skin->part->name + "' has " +
                                    std::to_string(numModes) +
                                    " modes, but modal coordinates or speeds have size " +
                                    std::to_string(coordinates.size()));
    workspace.coordinates.resize(std::size_t(numModes));
    for (int i = 0; i < numModes; ++i)
        workspace.coordinates[std::size_t(i)] = float(coordinates[i]);
    product.resize(rows.numRows);

    multiplySkin(rows.data, rows.numRows, rows.stride, numModes, workspace.coordinates.data(),
                 product.data());
}

void ContourField::calcOfDisplacements(const std::vector<float>& displacements,
                                       std::vector<float>& values) const {
    const int axis = findAxis(contour);
    forNodes(values.size(), 4, [&](std::size_t k) {
        const float* u = &displacements[3 * k];
        values[k] = axis < 0 ? std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) : u[axis];
    });
}

void ContourField::calcOfVelocities(const PartSnapshot& motion,
                                    const std::vector<float>& displacements,
                                    Workspace& workspace) const {
    multiply(shapes, motion.xiDot, workspace, workspace.first);
    const SimTK::Rotation& R_GB = motion.X_GB.R();
    const Vec3 omega = ~R_GB * motion.V_GB[0], v = ~R_GB * motion.V_GB[1];
    const int axis = findAxis(contour);
    const Vec3 direction = axis < 0 ? Vec3(0) : ~R_GB * Vec3(axis == 0, axis == 1, axis == 2);
    forNodes(workspace.values.size(), 20, [&](std::size_t k) {
        const std::size_t row = 3 * k;
        const float *s = &skin->restPositions[row], *u = &displacements[row],
                    *uDot = &workspace.first[row];
        const Vec3 r(s[0] + u[0], s[1] + u[1], s[2] + u[2]);
        const Vec3 velocity = v + omega % r + Vec3(uDot[0], uDot[1], uDot[2]);
        workspace.values[k] = float(axis < 0 ? velocity.norm() : SimTK::dot(direction, velocity));
    });
}

void ContourField::calcOfTensors(Workspace& workspace) const {
    if (!isComplete()) std::fill(workspace.values.begin(), workspace.values.end(), noValue);
    forNodes(stressNodes.size(), 40, [&](std::size_t k) {
        const std::size_t row = 6 * k;
        const float* s = &workspace.first[row];
        workspace.values[std::size_t(stressNodes[k])] = float(
            contour == Contour::StrainEnergyDensity ? calcEnergyDensity(s, &workspace.second[row])
                                                    : calcInvariant(contour, s));
    });
}

Extremes ContourField::calcValues(const PartSnapshot& motion,
                                  const std::vector<float>& displacements,
                                  Workspace& workspace) const {
    workspace.values.resize(std::size_t(skin->numNodes()));
    const ContourTraits& traits = getTraits(contour);
    if (traits.needsStress) {
        multiply(stress, motion.xi, workspace, workspace.first);
        if (contour == Contour::StrainEnergyDensity)
            multiply(strain, motion.xi, workspace, workspace.second);
        calcOfTensors(workspace);
    } else if (traits.needsVelocity) {
        calcOfVelocities(motion, displacements, workspace);
    } else {
        calcOfDisplacements(displacements, workspace.values);
    }
    return findExtremes(workspace.values);
}

void ContourField::addTo(Hash& hash) const {
    hash.add(stressNodes);
    for (const Rows* rows : {&stress, &strain})
        for (int mode = 0; rows->data && mode < skin->part->numModes; ++mode)
            hash.addBytes(rows->data + std::size_t(mode) * rows->stride,
                          rows->numRows * sizeof(float));
}

}  // namespace simflex
