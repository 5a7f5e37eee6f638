#include "simflex/forces/StateForces.h"

#include <Eigen/Core>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/ForceElement.h"

namespace simflex {

using namespace SimTK;

namespace {

namespace Eigen = ::Eigen;

/** F = Σ s_i w_i with signals s_i and wrenches w_i on the first frames, one or two. **/
class StateForceElement : public ForceElement {
public:
    void addInForces(const ElementInputs& now, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        for (const Term& term : m_terms) {
            const Real size = term.size.calc(now, frames, term.places);
            SpatialVec wrench[2];
            calcWrench(term, frames, wrench);
            for (unsigned k = 0; k < m_numActing; ++k) forces_G[k] += size * wrench[k];
        }
    }

    int getNumJacobianPairs() const override { return int(m_terms.size()); }

    void calcJacobian(const ElementInputs& now, const Array_<FrameMotion>& frames, Real gamma,
                      Array_<Real>&, Array_<SpatialVec>& directions) const override {
        const unsigned count = frames.size();
        SpatialVec* pair = &directions[unsigned(getNumJacobianTerms()) * count];
        for (const Term& term : m_terms) {
            std::fill_n(pair, 2 * count, SpatialVec(Vec3(0), Vec3(0)));
            SpatialVec wrench[2];
            calcWrench(term, frames, wrench);
            for (unsigned k = 0; k < m_numActing; ++k) pair[k] = -wrench[k];
            addInGradient(term, now, frames, gamma, pair + count);
            pair += 2 * count;
        }
    }

protected:
    StateForceElement(const std::vector<Attachment>& acting)
        : m_numActing(unsigned(acting.size())) {
        for (const Attachment& attachment : acting) m_attachments.push_back(attachment);
    }

    struct Term {
        Signal size;
        int number;  ///< for calcWrench()
        std::vector<int> places;
    };
    void addTerm(const Signal& size, int number) {
        m_terms.push_back({size, number, size.addFramesTo(m_attachments)});
    }
    const Term& getTerm(size_t i) const { return m_terms[i]; }

public:
    /** Finds the states that the terms depend on, also through other states. **/
    void findStates(const FlexibleBodySubsystem& subsystem) {
        const auto& states = subsystem.getGuts().states();
        std::set<int> found;
        for (const Term& term : m_terms) term.size.addStatesTo(found);
        for (size_t known = 0; known < found.size();) {
            known = found.size();
            for (const int state : std::set<int>(found))
                if (const auto* own = dynamic_cast<const SignalState*>(states[size_t(state)].get()))
                    own->getRate().addStatesTo(found);
        }
        for (const int state : found)
            if (const auto* own = dynamic_cast<const SignalState*>(states[size_t(state)].get()))
                m_states.push_back(
                    {state, own->getRate(), own->getRate().addFramesTo(m_attachments)});
        m_numStates = states.size();
    }

protected:
    virtual void calcWrench(const Term& term, const Array_<FrameMotion>& frames,
                            SpatialVec* wrench) const = 0;

private:
    struct State {
        int number;
        Signal rate;
        std::vector<int> places;
    };

    /** Includes the change of the states by the end of a step, δz = γ (1 − γF)⁻¹ ∇ż δ. **/
    void addInGradient(const Term& term, const ElementInputs& now,
                       const Array_<FrameMotion>& frames, Real gamma, SpatialVec* gradient) const {
        if (m_states.empty()) {
            term.size.addInGradient(now, frames, term.places, gamma, 1, {gradient});
            return;
        }
        std::vector<Real> slopes(m_numStates, 0);
        term.size.addInGradient(now, frames, term.places, gamma, 1, {gradient, slopes.data()});
        const Eigen::Index count = Eigen::Index(m_states.size());
        Eigen::MatrixXd A = Eigen::MatrixXd::Identity(count, count);
        Eigen::VectorXd b(count);
        Array_<SpatialVec> unused(frames.size());
        for (Eigen::Index k = 0; k < count; ++k) {
            b[k] = slopes[size_t(m_states[size_t(k)].number)];
            std::vector<Real> rates(m_numStates, 0);
            m_states[size_t(k)].rate.addInGradient(now, frames, m_states[size_t(k)].places, 0, 1,
                                                   {unused.data(), rates.data()});
            for (Eigen::Index j = 0; j < count; ++j)
                A(j, k) -= gamma * rates[size_t(m_states[size_t(j)].number)];
        }
        const Eigen::VectorXd weights = SquareSystem(A).solve(b);
        for (Eigen::Index k = 0; k < count; ++k)
            if (weights[k] != 0)
                m_states[size_t(k)].rate.addInGradient(now, frames, m_states[size_t(k)].places,
                                                       gamma, gamma * weights[k], {gradient});
    }

