#include "simflex/model/analyses/StateRows.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string_view>

#include "simflex/body/StateCopy.h"
#include "simflex/forces/JointFriction.h"
#include "simflex/model/analyses/StateNumbers.h"

namespace simflex {
namespace model {

using SimTK::ConstraintIndex;
using SimTK::MobilizedBody;
using SimTK::MobilizedBodyIndex;
using SimTK::State;
using SimTK::Vector;

namespace {

using Names = std::vector<std::string>;

constexpr std::string_view TurnsOf = "turns of '";  // a coordinate of a joint

/** Names of a mobilizer's coordinates or speeds: x, y, z and a rotation if it is free, else
numbers. **/
Names nameCoordinates(int count, bool areSpeeds) {
    if (count == 7 && !areSpeeds)
        return {"quaternion.w", "quaternion.x", "quaternion.y", "quaternion.z", "x", "y", "z"};
    if (count == 6 && areSpeeds)
        return {"angular_velocity.x", "angular_velocity.y", "angular_velocity.z",
                "velocity.x",         "velocity.y",         "velocity.z"};
    Names names;
    for (int k = 0; k < count; ++k) names.push_back((areSpeeds ? "u" : "q") + std::to_string(k));
    return names;
}

std::ptrdiff_t countTurnColumns(const std::map<std::string, Names>& columns) {
    const auto z = columns.find("z");
    if (z == columns.end()) return 0;
    return std::count_if(z->second.begin(), z->second.end(), [](const std::string& name) {
        return name.compare(0, TurnsOf.size(), TurnsOf) == 0;
    });
}

}  // namespace

StateRows::StateRows(const Model& model) : m_model(model), m_start(model.makeInitialState()) {
    const SimTK::SimbodyMatterSubsystem& matter = model.getMatter();
    const FlexibleBodySubsystem& subsystem = model.getFlexibleBodies();
    Names q(size_t(m_start.getNQ())), u(size_t(m_start.getNU()));
    const auto put = [&](const MobilizedBody& mobod, const std::string& name, const Names& ofQ,
                         const Names& ofU) {
        for (int k = 0; k < mobod.getNumQ(m_start); ++k)
            q.at(size_t(mobod.getFirstQIndex(m_start) + k)) = name + '.' + ofQ.at(size_t(k));
        for (int k = 0; k < mobod.getNumU(m_start); ++k)
            u.at(size_t(mobod.getFirstUIndex(m_start) + k)) = name + '.' + ofU.at(size_t(k));
    };
    const auto putUsual = [&](const MobilizedBody& mobod, const std::string& name) {
        put(mobod, name, nameCoordinates(mobod.getNumQ(m_start), false),
            nameCoordinates(mobod.getNumU(m_start), true));
    };
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i)
        putUsual(matter.getMobilizedBody(i), "mobilizer " + std::to_string(int(i)));
    for (const Model::BodyEntry& body : model.getBodies()) {
        putUsual(body.mobod, body.name);
        int mode = 0;
        for (int k = 0; body.flexible && k < body.flexible->getNumModalMobilizers(); ++k) {
            const MobilizedBody& mobod = body.flexible->getModalMobilizer(k);
            Names modes;
            for (int i = 0; i < mobod.getNumU(m_start); ++i)
                modes.push_back("mode " + std::to_string(++mode));
            put(mobod, body.name, modes, modes);
        }
    }
    Names z, holding, multipliers;
    for (int k = 0; k < m_start.getNZ(); ++k)
        z.push_back(m_start.getNZ() == subsystem.getNumStates() ? subsystem.getStateName(k)
                                                                : "z" + std::to_string(k));
    const auto describe = [](ConstraintIndex c) { return "constraint " + std::to_string(int(c)); };
    std::set<ConstraintIndex> own;
    const auto add = [&](const std::string& name, int constraint, int number) {
        m_multipliers.push_back({constraint, number});
        for (int k = 0; k < number; ++k)
            multipliers.push_back(name + (number > 1 ? '.' + std::to_string(k) : ""));
    };
    Names constraintNames;
    for (ConstraintIndex c(0); c < matter.getNumConstraints(); ++c)
        constraintNames.push_back(describe(c));
    for (JointIndex j(0); j < subsystem.getNumJoints(); ++j) {
        const Joint joint = subsystem.getJoint(j);
        own.insert(joint.getConstraintIndex());
        constraintNames.at(size_t(joint.getConstraintIndex())) = joint.getName();
        add(joint.getName(), joint.getConstraintIndex(), joint.getNumEquations());
    }
    for (ConstraintIndex c(0); c < matter.getNumConstraints(); ++c) {
        if (own.count(c)) continue;
        State enabled = copyState(m_start);
        matter.getConstraint(c).enable(enabled);
        model.getSystem().realize(enabled, SimTK::Stage::Instance);
        int position = 0, velocity = 0, acceleration = 0;
        matter.getConstraint(c).getNumConstraintEquationsInUse(enabled, position, velocity,
                                                               acceleration);
        add(describe(c), c, position + velocity + acceleration);
    }
    for (JointIndex j(0); j < subsystem.getNumJoints(); ++j) {
        const Joint joint = subsystem.getJoint(j);
        if (JointFriction::exists(subsystem, joint))
            add("friction of " + joint.getName(), joint.getConstraintIndex(),
                2 * JointFriction(subsystem, joint).getNumRates());
    }
    for (const std::string& name : constraintNames) holding.push_back(name + " holds");
    for (JointIndex j(0); j < subsystem.getNumJoints(); ++j)
        holding.push_back(subsystem.getJoint(j).getName() + " locked at");
    m_columns = {{"q", q},
                 {"u", u},
                 {"z", z},
                 {"holding", holding},
                 {"udot", u},
                 {"multipliers", multipliers},
                 {"moment", {"work", "time"}}};
}

std::vector<int> StateRows::findPlaces(const State& state) const {
    std::vector<int> places;
    int first = 0;
    for (const Rows& rows : m_multipliers) {
        const bool isDisabled =
            m_model.getMatter().getConstraint(ConstraintIndex(rows.constraint)).isDisabled(state);
        for (int k = 0; k < rows.number && !isDisabled; ++k) places.push_back(first + k);
        first += rows.number;
    }
    return places;
}

std::vector<double> StateRows::pack(const Moment& moment) const {
    const State& state = moment.state;
    std::vector<double> row = toNumbers(state.getQ());
    const auto append = [&](const auto& numbers) {
        for (int k = 0; k < int(numbers.size()); ++k) row.push_back(numbers[k]);
    };
    append(state.getU());
    append(state.getZ());
    append(m_model.getFlexibleBodies().getHolding(state));
    append(moment.uDot);
    const std::vector<int> places = findPlaces(state);
    if (int(places.size()) != moment.multipliers.size())
        throw std::logic_error("results cannot keep " + std::to_string(moment.multipliers.size()) +
                               " multipliers where constraints have " +
                               std::to_string(places.size()));
    const size_t first = row.size();
    row.resize(first + m_columns.at("multipliers").size(), 0);
    for (size_t k = 0; k < places.size(); ++k)
        row[first + size_t(places[k])] = moment.multipliers[int(k)];
    row.push_back(moment.work);
    row.push_back(state.getTime());
    return row;
}

void StateRows::keepState(const State& state, Results::Analysis& analysis) const {
    analysis.q = {toNumbers(state.getQ())};
    analysis.u = {toNumbers(state.getU())};
    analysis.z = {toNumbers(state.getZ())};
    analysis.holding = {toNumbers(m_model.getFlexibleBodies().getHolding(state))};
    analysis.moment = {{0, state.getTime()}};
    for (const char* name : {"q", "u", "z", "holding", "moment"})
        analysis.stateColumns[name] = m_columns.at(name);
}

void StateRows::keepMoment(const Moment& moment, Results::Analysis& analysis) const {
    const std::vector<double> row = pack(moment);
    auto at = row.begin();
    for (const ResultState& kept : ResultStates) {
        const auto end = at + std::ptrdiff_t(m_columns.at(kept.name).size());
        (analysis.*kept.rows).emplace_back(at, end);
        at = end;
    }
    analysis.stateColumns = m_columns;
}

State StateRows::unpackState(const Results::Analysis& analysis, size_t row) const {
    if (analysis.time.empty() && analysis.moment.empty())
        throw std::runtime_error("analysis '" + analysis.name +
                                 "' is of an older simflex, which kept no more than coordinates of "
                                 "it: run the model anew");
    for (const ResultState& kept : ResultStates) {
        const auto& rows = analysis.*kept.rows;
        if (&rows == &analysis.z &&
            countTurnColumns(analysis.stateColumns) < countTurnColumns(m_columns))
            throw std::runtime_error("analysis '" + analysis.name +
                                     "' is of an older simflex, which did not keep the turns of "
                                     "angles: run the model anew");
        if (!rows.empty() && rows[row].size() != m_columns.at(kept.name).size())
            throw std::runtime_error("analysis '" + analysis.name + "' has " +
                                     std::to_string(rows[row].size()) + " columns of '" +
                                     kept.name + "', the model " +
                                     std::to_string(m_columns.at(kept.name).size()) +
                                     ": its parts have changed since; run the model anew");
    }
    State state = copyState(m_start);
    if (!analysis.holding.empty()) {
        const FlexibleBodySubsystem& subsystem = m_model.getFlexibleBodies();
        const Vector holding = toVector(analysis.holding[row]);
        if ((subsystem.getHolding(state) - holding).normInf() != 0) {
            subsystem.setHolding(state, holding);
            m_model.getSystem().realizeModel(state);
        }
    }
    setNumbers(state, analysis.moment.empty() ? analysis.time[row] : analysis.moment[row].at(1),
               analysis.q.at(row), analysis.u.at(row));
    if (state.getNZ() > 0) {
        if (analysis.z.empty())
            throw std::runtime_error("analysis '" + analysis.name +
                                     "' is of an older simflex, which did not keep states of "
                                     "controllers, filters and events: run the model anew");
        state.updZ() = toVector(analysis.z[row]);
    }
    m_model.getSystem().realize(state, SimTK::Stage::Velocity);
    return state;
}

KeptMoment StateRows::unpack(const Results::Analysis& analysis, size_t row) const {
    if (analysis.moment.empty())
        throw std::runtime_error("analysis '" + analysis.name +
                                 "' is of an older simflex, which did not keep what forces follow "
                                 "from: run the model anew");
    KeptMoment kept{unpackState(analysis, row), {}, {}, analysis.moment[row][0]};
    kept.uDot = analysis.uDot.empty() ? Vector() : toVector(analysis.uDot[row]);
    const std::vector<int> places = findPlaces(kept.state);
    kept.multipliers.resize(int(places.size()));
    for (size_t k = 0; k < places.size(); ++k)
        kept.multipliers[int(k)] = analysis.multipliers.at(row).at(size_t(places[k]));
    return kept;
}

}  // namespace model
}  // namespace simflex
