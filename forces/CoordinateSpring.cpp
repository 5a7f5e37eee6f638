#include "simflex/forces/CoordinateSpring.h"

#include <algorithm>
#include <cmath>

#include "simflex/body/ForceElement.h"
#include "simflex/body/TurnState.h"
#include "simflex/forces/ElementParameters.h"

namespace simflex {

using namespace SimTK;

namespace {

/** A force along a coordinate that depends on its value and rate. **/
class CoordinateElement : public ForceElement {
public:
    /** @param turns  number of the state that counts the turns of an angle; −1 for displacements
     **/
    CoordinateElement(const Joint::Coordinate& coordinate, int turns)
        : m_coordinate(coordinate.getCoordinate()), m_turns(turns) {
        m_attachments.push_back(coordinate.getFrameF());
        m_attachments.push_back(coordinate.getFrameM());
    }

    void addInForces(const ElementInputs& now, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        const Place place(*this, now, frames);
        const Real force = calcLaw(place.value, place.rate).force;
        forces_G[0] += force * place.onF;
        forces_G[1] += force * place.onM;
    }

    Real calcPotentialEnergy(const ElementInputs& now,
                             const Array_<FrameMotion>& frames) const override {
        const Place place(*this, now, frames);
        return calcLaw(place.value, place.rate).energy;
    }

    Real calcPower(const ElementInputs& now, const Array_<FrameMotion>& frames,
                   const Array_<SpatialVec>&) const override {
        const Place place(*this, now, frames);
        return calcLaw(place.value, place.rate).lost * place.rate;
    }

    int getNumJacobianTerms() const override { return 1; }

    void calcJacobian(const ElementInputs& now, const Array_<FrameMotion>& frames, Real gamma,
                      Array_<Real>& signs, Array_<SpatialVec>& directions) const override {
        const Place place(*this, now, frames);
        const Law law = calcLaw(place.value, place.rate);
        const Real factor = gamma * law.stiffness + law.damping;
        signs[0] = factor < 0 ? -1 : 1;
        directions[0] = std::sqrt(std::abs(factor)) * place.onF;
        directions[1] = std::sqrt(std::abs(factor)) * place.onM;
    }

protected:
    struct Law {
        Real force = 0;
        Real lost = 0;  ///< part of the force that stores no energy
        Real energy = 0;
        Real stiffness = 0, damping = 0;  ///< −∂force/∂value, −∂force/∂rate
    };
    virtual Law calcLaw(Real value, Real rate) const = 0;

private:
    struct Place {
        Place(const CoordinateElement& element, const ElementInputs& now,
              const Array_<FrameMotion>& frames) {
            const JointCoordinate& coordinate = element.m_coordinate;
            coordinate.calcGradient(frames[0].X, frames[1].X, onF, onM);
            // The angle is undefined where axes are aligned.
            if (!onF[0].isFinite() || !onM[0].isFinite()) onF = onM = SpatialVec(Vec3(0), Vec3(0));
            value = coordinate.calcValue(frames[0].X, frames[1].X);
            if (element.m_turns >= 0)
                value = TurnState::followTurns(now.states[element.m_turns], value);
            rate = ~onF[0] * frames[0].V[0] + ~onF[1] * frames[0].V[1] + ~onM[0] * frames[1].V[0] +
                   ~onM[1] * frames[1].V[1];
        }
        Real value, rate;
        SpatialVec onF, onM;  ///< forces on the frames from a unit force along the coordinate
    };

