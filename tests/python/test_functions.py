"""Functions of Python in a model's formulas."""

import pickle
import threading

import numpy as np
import pytest
import simflex
from models import make_pendulum


def make_driven(law, **changes):
    return make_pendulum(probes={"bob": {"position": "bob"}, "angle": {"coordinate": "pivot"}, "speed": {"rate": "pivot"}},
                         connectors={"motor": {"type": "motor", "joint": "pivot", "law": law}}, **changes)


def torque(angle, speed, stiffness=20):
    return stiffness * (0.5 - angle) - 3 * speed


FORMULA = "20*(0.5 - angle) - 3*speed"


def run(model, until=1):
    session = simflex.Session(model)
    session.run(until)
    return session


def test_a_function_moves_as_its_formula_does():
    formula, function = run(make_driven(FORMULA)), run(make_driven(torque))
    assert function["angle"] == pytest.approx(formula["angle"], abs=1e-12)
    for session in (formula, function):
        session.settle()
    assert function.eigenmodes().eigenvalue == pytest.approx(formula.eigenmodes().eigenvalue, rel=1e-8)


def test_a_function_is_called_by_its_name():
    model = make_driven("0.5*twice(torque(angle, speed))")
    model.function(torque)

    @model.function
    def twice(x):
        return np.float64(2 * x)

    assert run(model)["angle"] == pytest.approx(run(make_driven(FORMULA))["angle"], abs=1e-12)
    assert simflex.Session(model).formula("twice(4)") == 8
    model.function(lambda x: 3 * x, name="twice")
    assert simflex.Session(model).formula("twice(4)") == 12


def test_a_sampled_function_is_called_once_a_sample():
    calls = []

    def sampled(angle, speed):
        calls.append(angle)
        return torque(angle, speed)

    def make(law):
        return make_driven("u", states={"u": {"sample_and_hold": {"input": law, "period": 0.01}}})

    session = simflex.Session(make(sampled))
    calls.clear()
    session.run(1)
    assert 99 <= len(calls) <= 101
    assert session["angle"] == run(make(FORMULA))["angle"]


def test_what_a_function_raises_is_raised():
    def fragile(angle, speed):
        if angle > 0.3:
            raise ZeroDivisionError("too far")
        return torque(angle, speed)

    model = make_driven(fragile)
    session, other = simflex.Session(model), simflex.Session(model)
    with pytest.raises(ZeroDivisionError, match="too far"):
        session.run(2)
    assert 0 < session.time < 2 and 0.2 < session["angle"] < 0.3
    other.run(0.05)   # is unaffected
    for result in ("much", None, [1, 2]):
        with pytest.raises(TypeError):
            run(make_driven(lambda angle: result))
    with pytest.raises(Exception, match="force 'motor' is not at t = 0"):
        run(make_driven(lambda angle: float("nan")))
    with pytest.raises(KeyboardInterrupt):
        run(make_driven(lambda angle: (_ for _ in ()).throw(KeyboardInterrupt())))


def test_runs_end_with_what_a_function_raises(tmp_path):
    def fragile(t):
        if t > 0.2:
            raise LookupError("no more")
        return 0

    with pytest.raises(LookupError, match="no more"):
        make_driven(fragile).run(tmp_path / "run.h5")
    results = make_driven(torque).run(tmp_path / "run.h5")
    assert results["run"]["angle"][-1] == run(make_driven(torque), 0.5)["angle"]


def test_functions_without_a_use_are_refused():
    for wrong in (lambda: 1, lambda *x: 1, print):
        with pytest.raises(ValueError, match="Model.function"):
            make_driven(wrong)
    with pytest.raises(simflex.ModelError, match="'angel' is not a parameter, table or function; did you mean 'angle'"):
        run(make_driven(lambda angel: 1))
    with pytest.raises(simflex.ModelError, match="too few arguments"):
        model = make_driven("torque(angle)")
        model.function(torque)
        run(model)
    with pytest.raises(TypeError, match="expected a function"):
        make_driven("1").function(3)
    with pytest.raises(ValueError, match="no parameters"):
        make_driven("1").function(lambda: 1)
    for name, words in (("sin", "already has a meaning"), ("length", "of a parameter"), ("a b", "formulas cannot use"), ("t", "already has a meaning")):
        model = make_driven("1")
        model.function(torque, name)
        with pytest.raises(simflex.ModelError, match=words):
            run(model)
    # A motion needs a second derivative.
    model = make_pendulum(motions={"drive": {"joint": "pivot", "position": lambda t: t}})
    with pytest.raises(simflex.ModelError, match="no finite second derivative"):
        run(model)
    session = run(make_driven("1"))
    with pytest.raises(TypeError, match="a model file has no function"):
        session.change("connectors.motor.law", torque)


def test_functions_go_with_pickled_models():
    assert run(pickle.loads(pickle.dumps(make_driven(torque))))["angle"] == run(make_driven(torque))["angle"]


def test_sessions_with_functions_move_in_threads():
    model = make_driven(torque)
    sessions = [simflex.Session(model) for _ in range(4)]
    threads = [threading.Thread(target=session.run, args=(1,)) for session in sessions]
    for thread in threads:
        thread.start()
    for session in (run(model, 0.1), run(model, 0.2)):   # while the threads run
        assert session.formula("call_torque(angle, speed)") == torque(session["angle"], session["speed"])
    for thread in threads:
        thread.join()
    assert all(session["angle"] == sessions[0]["angle"] for session in sessions)


def test_a_function_that_asks_its_own_session_is_told():
    sessions = []
    model = make_driven(lambda angle: sessions[0]["speed"] if sessions else 0)
    sessions.append(simflex.Session(model))
    with pytest.raises(RuntimeError, match="in use already"):
        sessions[0].run(1)
