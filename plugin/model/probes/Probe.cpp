#include "simflex/model/probes/Probe.h"

#include <algorithm>
#include <map>

#include "simflex/base/ReferenceChain.h"
#include "simflex/model/probes/ProbeKinds.h"

namespace simflex {
namespace model {

namespace {

using Maker = Probe (*)(const ProbeSource& source);

/** By the key that names the quantity. **/
const std::pair<const char*, Maker> ProbeMakers[] = {
    {"displacement", makeDisplacementProbe},
    {"largest_displacement", makeLargestDisplacementProbe},
    {"modes", makeModesProbe},
    {"center_of_mass", makeMassCenterProbe},
    {"stress", makeStressProbe},
    {"strain", makeStrainProbe},
    {"coordinate", makeCoordinateProbe},
    {"rate", makeRateProbe},
    {"joint_error", makeJointErrorProbe},
    {"reaction", makeReactionProbe},
    {"friction", makeFrictionProbe},
    {"driving", makeDrivingProbe},
    {"energy", makeEnergyProbe},
    {"momentum", makeMomentumProbe},
    {"state", makeStateProbe},
    {"function", makeFunctionProbe},
};

/** Makes the probes of a file; formulas first make the probes that they depend on. **/
class ProbeMaker {
public:
    ProbeMaker(std::shared_ptr<const Model> model, const ModelValue& entries)
        : m_model(std::move(model)), m_entries(entries) {}

    Probe make(const std::string& name) {
        const ModelValue entry = m_entries.get(name);
        const auto failChain = [&](const std::string& mistake) { entry.fail(mistake); };
        const auto made = m_made.find(name);
        if (made != m_made.end()) {
            m_chain.repeat(name, failChain);
            return made->second;
        }
        const ReferenceChain::Link link(m_chain, name, failChain);
        Probe probe = makeNew({m_model, entry});
        probe.name = name;
        m_made[name] = probe;
        return probe;
    }

private:
    Probe makeNew(const ProbeSource& source) {
        if (isFrameProbe(source.entry)) return makeFrameProbe(source);
        if (source.entry.has("expression"))
            return makeExpressionProbe(
                source, [this](const ModelValue& formula, const std::string& name) {
                    if (!m_entries.has(name))
                        formula.failUnknown("probe", name, m_entries.getKeys());
                    return make(name);
                });
        for (const auto& [key, maker] : ProbeMakers)
            if (source.entry.has(key)) return maker(source);
        source.entry.fail(
            "does not say what to probe, such as 'position: FRAME' or 'energy: kinetic'");
    }

    std::shared_ptr<const Model> m_model;
    ModelValue m_entries;
    std::map<std::string, Probe> m_made;
    ReferenceChain m_chain{"probes", "the expression depends on itself"};
};

/** Default probes, for models without `probes`. **/
std::vector<Probe> makeUsualProbes(const std::shared_ptr<const Model>& model) {
    std::vector<Probe> probes;
    const auto add = [&](const std::string& name, Probe probe) {
        probe.name = name;
        probes.push_back(std::move(probe));
    };
    for (const Model::JointEntry& entry : model->getJoints())
        if (entry.joint.getNumCoordinates() > 0)
            add(entry.name, makeJointCoordinates(model, entry.joint, -1));
    // Bodies without `mobilizer` are free on Ground: their six coordinates are of little interest.
    for (const Model::BodyEntry& entry : model->getBodies()) {
        const ModelValue mobilizer =
            model->getFile().get("bodies").get(entry.name).get("mobilizer");
        if (entry.flexible || !mobilizer.isGiven()) continue;
        if (entry.mobod.getNumU(model->getSystem().getDefaultState()) > 0)
            add(entry.name + "_coordinate", makeBodyCoordinates(model, entry));
    }
    for (const Model::BodyEntry& entry : model->getBodies()) {
        if (!entry.flexible) continue;
        Probe probe;
        probe.unit = "m";
        probe.columns = {""};
        probe.calc = [model, body = *entry.flexible](const Moment& moment, double* values) {
            *values = body.calcLargestDisplacement(moment.state);
        };
        add(entry.name + "_displacement", probe);
    }
    // The balance is total energy minus work: constant in exact runs, but not necessarily 0.
    for (const auto& [name, kind] :
         {std::pair<const char*, const char*>{"kinetic_energy", "kinetic"},
          {"potential_energy", "potential"},
          {"energy_balance", "balance"}}) {
        Probe probe;
        probe.unit = "J";
        probe.columns = {""};
        probe.calc = [model, kind = std::string(kind)](const Moment& moment, double* values) {
            *values = calcEnergy(*model, moment, kind);
        };
        add(name, probe);
    }
    return probes;
}

}  // namespace

Probe selectComponent(const ModelValue& entry, Probe probe) {
    const std::string component = entry.get("component").getText();
    if (component == "all") return probe;
    const auto calcAll = probe.calc;
    probe.columns = {""};
    if (component == "norm") {
        probe.calc = [calcAll](const Moment& moment, double* values) {
            double all[3];
            calcAll(moment, all);
            *values = SimTK::Vec3(all[0], all[1], all[2]).norm();
        };
        return probe;
    }
    const int axis = component == "x" ? 0 : component == "y" ? 1 : 2;
    probe.calc = [calcAll, axis](const Moment& moment, double* values) {
        double all[3];
        calcAll(moment, all);
        *values = all[axis];
    };
    return probe;
}

Probes Probes::make(const std::shared_ptr<const Model>& model) {
    Probes probes;
    const ModelValue entries = model->getFile().get("probes");
    if (!entries.isGiven()) {
        probes.m_probes = makeUsualProbes(model);
        return probes;
    }
    ProbeMaker maker(model, entries);
    for (const std::string& name : entries.getKeys()) probes.m_probes.push_back(maker.make(name));
    entries.checkRead();
    return probes;
}

int Probes::getNumColumns() const {
    size_t count = 0;
    for (const Probe& probe : m_probes) count += probe.columns.size();
    return int(count);
}

std::vector<double> Probes::calc(const Moment& moment) const {
    std::vector<double> values(size_t(getNumColumns()), SimTK::NaN);
    double* next = values.data();
    for (const Probe& probe : m_probes) {
        probe.calc(moment, next);
        next += probe.columns.size();
    }
    return values;
}

}  // namespace model
}  // namespace simflex
