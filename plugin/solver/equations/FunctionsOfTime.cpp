#include "simflex/solver/equations/FunctionsOfTime.h"

#include <algorithm>

namespace simflex {

using namespace SimTK;

namespace {

/** Those without functions share the first place. **/
template <class Source>
int addTimed(const Source& source, bool isTimed, std::vector<const Source*>& sources) {
    if (sources.empty()) sources.push_back(nullptr);
    if (!isTimed) return 0;
    sources.push_back(&source);
    return int(sources.size()) - 1;
}

}  // namespace

int FunctionsOfTime::add(const JointEquations& equations, Real held) {
    const int place =
        addTimed(equations, equations.dependsOnTime() || equations.isLock(), m_equations);
    m_held.resize(m_equations.size(), 0);
    m_held[size_t(place)] = held;
    resize();
    return place;
}

int FunctionsOfTime::add(const ForceElement& element) {
    const int place = addTimed(element, element.hasTimedForce(), m_elements);
    resize();
    return place;
}

int FunctionsOfTime::add(const std::vector<BodyLoad>& loads) {
    const int first = int(m_loads.size());
    for (const BodyLoad& load : loads) m_loads.push_back(&load);
    resize();
    return first;
}

void FunctionsOfTime::resize() {
    // All at once: steps allocate nothing.
    for (TimeValues& values : m_values) {
        values.drives.resize(m_equations.size());
        values.forces.resize(m_elements.size(), SpatialVec(Vec3(0), Vec3(0)));
        values.scales.resize(m_loads.size());
    }
    forget();
}

void FunctionsOfTime::forget() {
    for (TimeValues& values : m_values) values.time = NaN;
    m_lastUse.fill(0);
    m_use = 0;
    m_current = 0;
}

void FunctionsOfTime::moveTo(double time) {
    m_current = obtain(time);
}

const TimeValues& FunctionsOfTime::calc(double time) {
    return m_values[obtain(time)];
}

size_t FunctionsOfTime::obtain(double time) {
    size_t place = 0;
    while (place < Capacity && m_values[place].time != time) ++place;
    if (place == Capacity) {
        place = m_current == 0 ? 1 : 0;
        for (size_t i = 0; i < Capacity; ++i)
            if (i != m_current && m_lastUse[i] < m_lastUse[place]) place = i;
        TimeValues& values = m_values[place];
        values.time = NaN;
        for (size_t i = 0; i < m_equations.size(); ++i)
            if (m_equations[i]) values.drives[i] = m_equations[i]->calcDrive(time, m_held[i]);
        for (size_t i = 0; i < m_elements.size(); ++i)
            if (m_elements[i]) values.forces[i] = m_elements[i]->calcTimedForce(time);
        for (size_t i = 0; i < m_loads.size(); ++i) values.scales[i] = m_loads[i]->scale(time);
        values.time = time;
    }
    m_lastUse[place] = ++m_use;
    return place;
}

}  // namespace simflex