    JointCoordinate m_coordinate;
    int m_turns;
};

class CoordinateSpringElement : public CoordinateElement {
public:
    CoordinateSpringElement(const Joint::Coordinate& coordinate, int turns, Real stiffness,
                            Real rest)
        : CoordinateElement(coordinate, turns), m_stiffness(stiffness), m_rest(rest) {}

protected:
    Law calcLaw(Real value, Real) const override {
        Law law;
        law.force = -m_stiffness * (value - m_rest);
        law.energy = 0.5 * m_stiffness * square(value - m_rest);
        law.stiffness = m_stiffness;
        return law;
    }

private:
    Real m_stiffness, m_rest;
};

class CoordinateDamperElement : public CoordinateElement {
public:
    CoordinateDamperElement(const Joint::Coordinate& coordinate, Real damping)
        : CoordinateElement(coordinate, -1), m_damping(damping) {}

protected:
    Law calcLaw(Real, Real rate) const override {
        Law law;
        law.force = law.lost = -m_damping * rate;
        law.damping = m_damping;
        return law;
    }

private:
    Real m_damping;
};

class CoordinateStopElement : public CoordinateElement {
public:
    CoordinateStopElement(const Joint::Coordinate& coordinate, int turns, Real low, Real high,
                          Real stiffness, Real dissipation)
        : CoordinateElement(coordinate, turns),
          m_low(low),
          m_high(high),
          m_stiffness(stiffness),
          m_dissipation(dissipation) {}

protected:
    Law calcLaw(Real value, Real rate) const override {
        Law law;
        const Real side = value > m_high ? 1 : value < m_low ? -1 : 0;
        if (side == 0) return law;
        const Real depth = side > 0 ? value - m_high : m_low - value, into = side * rate;
        const Real elastic = m_stiffness * depth, push = elastic * (1 + m_dissipation * into);
        law.energy = 0.5 * m_stiffness * square(depth);
        // The stop never pulls: all stored energy is lost then.
        law.force = -side * std::max(Real(0), push);
        law.lost = law.force + side * elastic;
        if (!(push > 0)) return law;
        law.stiffness = m_stiffness * (1 + m_dissipation * into);
        law.damping = elastic * m_dissipation;
        return law;
    }

private:
    Real m_low, m_high, m_stiffness, m_dissipation;
};

std::string nameElement(const char* kind, const Joint::Coordinate& coordinate,
                        const std::string& name) {
    return simflex::nameElement(kind, coordinate.getFrameF(), coordinate.getFrameM(), name);
}

/** Adds the state that tracks an angle from the turn nearest to `start`; −1 for displacements. **/
int countTurnsOf(FlexibleBodySubsystem& subsystem, const Joint::Coordinate& coordinate,
                 const std::string& name, Real start) {
    if (!coordinate.getCoordinate().isPeriodic()) return -1;
    return subsystem.adoptState(
        std::make_unique<TurnState>("turns of force " + name, coordinate.getCoordinate(),
                                    coordinate.getFrameF(), coordinate.getFrameM(), start));
}

}  // namespace

CoordinateSpring::CoordinateSpring(FlexibleBodySubsystem& subsystem,
                                   const Joint::Coordinate& coordinate, Real stiffness, Real rest,
                                   const std::string& name) {
    const std::string called = nameElement("CoordinateSpring", coordinate, name);
    checkNotNegative(called, "stiffness", stiffness);
    checkFinite(called, "rest", rest);
    const int turns = countTurnsOf(subsystem, coordinate, called, rest);
    adoptNamed(subsystem,
               std::make_unique<CoordinateSpringElement>(coordinate, turns, stiffness, rest),
               called);
}

CoordinateDamper::CoordinateDamper(FlexibleBodySubsystem& subsystem,
                                   const Joint::Coordinate& coordinate, Real damping,
                                   const std::string& name) {
    const std::string called = nameElement("CoordinateDamper", coordinate, name);
    checkNotNegative(called, "damping", damping);
    adoptNamed(subsystem, std::make_unique<CoordinateDamperElement>(coordinate, damping), name);
}

CoordinateStop::CoordinateStop(FlexibleBodySubsystem& subsystem,
                               const Joint::Coordinate& coordinate, Real low, Real high,
                               Real stiffness, Real dissipation, const std::string& name) {
    const std::string called = nameElement("CoordinateStop", coordinate, name);
    if (!(low < high))
        throw std::invalid_argument(called + ": its limits are " + std::to_string(low) + " and " +
                                    std::to_string(high) + "; the first must be the lower one");
    checkNotNegative(called, "stiffness", stiffness);
    if (stiffness == 0) throw std::invalid_argument(called + ": stiffness is zero");
    checkNotNegative(called, "dissipation", dissipation);
    Real middle = 0.5 * (low + high);
    if (!isFinite(middle)) middle = isFinite(low) ? low : isFinite(high) ? high : 0;
    const int turns = countTurnsOf(subsystem, coordinate, called, middle);
    adoptNamed(subsystem,
               std::make_unique<CoordinateStopElement>(coordinate, turns, low, high, stiffness,
                                                       dissipation),
               called);
}

}  // namespace simflex
