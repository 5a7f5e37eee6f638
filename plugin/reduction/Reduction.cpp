#include "simflex/reduction/Reduction.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "CraigBampton.h"
#include "Derivatives.h"
#include "FixedInterfaces.h"
#include "MeanAxis.h"
#include "ModalInvariants.h"
#include "ModalStress.h"
#include "Stiffening.h"
#include "simflex/fe/elements/ElementStress.h"
#include "simflex/fe/elements/GeometricStiffness.h"

namespace simflex {
namespace {

/** Fills in ReductionReport. **/
ReductionReport makeReport(const FeProducts& products, const RigidMotion& rigid,
                           const ModeBasis& basis, const MeanAxisModes& modes) {
    ReductionReport report;
    report.numConstraintModes = basis.numConstraint;
    report.numAttachmentModes = basis.numAttachment;
    for (const double omegaSquared : basis.normalOmegaSquared)
        report.normalFrequencies.push_back(std::sqrt(omegaSquared) / (2 * M_PI));
    report.effectiveMasses.assign(basis.effectiveMasses.data(),
                                  basis.effectiveMasses.data() + basis.effectiveMasses.size());
    report.rigidMasses = {rigid.mass,          rigid.mass,          rigid.mass,
                          rigid.inertia(0, 0), rigid.inertia(1, 1), rigid.inertia(2, 2)};

    const Eigen::Index n = modes.Phi.cols();
    const Shapes MPhi = products.m.multiplyPerAxis(modes.Phi);
    const Eigen::MatrixXd mass = modes.Phi.transpose() * MPhi,
                          stiffness = modes.Phi.transpose() * products.K.multiply(modes.Phi);
    const Eigen::MatrixXd Omega2 = modes.omegaSquared.asDiagonal();
    report.massOrthogonality = (mass - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff();
    report.stiffnessOrthogonality =
        (stiffness - Omega2).cwiseAbs().maxCoeff() / modes.omegaSquared[n - 1];
    const Shapes MR = products.m.multiplyPerAxis(rigid.R), KR = products.K.multiply(rigid.R);
    for (Eigen::Index j = 0; j < 6; ++j) {
        const double modalMass = rigid.R.col(j).dot(MR.col(j));
        report.rigidResidual = std::max(
            report.rigidResidual,
            (rigid.R.col(j).transpose() * MPhi).cwiseAbs().maxCoeff() / std::sqrt(modalMass));
        report.rigidEnergy = std::max(report.rigidEnergy, std::abs(rigid.R.col(j).dot(KR.col(j))) /
                                                              modalMass / modes.omegaSquared[0]);
    }
    report.conditionNumber = basis.held->estimateConditionNumber();
    return report;
}

/** Returns the components of the finer twin's modes along shapes that the part lacks. **/
ReducedBody::Further calcFurther(const FeProducts& products, const ModeBasis& basis,
                                 const MeanAxisModes& finerModes) {
    const ModeBasis& finer = *basis.finer;
    const Eigen::Index numKnown = basis.normalOmegaSquared.size(),
                       numNormal = finer.normalOmegaSquared.size() - numKnown,
                       // cannot be separated from the attachment modes of load points
        numStatic = basis.numAttachment == 0 ? finer.numAttachment : 0;
    Shapes shapes(finer.Psi.rows(), numNormal + numStatic);
    shapes << finer.Psi.rightCols(numNormal), finer.Psi.middleCols(finer.numConstraint, numStatic);
    const Eigen::MatrixXd coordinates = products.K.multiply(shapes).transpose() * finerModes.Phi;
    ReducedBody::Further further;
    further.coordinates.assign(coordinates.data(), coordinates.data() + coordinates.size());
    for (Eigen::Index k = 0; k < shapes.cols(); ++k) {
        double squared = 0;
        for (Eigen::Index row = 0; row + 2 < shapes.rows(); row += 3)
            squared = std::max(squared, shapes.col(k).segment<3>(row).squaredNorm());
        further.displacements.push_back(std::sqrt(squared));
    }
    return further;
}

/** Checks requirements of stress and geometric stiffness before the computation. **/
void checkElements(const FeModel& model, const ReductionOptions& options) {
    if (options.stress) ElementStress{model};
    if (!options.hasStiffening) return;
    checkStressesAreKnown(model);
    if (model.elements->beside.hasOtherBodies)
        throw std::invalid_argument("part '" + options.name +
                                    "': geometric stiffness is not possible of a part with rigid "
                                    "bodies (*RIGID BODY, *COUPLING, RBE2) that share nodes, or "
                                    "couplings that hold some directions alone; make them one "
                                    "body or interfaces, or leave stiffening out");
}

}  // namespace

ReducedBody reduce(const FeModel& model, const ReductionOptions& options,
                   const ProgressCallback& progress, ReductionTimings* timings) {
    ReductionTimings local;
    ReductionTimings& time = timings ? *timings : local;
    time = ReductionTimings();
    time.numDofs = model.K.size;
    auto start = std::chrono::steady_clock::now(), lap = start;
    model.validate();
    checkElements(model, options);

    const InterfaceTies ties(model, options);
    Eigen::Matrix3Xd masters(3, ties.ties().size());
    for (size_t k = 0; k < ties.ties().size(); ++k)
        masters.col(k) = Eigen::Map<const Eigen::Vector3d>(ties.ties()[k].master.data());

    const FeProducts products(model, ties.tieOf());
    const RigidMotion rigid = calcRigidMotions(model, products);
    ModeBasis basis = calcCraigBamptonBasis(model, products, rigid, ties, options, progress, time);

    MeanAxisModes modes;
    const auto describe = [&](const ModeBasis& of) {
        reportProgress(progress, "orthonormal modes", -1);
        lapTime(lap);
        try {
            modes = calcMeanAxisModes(options.name, products, rigid, masters, of);
        } catch (const LoosePieces&) {
            throw;  // remains with fewer modes
        } catch (const std::invalid_argument& error) {
            if (!of.group.empty())
                throw std::invalid_argument(std::string(error.what()) + ". " + of.group);
            if (of.lack.empty()) throw;
        }
        if (!of.lack.empty())
            throw std::invalid_argument("part '" + options.name + "': " + of.lack);
        time.orthonormalize += lapTime(lap);

        reportProgress(progress, "invariants", -1);
        ReducedBody body;
        body.name = options.name;
        setModalInvariants(model, products, rigid, modes, ties, body);
        body.report = makeReport(products, rigid, of, modes);
        body.provenance.source = model.source;
        body.provenance.program = model.program;
        time.invariants += lapTime(lap);
        if (options.hasStiffening)
            body.stiffening = calcStiffening(model, products, rigid, ties, of, modes, progress);
        time.stiffening += lapTime(lap);
        if (options.stress)
            body.modalStress = calcModalStress(model, body, *options.stress, progress);
        time.stress += lapTime(lap);
        return body;
    };
    std::shared_ptr<ReducedBody> finer;
    if (basis.finer) {
        finer = std::make_shared<ReducedBody>(describe(*basis.finer));
        finer->further = calcFurther(products, basis, modes);
        finer->validate();
    }
    ReducedBody body = describe(basis);
    body.finer = finer;
    if (!model.parameters.empty())
        body.derivatives = calcDerivatives(model, rigid, ties, modes, progress);
    if (options.numCheckedModes > 0) {
        body.report->staticErrors =
            calcStaticErrors(model, products, rigid, ties, options, basis, modes);
        body.report->fullFrequencies = calcFullFrequencies(
            products, rigid, basis, std::min(options.numCheckedModes, body.numModes), progress);
    }
    time.check = lapTime(lap);
    body.validate();
    time.total = lapTime(start);
    return body;
}

std::string describeEqualModes(const ReducedBody& body, const ReductionOptions& options) {
    const int wanted = options.numModes - 6;
    if (options.highestFrequency || body.numModes == wanted) return "";
    const std::string counts =
        ": " + std::to_string(body.numModes) + " modes instead of " + std::to_string(wanted);
    if (body.numModes < wanted)
        return "the next normal modes have one frequency, as those of equal bays, and are so many "
               "that a few of them would be an arbitrary choice: none is kept" +
               counts;
    return "the next normal mode has the frequency of the last one, as in round parts or those of "
           "equal bays, and is kept with it" +
           counts;
}

std::vector<std::string> listInterfaceWarnings(const FeModel& model,
                                               const ReductionOptions& options) {
    return InterfaceTies(model, options).listWarnings(model.mesh);
}

}  // namespace simflex