    unsigned m_numActing;
    std::vector<Term> m_terms;
    std::vector<State> m_states;
    size_t m_numStates = 0;
};

class LineForceElement : public StateForceElement {
public:
    LineForceElement(const Attachment& first, const Attachment& second, const Signal& tension)
        : StateForceElement({first, second}) {
        addTerm(tension, 0);
    }

    /** The line turns with its ends. **/
    int getNumJacobianTerms() const override { return 2; }

    void calcJacobian(const ElementInputs& now, const Array_<FrameMotion>& frames, Real gamma,
                      Array_<Real>& signs, Array_<SpatialVec>& directions) const override {
        StateForceElement::calcJacobian(now, frames, gamma, signs, directions);
        const Vec3 apart = frames[1].X.p() - frames[0].X.p();
        const Real length = apart.norm();
        const Real tension = getTerm(0).size.calc(now, frames, getTerm(0).places);
        const Real across = length > 0 ? gamma * tension / length : 0;
        const Rotation axes(UnitVec3(length > 0 ? apart : Vec3(1, 0, 0)), XAxis);
        std::fill_n(directions.begin(), 2 * frames.size(), SpatialVec(Vec3(0), Vec3(0)));
        for (unsigned i = 0; i < 2; ++i) {
            signs[i] = across < 0 ? -1 : 1;
            const Vec3 d = std::sqrt(std::abs(across)) * Vec3(axes.col(int(i) + 1));
            directions[i * frames.size()][1] = -d;
            directions[i * frames.size() + 1][1] = d;
        }
    }

protected:
    void calcWrench(const Term&, const Array_<FrameMotion>& frames,
                    SpatialVec* wrench) const override {
        const Vec3 apart = frames[1].X.p() - frames[0].X.p();
        const Real length = apart.norm();
        const Vec3 direction = length > 0 ? apart / length : Vec3(0);
        wrench[0] = SpatialVec(Vec3(0), direction);
        wrench[1] = -wrench[0];
    }
};

class CoordinateForceElement : public StateForceElement {
public:
    CoordinateForceElement(const JointCoordinate& coordinate, const Attachment& F,
                           const Attachment& M, const Signal& force)
        : StateForceElement({F, M}), m_coordinate(coordinate) {
        addTerm(force, 0);
    }

protected:
    void calcWrench(const Term&, const Array_<FrameMotion>& frames,
                    SpatialVec* wrench) const override {
        m_coordinate.calcGradient(frames[0].X, frames[1].X, wrench[0], wrench[1]);
    }

private:
    JointCoordinate m_coordinate;
};

/** Terms 0 … 2 are the torque, 3 … 5 the force. **/
class FreeForceElement : public StateForceElement {
public:
    FreeForceElement(const Attachment& attachment, const std::array<Signal, 3>& torque,
                     const std::array<Signal, 3>& force, StateForce::Axes axes)
        : StateForceElement({attachment}), m_axes(axes) {
        for (int i = 0; i < 3; ++i) {
            if (!torque[size_t(i)].isZero()) addTerm(torque[size_t(i)], i);
            if (!force[size_t(i)].isZero()) addTerm(force[size_t(i)], 3 + i);
        }
    }

protected:
    void calcWrench(const Term& term, const Array_<FrameMotion>& frames,
                    SpatialVec* wrench) const override {
        Vec3 axis(0);
        axis[term.number % 3] = 1;
        if (m_axes == StateForce::Axes::Attachment) axis = frames[0].X.R() * axis;
        wrench[0] = SpatialVec(Vec3(0), Vec3(0));
        wrench[0][term.number / 3] = axis;
    }

private:
    StateForce::Axes m_axes;
};

/** Acts at the origin O of B. Its modal forces act as a torque about the x axis of a frame S that
rotates by Ψξ with Ψ = (f_ξᵀ/|f_ξ|; 0; 0), balanced by the opposite torque on O. S is at Tξ, which
gives the torque that the modes add. **/
class SpreadForceElement : public StateForceElement {
public:
    SpreadForceElement(const FlexibleBody& body, const LoadShape& shape, const Signal& scale)
        : StateForceElement({Attachment::onShapes(body, Vec3(0)), makeFrame(body, shape)}),
          m_force(shape.force),
          m_torque(shape.torque),
          m_modal(shape.modal.norm()) {
        addTerm(scale, 0);
    }

protected:
    void calcWrench(const Term&, const Array_<FrameMotion>& frames,
                    SpatialVec* wrench) const override {
        const Rotation& R = frames[0].X.R();
        const Vec3 added = frames[1].X.p() - frames[0].X.p(), onModes = m_modal * Vec3(R.x());
        wrench[0] = SpatialVec(R * m_torque + added - onModes, R * m_force);
        wrench[1] = SpatialVec(onModes, Vec3(0));
    }

private:
    static Attachment makeFrame(const FlexibleBody& body, const LoadShape& shape) {
        const int n = body.getNumModes();
        if (shape.modal.size() != n || shape.torquePerMode.nrow() != 3 ||
            shape.torquePerMode.ncol() != n)
            throw std::invalid_argument(
                "StateLoad on '" + body.getName() + "': the load shape is of " +
                std::to_string(shape.modal.size()) + " modes, the body has " + std::to_string(n));
        const Real size = shape.modal.norm();
        std::vector<double> Phi, Psi;
        for (int i = 0; i < n; ++i) {
            for (int a = 0; a < 3; ++a) Phi.push_back(shape.torquePerMode(a, i));
            Psi.insert(Psi.end(), {size > 0 ? shape.modal[i] / size : 0, 0, 0});
        }
        return Attachment::onShapes(body, Vec3(0), Phi, Psi);
    }

