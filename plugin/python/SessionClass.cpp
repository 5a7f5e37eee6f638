#include <pybind11/complex.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>

#include "simflex/base/TemporaryFolder.h"
#include "simflex/model/Session.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/python/Callables.h"
#include "simflex/render/Video.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {
namespace python {

namespace {

using Path = std::filesystem::path;

std::unique_ptr<Session> makeSession(const ModelText& text, bool isRigid, bool isFiner,
                                     const AllowedCode& code, const Callables& callables) {
    ModelOptions options;
    options.code = code;
    if (isRigid) options.bodies = ModelOptions::Bodies::Rigid;
    if (isRigid && isFiner)
        throw std::invalid_argument("bodies are rigid or have further modes: give one of both");
    if (isFiner) options.bodies = ModelOptions::Bodies::Finer;
    options.listener = makeListener(&callables);
    return callables.watch([&] {
        const py::gil_scoped_release unlocked;
        return std::make_unique<Session>(text, options);
    });
}

/** A Session used by one thread at a time: other threads may run during its work, but not access
it. **/
class OwnSession {
public:
    OwnSession(ModelText text, bool isRigid, bool isFiner, const AllowedCode& code)
        : m_isRigid(isRigid),
          m_isFiner(isFiner),
          m_code(code),
          m_callables(text),
          m_session(makeSession(text, isRigid, isFiner, code, m_callables)) {}

    /** Calls work(session), which must not create Python objects. @param isLong  releases the
    interpreter's lock meanwhile **/
    template <class Work>
    auto use(const Work& work, bool isLong = false) {
        const Turn turn(m_isBusy);
        if (m_callables.isEmpty() && !isLong) return work(*m_session);
        const Events events(*this);
        return m_callables.watch([&] {
            const py::gil_scoped_release unlocked;
            return work(*m_session);
        });
    }
    /** Calls work(session), which may create Python objects but evaluates no callables. **/
    template <class Work>
    auto look(const Work& work) {
        const Turn turn(m_isBusy);
        return work(*m_session);
    }
    /** Returns all events so far, in order. **/
    const std::vector<std::pair<std::string, double>>& getEvents() const { return m_events; }
    const Callables& getCallables() const { return m_callables; }
    const AllowedCode& getCode() const { return m_code; }

    std::unique_ptr<OwnSession> copy() {
        auto other = std::make_unique<OwnSession>(
            use([](const Session& session) { return session.getText(); }), m_isRigid, m_isFiner,
            m_code);
        use([&](const Session& session) { other->m_session->restore(session.save()); });
        return other;
    }

private:
    struct Turn {
        std::atomic<bool>& isBusy;
        explicit Turn(std::atomic<bool>& flag) : isBusy(flag) {
            if (isBusy.exchange(true))
                throw std::runtime_error(
                    "this Session is in use already, by another thread or by a function of its "
                    "model: give each thread a Session of its own");
        }
        ~Turn() { isBusy = false; }
        Turn(const Turn&) = delete;
        Turn& operator=(const Turn&) = delete;
    };

    /** Collects events of a scope; after a step back in time, discards later ones. **/
    struct Events {
        OwnSession& own;
        explicit Events(OwnSession& session) : own(session) {}
        ~Events() {
            const double now = own.m_session->getTime();
            auto& all = own.m_events;
            const auto isToCome = [&](const auto& event) { return event.second > now; };
            all.erase(std::remove_if(all.begin(), all.end(), isToCome), all.end());
            for (auto& event : own.m_session->getModel().takeOccurrences())
                all.push_back(std::move(event));
            for (const std::string& warning : own.m_session->getModel().takeEventWarnings()) try {
                    makeListener(nullptr).warn(warning);
                } catch (py::error_already_set& error) {
                    error.discard_as_unraisable("simflex.Session");
                }
        }
        Events(const Events&) = delete;
        Events& operator=(const Events&) = delete;
    };

