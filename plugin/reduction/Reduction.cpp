#include "simflex/reduction/Reduction.h"

#include <chrono>

#include "CraigBampton.h"
#include "MeanAxis.h"
#include "ModalInvariants.h"
#include "Stiffening.h"

namespace simflex {

ReducedBody reduce(const FeModel& model, const ReductionOptions& options,
                   const ProgressCallback& progress, ReductionTimings* timings) {
    ReductionTimings local;
    ReductionTimings& time = timings ? *timings : local;
    time = ReductionTimings();
    time.numDofs = model.K.size;
    auto start = std::chrono::steady_clock::now(), lap = start;
    model.validate();

    const InterfaceTies ties(model, options);
    Eigen::Matrix3Xd masters(3, ties.ties().size());
    for (size_t k = 0; k < ties.ties().size(); ++k)
        masters.col(k) = Eigen::Map<const Eigen::Vector3d>(ties.ties()[k].master.data());

    const FeProducts products(model);
    ModeBasis basis = ties.ties().empty()
                          ? calcFreeBasis(model, products, options, progress, time)
                          : calcCraigBamptonBasis(model, products, ties, options, progress, time);

    reportProgress(progress, "orthonormal modes", -1);
    if (!options.stiffening) basis.fixedInterfaces.reset();
    lapTime(lap);
    const RigidMotion rigid = calcRigidMotions(model, products);
    const MeanAxisModes modes = calcMeanAxisModes(options.name, products, rigid, masters, basis);
    time.orthonormalize = lapTime(lap);

    reportProgress(progress, "invariants", -1);
    ReducedBody body;
    body.name = options.name;
    setModalInvariants(model, products, rigid, modes, ties, body);
    body.provenance.source = model.source;
    body.provenance.program = model.program;
    time.invariants = lapTime(lap);
    if (options.stiffening)
        body.stiffening = calcStiffening(model, products, rigid, ties, basis, modes,
                                         *options.stiffening, progress);
    time.stiffening = lapTime(lap);
    body.validate();
    time.total = lapTime(start);
    return body;
}

}  // namespace simflex