    Vec3 m_force, m_torque;
    Real m_modal;
};

void adopt(FlexibleBodySubsystem& subsystem, std::unique_ptr<StateForceElement> element,
           const std::string& name) {
    element->setName(name);
    element->findStates(subsystem);
    subsystem.adoptForceElement(std::move(element));
}

}  // namespace

LineForce::LineForce(FlexibleBodySubsystem& subsystem, const Attachment& first,
                     const Attachment& second, const Signal& tension, const std::string& name) {
    adopt(subsystem, std::make_unique<LineForceElement>(first, second, tension), name);
}

CoordinateForce::CoordinateForce(FlexibleBodySubsystem& subsystem, const Joint& joint, int number,
                                 const Signal& force, const std::string& name) {
    const JointCoordinateFrames found = findCoordinate(joint, number);
    CoordinateForce(subsystem, found.coordinate, found.F, found.M, force, name);
}

CoordinateForce::CoordinateForce(FlexibleBodySubsystem& subsystem,
                                 const JointCoordinate& coordinate, const Attachment& F,
                                 const Attachment& M, const Signal& force,
                                 const std::string& name) {
    adopt(subsystem, std::make_unique<CoordinateForceElement>(coordinate, F, M, force), name);
}

StateForce::StateForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                       const std::array<Signal, 3>& force, const std::array<Signal, 3>& torque,
                       Axes axes, const std::string& name) {
    adopt(subsystem, std::make_unique<FreeForceElement>(attachment, torque, force, axes), name);
}

StateForce::StateForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                       const std::array<Signal, 3>& force, Axes axes, const std::string& name)
    : StateForce(subsystem, attachment, force, {}, axes, name) {}

StateLoad::StateLoad(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                     const LoadShape& shape, const Signal& scale, const std::string& name) {
    adopt(subsystem, std::make_unique<SpreadForceElement>(body, shape, scale), name);
}

}  // namespace simflex
