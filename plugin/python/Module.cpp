/** @file
The Python module `simflex`. **/

#include "simflex/base/Progress.h"
#include "simflex/model/file/ModelError.h"
#include "simflex/python/Values.h"

PYBIND11_MODULE(simflex, module) {
    namespace py = pybind11;
    using namespace simflex;
    module.doc() =
        "Flexible multibody models that move.\n\n"
        "A Model is what a model file says, or a dict of the same keys; a Session is a model that\n"
        "moves; Results are what `simflex run` leaves; a Part is a reduced finite element model.\n"
        "SI units, angles in radians.\n\n"
        ">>> import simflex\n"
        ">>> model = simflex.Model.from_dict({\n"
        "...     'gravity': [0, -9.81, 0],\n"
        "...     'bodies': {'bob': {'mass': 1, 'inertia': [0.01, 0.01, 0.01],\n"
        "...                        'place': {'position': [0, -1, 0]}}},\n"
        "...     'joints': {'pivot': {'type': 'pin', 'axis': 'z',\n"
        "...                          'between': ['ground', {'on': 'bob', 'position': [0, 1, "
        "0]}]}},\n"
        "...     'probes': {'bob': {'position': 'bob'}}})\n"
        ">>> session = simflex.Session(model)\n"
        ">>> session['joints.pivot.angle'] = 0.1\n"
        ">>> session.run(0.5, interval=0.01)\n"
        "'reached'\n"
        ">>> session['bob'][:2].round(3).tolist()\n"
        "[0.001, -1.0]\n";
    module.attr("__version__") = SIMFLEX_VERSION;

    static py::exception<ModelError> modelError(module, "ModelError", PyExc_ValueError);
    modelError.doc() = "A model that cannot be read or built: names file, line, key and cure.";
    static py::exception<Cancelled> cancelled(module, "Cancelled", PyExc_RuntimeError);
    cancelled.doc() = "A run that its `progress` has ended; what was done is kept.";
    const py::object warning = py::reinterpret_steal<py::object>(PyErr_NewExceptionWithDoc(
        "simflex.SimflexWarning", "What may change the meaning of results.", PyExc_UserWarning,
        nullptr));
    module.add_object("SimflexWarning", warning);
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const ModelError& error) {
            modelError(error.what());
        } catch (const Cancelled& error) {
            // Ctrl-C has already raised its exception.
            if (!PyErr_Occurred()) cancelled(error.what());
        }
    });

    py::module_::import("atexit").attr("register")(py::cpp_function(&python::InterpreterLock::end));

    python::addResults(module);
    python::addModel(module);
    python::addPart(module);
    python::addSession(module);
}