    bool m_isRigid, m_isFiner;
    AllowedCode m_code;
    Callables m_callables;
    std::unique_ptr<Session> m_session;
    std::vector<std::pair<std::string, double>> m_events;
    std::atomic<bool> m_isBusy{false};
};

const char* finish(Session::Outcome outcome) {
    if (outcome == Session::Outcome::Stopped) {
        if (!PyErr_Occurred()) return "stopped";
        throw py::error_already_set();
    }
    return outcome == Session::Outcome::Terminated ? "terminated" : "reached";
}

const char* runTo(OwnSession& own, const std::function<double(double)>& calcEnd,
                  std::optional<double> interval, const py::object& progress = py::none()) {
    Callables callables = own.getCallables();
    callables.setProgress(progress);
    Interrupts interrupts(&callables);
    return finish(callables.watch([&] {
        return own.use(
            [&](Session& session) {
                const double end = calcEnd(session.getTime());
                return session.runTo(end, interval.value_or(end - session.getTime()),
                                     [&](double fraction) { return interrupts.goesOn(fraction); });
            },
            true);
    }));
}

const char* takeSteps(OwnSession& own, int count) {
    Interrupts interrupts(&own.getCallables());
    return finish(own.use(
        [&](Session& session) {
            return session.step(count, [&](double) { return interrupts.goesOn(); });
        },
        true));
}

py::object get(OwnSession& own, const std::string& path) {
    return toNumberOrArray(own.use([&](const Session& session) { return session.get(path); }));
}

void set(OwnSession& own, const std::string& path, const py::handle& value) {
    const std::vector<double> numbers = toNumbers(value);
    own.use([&](Session& session) { session.set(path, numbers); }, true);
}

bool change(OwnSession& own, const std::string& key, const py::handle& value, bool goesOn) {
    const std::string yaml = toYaml(value, nullptr, key);
    return own.use(
        [&](Session& session) {
            return session.change(key, yaml,
                                  goesOn ? Session::Restart::Never : Session::Restart::IfNeeded);
        },
        true);
}

py::dict getRecord(OwnSession& own) {
    return own.look([](const Session& session) {
        const ProbeRecord& record = session.getRecord();
        py::dict series;
        series["time"] = toArray(record.time);
        size_t first = 0;
        for (const model::Probe& probe : session.getProbes()) {
            series[py::str(probe.name)] = toArray(record.rows, first, probe.columns.size());
            first += probe.columns.size();
        }
        return series;
    });
}

py::object tabulateRecord(OwnSession& own) {
    return own.look([](const Session& session) {
        const ProbeRecord& record = session.getRecord();
        py::dict columns;
        size_t column = 0;
        for (const model::Probe& probe : session.getProbes())
            for (const std::string& name : probe.columns)
                columns[py::str(nameColumn(probe.name, name))] = toArray(record.rows, column++, 1);
        return makeDataFrame(columns, record.time);
    });
}

py::object settle(OwnSession& own) {
    Interrupts interrupts(&own.getCallables());
    const Session::Equilibrium found = own.use(
        [&](Session& session) { return session.settle([&] { return interrupts.goesOn(); }); },
        true);
    py::dict result;
    result["iterations"] = found.numIterations;
    result["free_motions"] = found.freeMotions;
    result["unstable_motions"] = found.unstableMotions;
    result["by_damped_motion"] = found.isByDampedMotion;
    result["branch"] = found.branch;
    return makeNamespace(result);
}

py::object calcModes(OwnSession& own, std::optional<int> wanted) {
    const std::vector<Eigenmode> modes = own.use(
        [&](const Session& session) {
            const SimTK::MultibodySystem& system = session.getModel().getSystem();
            const SimTK::State about = findEquilibriumNearby(system, session.copyState());
            if (wanted) return calcSlowestEigenmodes(system, about, *wanted);
            const Linearization linear = calcLinearization(system, about);
            requireEquilibrium(system, linear);
            return calcEigenmodes(linear);
        },
        true);
    const py::ssize_t count = py::ssize_t(modes.size()),
                      size = modes.empty() ? 0 : modes[0].shape.size();
    py::array_t<double> frequency(count), damping(count);
    py::array_t<std::complex<double>> eigenvalue(count), shape({size, count});
    for (py::ssize_t k = 0; k < count; ++k) {
        const Eigenmode& mode = modes[size_t(k)];
        frequency.mutable_at(k) = mode.isUncertain() ? 0 : mode.frequency;
        damping.mutable_at(k) = mode.isRigidMotion() ? 0 : mode.dampingRatio;
        eigenvalue.mutable_at(k) = mode.eigenvalue;
        for (py::ssize_t i = 0; i < size; ++i) shape.mutable_at(i, k) = mode.shape[int(i)];
    }
    py::dict result;
    result["frequency"] = frequency;
    result["damping_ratio"] = damping;
    result["eigenvalue"] = eigenvalue;
    result["shape"] = shape;
    return makeNamespace(result);
}

py::array_t<double> copyMatrix(const SimTK::Matrix& matrix) {
    py::array_t<double> array({matrix.nrow(), matrix.ncol()});
    for (int i = 0; i < matrix.nrow(); ++i)
        for (int j = 0; j < matrix.ncol(); ++j) array.mutable_at(i, j) = matrix(i, j);
    return array;
}

py::object linearize(OwnSession& own, const std::vector<std::string>& inputs,
                     const std::vector<std::string>& outputs, const std::string& form, int modes,
                     double upTo) {
    ModalForm wanted{ModalForm::Kind::Full, modes, 2 * SimTK::Pi * upTo};
    if (form == "modal" || form == "minimal")
        wanted.kind = form == "modal" ? ModalForm::Kind::Modal : ModalForm::Kind::Minimal;
    else if (form != "full" || modes != 0 || upTo != 0)
        throw py::value_error(form != "full" ? "form is full, modal or minimal, not '" + form + "'"
                                             : "the full form has all modes: choose form='modal'");
    if (!(modes >= 0) || !(upTo >= 0)) throw py::value_error("modes and up_to are not negative");
    Interrupts interrupts(&own.getCallables());
    const LinearSystem linear = own.use(
        [&](const Session& session) {
            return session.linearize(
                inputs, outputs, [&] { return interrupts.goesOn(); }, wanted);
        },
        true);
    py::dict result;
    const auto addPorts = [&](const char* name, const char* unit,
                              const std::vector<LinearSystem::Port>& ports) {
        py::list names, units;
        for (const LinearSystem::Port& port : ports) {
            names.append(port.name);
            units.append(port.unit);
        }
        result[name] = names;
        result[unit] = units;
    };
    result["A"] = copyMatrix(linear.A);
    result["B"] = copyMatrix(linear.B);
    result["C"] = copyMatrix(linear.C);
    result["D"] = copyMatrix(linear.D);
    addPorts("inputs", "input_units", linear.inputs);
    addPorts("outputs", "output_units", linear.outputs);
    return makeNamespace(result);
}

//-------------------------------------------------------------------------------------------------
// inputs and outputs

std::vector<std::string> listInputs(const Session& session) {
    std::vector<std::string> names;
    for (const Model::InputEntry& input : session.getModel().getInputs())
        names.push_back(input.name);
    return names;
}

/** @param rates  empty: 0 **/
std::vector<Session::Input> makeInputs(const Session& session, const double* values,
                                       const double* rates) {
    std::vector<Session::Input> inputs;
    for (const std::string& name : listInputs(session)) {
        inputs.push_back({name, values[inputs.size()], 0});
        if (rates) inputs.back().rate = rates[inputs.size() - 1];
    }
    return inputs;
}

void checkCount(const char* what, size_t count, const std::vector<std::string>& names) {
    if (count == names.size()) return;
    throw py::value_error("the model has " + std::to_string(names.size()) + " " + what +
                          (names.empty() ? "" : " (" + model::joinNames(names) + ")") + ", not " +
                          std::to_string(count));
}

void setInputs(OwnSession& own, const py::handle& values) {
    const std::vector<double> numbers = toNumbers(values);
    own.use(
        [&](Session& session) {
            checkCount("inputs", numbers.size(), listInputs(session));
            session.setInputs(makeInputs(session, numbers.data(), nullptr));
        },
        true);
}

std::vector<double> calcInputs(const Session& session) {
    std::vector<double> values;
    for (const std::string& name : listInputs(session))
        values.push_back(session.get("inputs." + name)[0]);
    return values;
}

std::vector<double> calcOutputs(const Session& session) {
    std::vector<double> all;
    for (const model::Probe& probe : session.getProbes()) {
        const std::vector<double> values = session.calcProbe(probe);
        all.insert(all.end(), values.begin(), values.end());
    }
    return all;
}

std::vector<std::string> listOutputs(const Session& session) {
    std::vector<std::string> names;
    for (const model::Probe& probe : session.getProbes())
        for (const std::string& column : probe.columns)
            names.push_back(nameColumn(probe.name, column));
    return names;
}

py::array_t<double> drive(OwnSession& own, const py::handle& values, double interval,
                          bool isLinear) {
    using Matrix = py::array_t<double, py::array::c_style | py::array::forcecast>;
    const auto matrix = Matrix::ensure(values);
    if (!matrix || matrix.ndim() > 2) {
        PyErr_Clear();
        throw py::type_error("inputs: expected n numbers for one input, or n×inputs, not " +
                             std::string(py::repr(values)));
    }
    const size_t numRows = matrix.ndim() == 0 ? 1 : size_t(matrix.shape(0));
    const size_t width = matrix.ndim() == 2 ? size_t(matrix.shape(1)) : 1;
    Interrupts interrupts(&own.getCallables());
    std::vector<std::vector<double>> rows;
    size_t numOutputs = 0;
    const Session::Outcome outcome = own.use(
        [&](Session& session) {
            checkCount("inputs", width, listInputs(session));
            numOutputs = listOutputs(session).size();
            const double begin = session.getTime();
            std::vector<double> rates(width, 0);
            for (size_t i = 0; i < numRows; ++i) {
                const double* const now = matrix.data() + i * width;
                for (size_t k = 0; k < width; ++k)
                    rates[k] =
                        isLinear && i + 1 < numRows ? (now[width + k] - now[k]) / interval : 0;
                session.setInputs(makeInputs(session, now, rates.data()));
                const auto end = session.runTo(begin + double(i + 1) * interval, interval,
                                               [&](double) { return interrupts.goesOn(); });
                if (end != Session::Outcome::ReachedTime) return end;
                rows.push_back(calcOutputs(session));
            }
            return Session::Outcome::ReachedTime;
        },
        true);
    if (outcome == Session::Outcome::Stopped) finish(outcome);
    py::array_t<double> outputs({rows.size(), numOutputs});
    double* next = outputs.mutable_data();
    for (const std::vector<double>& row : rows) next = std::copy(row.begin(), row.end(), next);
    return outputs;
}

//-------------------------------------------------------------------------------------------------
// pictures

py::array_t<std::uint8_t> draw(OwnSession& own) {
    const Image image = own.use([](const Session& session) { return session.draw(); }, true);
    py::array_t<std::uint8_t> array({image.getHeight(), image.getWidth(), 4});
    std::copy_n(image.getData(), image.getNumBytes(), array.mutable_data());
    return array[py::make_tuple(py::ellipsis(), py::slice(0, 3, 1))].attr("copy")();
}

/** A video as bytes. **/
struct Film {
    std::string kind;  ///< gif, webp, mp4
    std::string data;
};

Film animate(OwnSession& own, const std::optional<Path>& path, double rate) {
    Interrupts interrupts(&own.getCallables());
    const TemporaryFolder folder;
    const std::string file = path ? path->string() : (folder.path() / "motion.gif").string();
    VideoOptions options;
    options.framesPerSecond = rate;
    const bool isComplete = own.use(
        [&](const Session& session) {
            VideoWriter video(file, options);
            const auto visualizer = session.makeVisualizer();
            for (const SimTK::State& state : session.getPath()) {
                if (!interrupts.goesOn()) return false;
                video.write(visualizer->drawFrame(state));
            }
            video.finish();
            return true;
        },
        true);
    if (!isComplete) throw py::error_already_set();
    std::ifstream stream(file, std::ios::binary);
    return {std::filesystem::path(file).extension().string().substr(1),
            {std::istreambuf_iterator<char>(stream), {}}};
}

std::string showInNotebook(const Film& film) {
    const std::string kind = film.kind == "mp4" ? "video/mp4" : "image/" + film.kind;
    const std::string data = py::str(
        py::module_::import("base64").attr("b64encode")(py::bytes(film.data)).attr("decode")());
    return (film.kind == "mp4" ? "<video controls loop src=\"data:" : "<img src=\"data:") + kind +
           ";base64," + data + (film.kind == "mp4" ? "\"></video>" : "\">");
}

py::bytes encodePicture(OwnSession& own) {
    const auto png =
        own.use([](const Session& session) { return session.draw().encodePng(); }, true);
    return py::bytes(reinterpret_cast<const char*>(png.data()), png.size());
}

}  // namespace

void addSession(py::module_& module) {
    py::class_<Film>(module, "Animation", "A video: notebooks show it.")
        .def_readonly("kind", &Film::kind, "gif, webp or mp4")
        .def_property_readonly(
            "data", [](const Film& film) { return py::bytes(film.data); }, "Bytes of the file.")
        .def("_repr_html_", &showInNotebook)
        .def("__repr__", [](const Film& film) {
            return "<simflex.Animation " + film.kind + ", " + std::to_string(film.data.size()) +
                   " bytes>";
        });
    py::class_<SavedState>(module, "SavedState", "Where a Session was, to the last bit.");

    py::class_<OwnSession>(
        module, "Session",
        "A model that moves: started, stepped, looked at, changed, kept, drawn.\n\n"
        "Quantities have names as at the prompt: session['joints.pin.angle'] is\n"
        "a number, session['tip'] a probe, and session['bodies.rod.position'] =\n"
        "[0, 1, 0] sets; joints stay closed. Other threads run while it moves.")
        .def(py::init([](const ModelText& text, bool isRigid, bool isFiner, bool allowsFmus,
                         bool inProcess, double timeout) {
                 return std::make_unique<OwnSession>(text, isRigid, isFiner,
                                                     allowFmus(allowsFmus, inProcess, timeout));
             }),
             py::arg("model"), py::arg("rigid") = false, py::arg("finer") = false,
             py::arg("allow_fmus") = false, py::arg("fmus_in_process") = false,
             py::arg("fmu_timeout") = 60.,
             "Builds the model and goes to its start; `rigid` holds all flexible bodies rigid,\n"
             "`finer` gives them further modes: the error of one without is the difference of two\n"
             "that are moved alike. FMUs of controllers are programs: see Model.run().")
        .def_property_readonly(
            "time",
            [](OwnSession& own) {
                return own.look([](const Session& session) { return session.getTime(); });
            },
            "[s]")
        .def_property_readonly(
            "energy",
            [](OwnSession& own) {
                return own.use([](const Session& session) { return session.calcEnergy(); });
            },
            "Kinetic and potential [J].")
        .def_property_readonly("probes",
                               [](OwnSession& own) {
                                   return own.look([](const Session& session) {
                                       std::vector<std::string> names;
                                       for (const model::Probe& probe : session.getProbes())
                                           names.push_back(probe.name);
                                       return names;
                                   });
                               })
        .def_property_readonly(
            "quantities",
            [](OwnSession& own) {
                return own.use([](const Session& session) { return session.listQuantities(); });
            },
            "Names of all that can be asked for beside probes and parameters.")
        .def(
            "run",
            [](OwnSession& own, double until, std::optional<double> interval,
               const py::object& progress) {
                return runTo(
                    own, [=](double) { return until; }, interval, progress);
            },
            py::arg("until"), py::arg("interval") = py::none(), py::arg("progress") = py::none(),
            "Moves to a time [s] and records the probes at each interval [s]. Returns 'reached',\n"
            "or 'terminated' where an event has ended the motion. Ctrl-C stops where it is,\n"
            "and so does progress(fraction), told now and then, by returning False ('stopped').")
        .def(
            "step",
            [](OwnSession& own, double duration) {
                return runTo(
                    own, [=](double now) { return now + duration; }, std::nullopt);
            },
            py::arg("duration"), "Moves for a time [s].")
        .def("take_steps", &takeSteps, py::arg("count") = 1, "Takes steps of the integrator's own.")
        .def(
            "reset", [](OwnSession& own) { own.use([](Session& s) { s.reset(); }, true); },
            "Back to the start.")
        .def("settle", &settle,
             "Goes to the nearest static equilibrium; returns iterations, and in words\n"
             "free_motions, which nothing holds, and unstable_motions, in which it falls away;\n"
             "by_damped_motion is true if Newton's iteration did not find it; branch warns if it "
             "had\n"
             "left for joints assembled in another way.")
        .def("get", &get, py::arg("path"), "A number, or an array.")
        .def("set", &set, py::arg("path"), py::arg("value"),
             "A number, or a sequence of as many as get() gives. The motion begins anew from "
             "there,\n"
             "with small steps.")
        .def("__getitem__", &get)
        .def("__setitem__", &set)
        .def(
            "formula",
            [](OwnSession& own, const std::string& formula) {
                return own.use(
                    [&](const Session& session) { return session.calcFormula(formula); });
            },
            py::arg("formula"), "Of probes, states, parameters and t as they are now.")
        .def("change", &change, py::arg("key"), py::arg("value"), py::arg("go_on") = false,
             "Gives a key of the model another value and builds it anew. It is back at its start\n"
             "then (returns True), unless nothing that moves has changed, or `go_on` is told: for\n"
             "inputs, such as the size of a load.")
        .def_property_readonly("record", &getRecord,
                               "What run() has recorded, by name of probe, and 'time'.")
        .def(
            "save",
            [](OwnSession& own) {
                return own.use([](const Session& session) { return session.save(); });
            },
            "Where it is; what goes on from restore() has the same bits.")
        .def(
            "restore",
            [](OwnSession& own, const SavedState& saved) {
                own.use([&](Session& session) { session.restore(saved); }, true);
            },
            py::arg("state"), "Back to where save() was; the record ends there.")
        .def("copy", &OwnSession::copy, "Another Session at the same State.")
        .def(
            "keep",
            [](OwnSession& own, const Path& path) {
                own.use([&](const Session& session) { session.keepState(path.string()); });
            },
            py::arg("path"), "Writes the State to a file.")
        .def(
            "restore_kept",
            [](OwnSession& own, const Path& path) {
                own.use([&](Session& session) { session.restoreState(path.string()); }, true);
            },
            py::arg("path"), "Goes to the State of a file.")
        .def("eigenmodes", &calcModes, py::arg("count") = py::none(),
             "Natural modes about this State, an equilibrium or a steady motion: frequency [Hz],\n"
             "damping_ratio, eigenvalue [1/s], shape (speeds × modes); rigid-body modes first, of\n"
             "frequency 0. All of them, or rigid-body modes and the `count` slowest of the others, "
             "which\n"
             "is quick for many bodies.")
        .def("linearize", &linearize, py::arg("inputs"),
             py::arg("outputs") = std::vector<std::string>(), py::arg("form") = "full",
             py::arg("modes") = 0, py::arg("up_to") = 0.0,
             "About this State, an equilibrium or a steady motion: ẋ = A x + B p, y = C x + D p.\n"
             "Inputs are numbers of the model ('loads.push.force.x'), outputs probes ('tip.y'; "
             "none:\n"
             "all). The form is full, modal (A block-diagonal) or minimal (what inputs reach and\n"
             "outputs see), of at most so many modes, or those up to a frequency [Hz]. Returns A, "
             "B,\n"
             "C, D, inputs, input_units, outputs, output_units.")
        .def_property_readonly(
            "input_names", [](OwnSession& own) { return own.look(&listInputs); },
            "Of the model's `inputs`, in their order.")
        .def_property(
            "inputs", [](OwnSession& own) { return toArray(own.use(&calcInputs)); }, &setInputs,
            "Values of all inputs, in the order of input_names; what moves goes on with new ones.")
        .def_property_readonly(
            "output_names", [](OwnSession& own) { return own.look(&listOutputs); },
            "Columns of all probes: height, tip.x, tip.y …")
        .def_property_readonly(
            "outputs", [](OwnSession& own) { return toArray(own.use(&calcOutputs)); },
            "Values of all probes now, in the order of output_names.")
        .def(
            "drive", &drive, py::arg("inputs"), py::arg("interval"), py::arg("linear") = false,
            "Moves on under n×inputs values, one row each interval [s]: held, or linear from one\n"
            "to the next. Returns outputs, n×columns, at the end of each interval; fewer where an\n"
            "event has ended the motion.")
        .def("picture", &draw, "As the model's `pictures` say: height×width×3 of 0…255.")
        .def("_repr_png_", &encodePicture)
        .def("animation", &animate, py::arg("path") = py::none(), py::arg("rate") = 25,
             "A video of the motion so far, which notebooks show: of at most 64 States, evenly\n"
             "chosen, at a rate [1/s]. With a path (.mp4, .gif, .webp) it is written there, too.\n"
             "Needs ffmpeg.")
        .def_property_readonly(
            "events", [](OwnSession& own) { return own.getEvents(); },
            "What has happened in motions until now: (name, time [s]), in its order.")
        .def("to_pandas", &tabulateRecord,
             "What run() has recorded, as a pandas.DataFrame: columns as tip.x, by time [s].")
        .def(
            "analyse",
            [](OwnSession& own, const std::string& type, const py::kwargs& keys) {
                return analyse(own.look([](const Session& session) { return session.getText(); }),
                               type, own.getCode(), keys);
            },
            py::arg("type"), "As Model.analyse(), of the model as it is now, from its own start.")
        .def("__repr__", [](OwnSession& own) {
            return own.look([](const Session& session) {
                return "<simflex.Session '" + session.getTitle() +
                       "' at t = " + std::string(py::str(py::float_(session.getTime()))) + " s>";
            });
        });
}

}  // namespace python
}  // namespace simflex
