#include "simflex/solver/equations/StateImage.h"

#include "simflex/body/StateCopy.h"

#include <memory>
#include <utility>

namespace simflex {

using namespace SimTK;

namespace {

/** Calls visit(key) for every discrete variable of a State, subsystem by subsystem. **/
template <class Visit>
void forEachVariable(const State& state, Visit visit) {
    for (SubsystemIndex s(0); s < state.getNumSubsystems(); ++s)
        for (DiscreteVariableIndex d(0); state.hasDiscreteVar({s, d}); ++d)
            visit(DiscreteVarKey(s, d));
}

template <class T>
bool visitPlain(Checkpoint& checkpoint, AbstractValue& value) {
    if (!Value<T>::isA(value)) return false;
    checkpoint.visitBytes(static_cast<void*>(&Value<T>::updDowncast(value).upd()), sizeof(T));
    return true;
}

/** Vector_<T>, Array_<T>, of any length. **/
template <class Collection, class T>
bool visitCollection(Checkpoint& checkpoint, AbstractValue& value) {
    if (!Value<Collection>::isA(value)) return false;
    Collection& elements = Value<Collection>::updDowncast(value).upd();
    const size_t size = checkpoint.visitSize(size_t(elements.size()), sizeof(T));
    elements.resize(int(size));
    for (int i = 0; i < int(size); ++i)
        checkpoint.visitBytes(static_cast<void*>(&elements[i]), sizeof(T));
    return true;
}

bool visitText(Checkpoint& checkpoint, AbstractValue& value) {
    std::string text;
    if (Value<String>::isA(value))
        text = Value<String>::downcast(std::as_const(value)).get();
    else if (Value<std::string>::isA(value))
        text = Value<std::string>::downcast(std::as_const(value)).get();
    else
        return false;
    checkpoint.visit(text);
    if (Value<String>::isA(value))
        Value<String>::updDowncast(value).upd() = text;
    else
        Value<std::string>::updDowncast(value).upd() = text;
    return true;
}

/** @returns false for an unknown type. **/
bool visitValue(Checkpoint& c, AbstractValue& value) {
    return visitPlain<bool>(c, value) || visitPlain<int>(c, value) || visitPlain<long>(c, value) ||
           visitPlain<float>(c, value) || visitPlain<Real>(c, value) ||
           visitPlain<Vec2>(c, value) || visitPlain<Vec3>(c, value) || visitPlain<Vec4>(c, value) ||
           visitPlain<Vec5>(c, value) || visitPlain<Vec6>(c, value) ||
           visitPlain<SpatialVec>(c, value) || visitPlain<Mat33>(c, value) ||
           visitPlain<Quaternion>(c, value) || visitPlain<Rotation>(c, value) ||
           visitPlain<Transform>(c, value) || visitPlain<std::pair<Real, Real>>(c, value) ||
           visitPlain<std::pair<Vec3, Vec3>>(c, value) ||
           visitPlain<std::pair<Vec3, UnitVec3>>(c, value) ||
           visitCollection<Vector, Real>(c, value) ||
           visitCollection<Vector_<Vec3>, Vec3>(c, value) ||
           visitCollection<Vector_<SpatialVec>, SpatialVec>(c, value) ||
           visitCollection<Array_<bool>, bool>(c, value) ||
           visitCollection<Array_<int>, int>(c, value) ||
           visitCollection<Array_<Real>, Real>(c, value) ||
           visitCollection<Array_<Vec3>, Vec3>(c, value) ||
           visitCollection<std::vector<int>, int>(c, value) ||
           visitCollection<std::vector<Real>, Real>(c, value) || visitText(c, value);
}

bool isKnown(const AbstractValue& value) {
    Checkpoint unused;
    const std::unique_ptr<AbstractValue> copy(value.clone());
    return visitValue(unused, *copy);
}

/** A Vector of any length. **/
void visitAnyLength(Checkpoint& c, Vector& values) {
    const size_t size = c.visitSize(size_t(values.size()), sizeof(Real));
    values.resize(int(size));
    if (size > 0) c.visitBytes(&values[0], size * sizeof(Real));
}

/** The same, of the length in the State. **/
void visitVariables(Checkpoint& c, const Vector& now, const char* what, Vector& values) {
    values = now;
    visitAnyLength(c, values);
    if (values.size() != now.size())
        Checkpoint::refuse("it holds " + std::to_string(values.size()) + " " + what +
                           " of Simbody's where this model has " + std::to_string(now.size()));
}

}  // namespace

bool StateImage::isOpaque(const State& state, const DiscreteVarKey& key) const {
    const AbstractValue& value = state.getDiscreteVariable(key.first, key.second);
    // Simbody's own bookkeeping of locks and disabled constraints is accessed through its API.
    const bool isBookkeeping = key.first == m_system.getMatterSubsystem().getMySubsystemIndex() &&
                               std::string(value.getTypeName()).compare(0, 2, "SB") == 0;
    return !isBookkeeping && !isKnown(value);
}

void StateImage::startFrom(const State& state) {
    m_opaque.clear();
    forEachVariable(state, [&](const DiscreteVarKey& key) {
        if (isOpaque(state, key))
            m_opaque.push_back({key, state.getDiscreteVarInfo(key).getValueVersion()});
    });
}

void StateImage::requireWritable(const State& state) const {
    for (const OpaqueVariable& variable : m_opaque) {
        const auto& [subsystem, index] = variable.key;
        const bool isUpdated = state.getDiscreteVarUpdateIndex(subsystem, index).isValid();
        const long long version = state.getDiscreteVarInfo(variable.key).getValueVersion();
        if (!isUpdated && version == variable.version) continue;
        throw std::runtime_error(
            "no checkpoint can be written: subsystem '" +
            std::string(state.getSubsystemName(subsystem)) + "' keeps a variable of type " +
            std::string(state.getDiscreteVariable(subsystem, index).getTypeName()) +
            (isUpdated ? ", which changes with every step (contacts, Measure::Delay and the like)"
                       : ", which an event handler has changed") +
            "; only numbers, vectors and text can be kept");
    }
}

void StateImage::write(const State& state, Checkpoint& checkpoint) const {
    State copy = copyState(state);
    visitSwitches(checkpoint, copy);
    visitVariables(checkpoint, copy);
    Real time = state.getTime();
    Vector q = state.getQ(), u = state.getU(), z = state.getZ(), weights = state.getZWeights();
    checkpoint.visit(time);
    for (Vector* values : {&q, &u, &z, &weights}) visitAnyLength(checkpoint, *values);
}

void StateImage::read(Checkpoint& checkpoint, State& state) const {
    m_system.realizeModel(state);
    visitSwitches(checkpoint, state);
    visitVariables(checkpoint, state);
    Real time = 0;
    checkpoint.visit(time);
    Vector q, u, z, weights;
    simflex::visitVariables(checkpoint, state.getQ(), "coordinates", q);
    simflex::visitVariables(checkpoint, state.getU(), "speeds", u);
    simflex::visitVariables(checkpoint, state.getZ(), "auxiliary variables", z);
    simflex::visitVariables(checkpoint, state.getZWeights(), "weights", weights);
    state.setTime(time);
    state.updQ() = q;
    state.updU() = u;
    state.updZ() = z;
    state.updZWeights() = weights;
}

void StateImage::visitSwitches(Checkpoint& c, State& state) const {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    bool usesEulerAngles = matter.getUseEulerAngles(state);
    c.visit(usesEulerAngles);
    if (usesEulerAngles != matter.getUseEulerAngles(state)) {
        matter.setUseEulerAngles(state, usesEulerAngles);
        m_system.realizeModel(state);
    }
    for (MobilizedBodyIndex b(1); b < matter.getNumBodies(); ++b) {
        const MobilizedBody& body = matter.getMobilizedBody(b);
        int level = body.getLockLevel(state);
        Vector value = body.getLockValueAsVector(state);
        c.visit(level);
        visitAnyLength(c, value);
        if (c.isReading()) {
            if (level == Motion::NoLevel)
                body.unlock(state);
            else if (level < Motion::Acceleration || level > Motion::Position)
                Checkpoint::refuse("body " + std::to_string(int(b)) + " is locked at level " +
                                   std::to_string(level) + ", which does not exist");
            else if (value.size() !=
                     (level == Motion::Position ? body.getNumQ(state) : body.getNumU(state)))
                Checkpoint::refuse("body " + std::to_string(int(b)) + " is locked at " +
                                   std::to_string(value.size()) + " values");
            else
                body.lockAt(state, value, Motion::Level(level));
        }
        if (!body.hasMotion()) continue;
        const Motion& motion = body.getMotion();
        bool isDisabled = motion.isDisabled(state);
        c.visit(isDisabled);
        if (c.isReading() && isDisabled != motion.isDisabled(state)) {
            if (isDisabled)
                motion.disable(state);
            else
                motion.enable(state);
        }
    }
    for (ConstraintIndex k(0); k < matter.getNumConstraints(); ++k) {
        const Constraint& constraint = matter.getConstraint(k);
        bool isDisabled = constraint.isDisabled(state);
        c.visit(isDisabled);
        if (c.isReading() && isDisabled != constraint.isDisabled(state)) {
            if (isDisabled)
                constraint.disable(state);
            else
                constraint.enable(state);
        }
    }
}

void StateImage::visitVariables(Checkpoint& c, State& state) const {
    forEachVariable(state, [&](const DiscreteVarKey& key) {
        const AbstractValue& now = state.getDiscreteVariable(key.first, key.second);
        bool isKept = isKnown(now);
        const bool isKeptHere = isKept;
        std::string type = now.getTypeName();
        c.visit(isKept);
        c.visit(type);
        if (isKept != isKeptHere || type != std::string(now.getTypeName()))
            Checkpoint::refuse("subsystem '" + std::string(state.getSubsystemName(key.first)) +
                               "' keeps a variable of type " + std::string(now.getTypeName()) +
                               ", the checkpoint has one of type " + type);
        if (!isKept) return;
        const std::unique_ptr<AbstractValue> value(now.clone());
        visitValue(c, *value);
        if (c.isReading()) state.updDiscreteVariable(key.first, key.second) = *value;
    });
    m_system.realizeModel(state);
}

std::vector<DiscreteVarKey> listAutoUpdates(const State& state) {
    std::vector<DiscreteVarKey> keys;
    forEachVariable(state, [&](const DiscreteVarKey& key) {
        if (state.getDiscreteVarUpdateIndex(key.first, key.second).isValid()) keys.push_back(key);
    });
    return keys;
}

std::vector<DiscreteVarKey> listLaterVariables(const State& state) {
    std::vector<DiscreteVarKey> keys;
    forEachVariable(state, [&](const DiscreteVarKey& key) {
        if (state.getDiscreteVarInvalidatesStage(key.first, key.second) > Stage::Instance)
            keys.push_back(key);
    });
    return keys;
}

void copyVariables(const std::vector<DiscreteVarKey>& keys, const State& from, State& to) {
    for (const auto& [subsystem, index] : keys)
        to.updDiscreteVariable(subsystem, index) = from.getDiscreteVariable(subsystem, index);
}

State makeFreshState(const MultibodySystem& system, const State& state) {
    State fresh = copyState(state);
    system.realizeModel(fresh);
    fresh.invalidateAll(Stage::Instance);
    if (state.getSystemStage() < Stage::Instance) return fresh;
    // Weights of constraint errors are allocated with the constraints.
    system.realize(fresh, Stage::Instance);
    fresh.updQErrWeights() = state.getQErrWeights();
    fresh.updUErrWeights() = state.getUErrWeights();
    return fresh;
}

}  // namespace simflex
