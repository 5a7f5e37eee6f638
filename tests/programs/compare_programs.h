#pragma once
/** @file
Force-included before a Simbody program, which compare_programs runs unchanged. The names of
integrator, time stepper and visualizer stand for equivalent classes that end the program at a time
set by the environment. With SIMFLEX_COMPARED defined the integrator is ours. States at evenly
spaced times go to a file.

Environment: COMPARED_OUTPUT, the file; COMPARED_TIME, simulated seconds; COMPARED_ACCURACY,
overrides the program's own; COMPARED_SAMPLES, number of states. **/

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "Simbody.h"
#include "simflex/render/FrameController.h"
#include "simflex/render/FrameReporter.h"
#include "simflex/render/InputSilo.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/solver/RadauIntegrator.h"
#if __has_include("simflex/solver/TimeStepper.h")
#include "simflex/solver/IntegratorRef.h"
#include "simflex/solver/TimeStepper.h"
#endif

namespace compared {

inline double readNumber(const char* name, double fallback) {
    const char* text = std::getenv(name);
    return text ? std::atof(text) : fallback;
}

/** Writes the States of the first simulation, and ends the program after the last one. **/
class Recorder {
public:
    static Recorder& get() {
        static Recorder recorder;
        return recorder;
    }
    /** Starts a simulation. **/
    void begin(const SimTK::State& state) {
        if (m_file && m_start != m_start) {
            m_start = state.getTime();
            write("start", state);
        }
    }
    SimTK::Real getAccuracy() const { return m_accuracy; }
    /** Returns the earliest time after `now` at which a State must be written. **/
    SimTK::Real getNextTime(SimTK::Real now) const {
        for (int i = 1; i <= m_samples; ++i)
            if (getTime(i) > now) return getTime(i);
        return SimTK::Infinity;
    }
    /** @param state  at an output time, at the end of a call, or at the program's own end **/
    void reach(const SimTK::State& state) {
        const SimTK::Real now = state.getTime();
        for (int i = m_next; i <= m_samples && getTime(i) <= now; ++i, ++m_next)
            if (getTime(i) == now) write("state", state);
        if (m_next > m_samples) end();
    }
    /** Ends a simulation before its time. **/
    void endEarly(const SimTK::State& state) {
        write("end", state);
        end();
    }

private:
    Recorder() {
        const char* name = std::getenv("COMPARED_OUTPUT");
        m_file = name ? std::fopen(name, "w") : nullptr;
    }
    SimTK::Real getTime(int i) const { return m_start + m_duration * i / m_samples; }
    void write(const char* what, const SimTK::State& state) {
        if (!m_file) return;
        std::fprintf(m_file, "%s %.17g", what, state.getTime());
        const SimTK::Real constraintError =
            state.getNQErr() > 0 && state.getSystemStage() >= SimTK::Stage::Position
                ? state.getQErr().normInf()
                : 0;
        const SimTK::Vector errors(1, constraintError);
        for (const SimTK::Vector& values : {state.getQ(), state.getU(), errors}) {
            std::fprintf(m_file, " %d", values.size());
            for (int i = 0; i < values.size(); ++i) std::fprintf(m_file, " %.17g", values[i]);
        }
        std::fprintf(m_file, "\n");
        std::fflush(m_file);
    }
    [[noreturn]] void end() {
        std::fflush(nullptr);
        _exit(0);
    }

    std::FILE* m_file;
    const SimTK::Real m_duration = readNumber("COMPARED_TIME", 1);
    const SimTK::Real m_accuracy = readNumber("COMPARED_ACCURACY", 1e-7);
    const int m_samples = int(readNumber("COMPARED_SAMPLES", 8));
    SimTK::Real m_start = SimTK::NaN;
    int m_next = 1;
};

/** Splits an integrator's or time stepper's stepTo() at the Recorder's times. **/
template <class Step, class GetState>
auto stepInParts(SimTK::Real time, const GetState& getState, const Step& step) {
    for (;;) {
        const SimTK::Real now = getState().getTime();
        const SimTK::Real part = std::min(time, Recorder::get().getNextTime(now));
        const auto status = step(part);
        Recorder::get().reach(getState());
        // Any other outcome is up to the caller.
        if (part == time || getState().getTime() < part) return status;
    }
}

template <class Base>
class Integrator : public Base {
public:
    /** Forwards the additional arguments of other integrators' methods. **/
    template <class System, class... Arguments>
    explicit Integrator(const System& system, Arguments&&...) : Base(system) {}

    void setAccuracy(SimTK::Real) {}
    void setConstraintTolerance(SimTK::Real) {}
    void setFixedStepSize(SimTK::Real) {}
    void setMinimumStepSize(SimTK::Real) {}
    void setInitialStepSize(SimTK::Real) {}

    void initialize(const SimTK::State& state) {
        Base::setAccuracy(Recorder::get().getAccuracy());
        Base::initialize(state);
        Recorder::get().begin(Base::getState());
    }
    template <class... Events>
    auto stepTo(SimTK::Real time, Events... events) {
        return stepInParts(
            time, [this]() -> const SimTK::State& { return Base::getState(); },
            [&](SimTK::Real part) { return Base::stepTo(part, events...); });
    }
    template <class... Events>
    auto stepBy(SimTK::Real interval, Events... events) {
        return stepTo(Base::getTime() + interval, (Base::getTime() + events)...);
    }
};

template <class Base, class AnyIntegrator>
class TimeStepper : public Base {
public:
    using Base::Base;
    void initialize(const SimTK::State& state) {
        Base::updIntegrator().setAccuracy(Recorder::get().getAccuracy());
        Base::initialize(state);
        Recorder::get().begin(Base::getState());
    }
    SimTK::Integrator::SuccessfulStepStatus stepTo(SimTK::Real time) {
        return stepInParts(
            time, [this]() -> const SimTK::State& { return Base::getState(); },
            [this](SimTK::Real part) {
                const auto status = Base::stepTo(part);
                if (Base::getIntegrator().isSimulationOver())
                    Recorder::get().endEarly(Base::getState());
                return status;
            });
    }
};

}  // namespace compared

namespace SimTK {
#ifdef SIMFLEX_COMPARED
using ComparedIntegrator = compared::Integrator<simflex::RadauIntegrator>;
using ComparedStiffIntegrator = ComparedIntegrator;
using ComparedTimeStepper = compared::TimeStepper<simflex::TimeStepper, simflex::IntegratorRef>;
using ComparedIntegratorRef = simflex::IntegratorRef;
#else
using ComparedIntegrator = compared::Integrator<RungeKuttaMersonIntegrator>;
using ComparedStiffIntegrator = compared::Integrator<CPodesIntegrator>;
using ComparedTimeStepper = compared::TimeStepper<TimeStepper, Integrator>;
using ComparedIntegratorRef = Integrator;
#endif
using ComparedVisualizer = simflex::OffscreenVisualizer;
}  // namespace SimTK

#define RungeKuttaMersonIntegrator ComparedIntegrator
#define RungeKuttaFeldbergIntegrator ComparedIntegrator
#define RungeKutta3Integrator ComparedIntegrator
#define RungeKutta2Integrator ComparedIntegrator
#define ExplicitEulerIntegrator ComparedIntegrator
#define SemiExplicitEulerIntegrator ComparedIntegrator
#define SemiExplicitEuler2Integrator ComparedIntegrator
#define VerletIntegrator ComparedIntegrator
#define CPodesIntegrator ComparedStiffIntegrator
#define TimeStepper ComparedTimeStepper
#define Visualizer ComparedVisualizer
