"""Sessions."""

import os
import subprocess

import numpy as np
import pytest
import simflex
from models import make_pendulum


def start(angle=0.3, **changes):
    return simflex.Session(make_pendulum(initial={"joints": {"pivot": angle}}, **changes))


def test_runs_as_the_program_does(tmp_path):
    model = make_pendulum(initial={"joints": {"pivot": 0.3}})
    results = model.run(tmp_path / "run.h5")
    session = simflex.Session(model)
    assert session.run(0.5, interval=0.01) == "reached"
    record = session.record
    assert np.array_equal(record["time"], results["run"].time)
    assert "run" in results and "bob" in results["run"] and "rest" not in results and "rod" not in results["run"]
    assert list(results) == results.analyses and list(results["run"]) == results["run"].probes
    assert np.array_equal(record["bob"], results["run"]["bob"])
    assert record["bob"].shape == (51, 3) and record["angle"].shape == (51,)


def test_energy_is_kept_and_gravity_accelerates():
    session = start()
    before = session.energy
    session.step(0.4)
    assert session.time == pytest.approx(0.4)
    assert session.energy == pytest.approx(before, abs=1e-7)
    rate = session["joints.pivot.angle_rate"]
    height = session["bob"][1] + np.cos(0.3)
    assert 0.5 * 1.02 * rate**2 + 9.81 * height == pytest.approx(0, abs=1e-6)


def test_what_is_restored_has_the_same_bits():
    session = start()
    session.run(0.2)
    saved = session.save()
    branch = session.copy()
    session.run(0.5)
    end = session["bob"]
    session["joints.pivot.angle"] = 1
    session.restore(saved)
    assert session.time == 0.2
    session.run(0.5)
    branch.run(0.5)
    assert np.array_equal(session["bob"], end)
    assert np.array_equal(branch["bob"], end)
    with pytest.raises(ValueError):
        start(probes={}, joints={}).restore(saved)


def test_joints_stay_closed_where_quantities_are_set():
    session = start()
    session["joints.pivot.angle"] = -0.7
    assert session["angle"] == pytest.approx(-0.7, abs=1e-12)
    assert session["bob"] == pytest.approx([-np.sin(0.7), -np.cos(0.7), 0], abs=1e-9)
    assert session.formula("angle*180/pi") == pytest.approx(np.degrees(-0.7))
    session.change("parameters.length", 2)
    assert session["bob"][1] == pytest.approx(-2 * np.cos(0.3))


def test_inputs_change_on_the_way():
    session = start(0, loads={"push": {"on": "bob", "force": ["push", 0, 0]}}, parameters={"length": 1, "push": 0})
    session.run(0.1)
    assert session["angle"] == 0
    assert not session.change("parameters.push", 9.81, go_on=True)
    assert session.time == 0.1
    # The push equals the weight, so that the equilibrium is at 45°.
    assert session.settle().iterations > 0
    assert session["angle"] == pytest.approx(np.pi / 4, abs=1e-9)


def make_cart(**changes):
    """m ẍ = push + pull − k x − c ẋ, m = 2, k = 50, c = 3."""
    return simflex.Model.from_dict({
        "inputs": {"push": {"unit": "N"}, "pull": 0},
        "bodies": {"cart": {"mass": 2, "inertia": [1, 1, 1], "place": {"position": [1, 0, 0]}}},
        "joints": {"rail": {"type": "slider", "between": ["ground", "cart"], "axis": "x"}},
        "connectors": {"spring": {"type": "spring", "between": ["ground", "cart"], "stiffness": 50, "damping": 3,
                                  "free_length": 1}},
        "loads": {"push": {"on": "cart", "force": ["push + pull", 0, 0]}, "hand": {"on": "cart", "force": [0, 0, 0]}},
        "probes": {"x": {"expression": "place - 1"}, "place": {"position": "cart", "component": "x"},
                   "speed": {"velocity": "cart"}},
        "solver": {"accuracy": 1e-9}, **changes})


def test_inputs_and_outputs_are_arrays():
    session = simflex.Session(make_cart())
    assert session.input_names == ["push", "pull"] and list(session.inputs) == [0, 0]
    assert session.output_names == ["x", "place", "speed.x", "speed.y", "speed.z"]
    session.inputs = [4, 1]
    assert list(session.inputs) == [4, 1] and session["push"] == 4 and session["inputs.pull"] == 1
    session.run(40)
    assert session.outputs == pytest.approx([0.1, 1.1, 0, 0, 0], abs=1e-8)
    for wrong in ([1], [1, 2, 3], 1, []):
        with pytest.raises(ValueError, match=r"2 inputs \(push, pull\), not"):
            session.inputs = wrong
    with pytest.raises(RuntimeError, match="cannot be set to"):
        session.inputs = [1, float("nan")]
    assert list(session.inputs) == [4, 1]
    with pytest.raises(ValueError, match="the model has 0 inputs, not 1"):
        start().inputs = 1


@pytest.mark.parametrize("linear", [False, True])
def test_driven_as_scipy_drives_the_same_equation(linear):
    from scipy.signal import StateSpace, lsim
    rng = np.random.default_rng(3)
    push = rng.normal(size=40)
    values = np.column_stack([push, np.zeros(40)])
    session = simflex.Session(make_cart())
    outputs = session.drive(values, 0.02, linear=linear)
    assert outputs.shape == (40, 5) and session.time == pytest.approx(0.8)
    times = np.arange(41) * 0.02
    plant = StateSpace([[0, 1], [-25, -1.5]], [[0], [0.5]], [[1, 0]], [[0]])
    _, exact, _ = lsim(plant, np.append(push, push[-1]), times, interp=linear)
    assert outputs[:, 0] == pytest.approx(exact[1:], abs=1e-7)
    with pytest.raises(ValueError, match="2 inputs"):
        session.drive(push, 0.02)
    with pytest.raises(TypeError, match="inputs: expected"):
        session.drive(np.zeros((2, 2, 2)), 0.02)
    with pytest.raises(ValueError):
        session.drive(values, -1)
    assert session.drive(np.zeros((0, 2)), 0.1).shape == (0, 5)


def test_matrices_and_responses_are_those_of_the_equation():
    session = simflex.Session(make_cart())
    linear = session.linearize(["loads.hand.force.x"], ["x", "speed.x"])
    assert linear.inputs == ["loads.hand.force.x"] and linear.outputs == ["x", "speed.x"]
    assert linear.output_units == ["", "m/s"] and linear.input_units == ["N"]
    assert np.sort_complex(np.linalg.eigvals(linear.A)) == pytest.approx(np.sort_complex(np.roots([2, 3, 50])))
    frequencies = np.array([0.1, 0.8, 5])
    s = 2j * np.pi * frequencies
    transfer = 1 / (2 * s**2 + 3 * s + 50)
    exact = np.stack([transfer, s * transfer], axis=1)[:, :, None]
    ours = [linear.C @ np.linalg.solve(value * np.eye(2) - linear.A, linear.B) + linear.D for value in s]
    assert np.array(ours) == pytest.approx(exact, rel=1e-6)
    shaken = session.analyse("frequency_response", inputs=["loads.hand.force.x"], outputs=["x", "speed.x"],
                             frequencies=frequencies, adaptive=False)
    assert shaken.response == pytest.approx(exact, rel=1e-6) and list(shaken.frequency) == list(frequencies)
    matrices = session.analyse("linear", inputs=["loads.hand.force.x"], outputs=["x"]).matrices
    assert sorted(matrices) == ["A", "B", "C", "D"] and matrices["A"].shape == (2, 2)
    with pytest.raises(AttributeError, match="no response"):
        session.analyse("eigen").response
    with pytest.raises(simflex.ModelError, match="did you mean"):
        session.linearize(["loads.hand.force.x"], ["xx"])
    session["joints.rail.displacement"] = 1.2
    with pytest.raises(RuntimeError):
        session.linearize(["loads.hand.force.x"])


def test_small_motions():
    session = start(0)
    modes = session.eigenmodes()
    assert modes.frequency == pytest.approx([np.sqrt(9.81 / 1.02) / (2 * np.pi)])
    assert modes.shape.dtype == complex


def test_events_end_a_run():
    session = start(0.3, events={"low": {"when": "angle < 0", "do": [{"stop": True}]}})
    assert session.run(10) == "terminated"
    assert session["angle"] == pytest.approx(0, abs=1e-6)


def test_events_are_told_and_forgotten_where_they_are_to_come():
    session = start(0.3, events={"low": {"when": "angle < 0"}})
    begin = session.save()
    session.run(3)
    period = 2 * np.pi / np.sqrt(9.81 / 1.02)
    (first, time), (second, later) = session.events
    assert first == second == "low" and time == pytest.approx(period / 4, rel=0.01) and later == pytest.approx(time + period, rel=0.01)
    session.restore(begin)
    assert session.events == []
    session.run(1)
    assert session.events == [("low", time)]
    assert session.copy().events == []


def test_unstable_equilibria_are_told():
    session = start(0)
    assert session.settle().unstable_motions == []
    session = simflex.Session(make_pendulum(gravity=[0, 9.81, 0]))
    assert len(session.settle().unstable_motions) == 1


def test_films(tmp_path):
    session = start()
    session.run(0.5, interval=0.1)
    film = session.animation()
    assert film.kind == "gif" and film.data.startswith(b"GIF8")
    assert film._repr_html_().startswith('<img src="data:image/gif;base64,R0lGOD')
    film = session.animation(tmp_path / "swing.mp4", rate=10)
    assert (tmp_path / "swing.mp4").read_bytes() == film.data
    assert film._repr_html_().startswith("<video ")
    with pytest.raises(ValueError, match="suffix must be"):
        session.animation(tmp_path / "swing.png")


def test_pictures():
    session = start()
    picture = session.picture()
    assert picture.dtype == np.uint8 and picture.ndim == 3 and picture.shape[2] == 3
    assert picture.std() > 1
    assert session._repr_png_().startswith(b"\x89PNG")


def test_wrong_arguments_are_named():
    session = start()
    with pytest.raises(RuntimeError, match="did you mean 'joints.pivot.angle'"):
        session["joints.pivot.angel"]
    with pytest.raises(TypeError, match="number or a sequence of numbers"):
        session["joints.pivot.angle"] = "much"
    with pytest.raises(RuntimeError, match="has 1 value"):
        session["joints.pivot.angle"] = [1, 2]
    with pytest.raises(RuntimeError, match="cannot be set to"):
        session["joints.pivot.angle"] = float("nan")
    with pytest.raises(ValueError):
        session.run(-1)
    for never in (float("inf"), float("nan")):
        with pytest.raises(ValueError, match="it needs a later time"):
            session.run(never)
    with pytest.raises(TypeError):
        session.run("soon")
    assert session["angle"] == pytest.approx(0.3)
    rng = np.random.default_rng(1)
    pieces = ["joints", ".", "pivot", "angle", "bodies", "bob", "", "1", "x", "[", "'", "\n", "é", "time", " "]
    for _ in range(300):
        name = "".join(rng.choice(pieces, rng.integers(1, 6)))
        try:
            session[name] = rng.normal(size=rng.integers(0, 4))
            session.formula(name)
        except (RuntimeError, ValueError, IndexError):
            pass


def test_fmus_run_only_where_they_are_allowed(tmp_path):
    (tmp_path / "brain.yaml").write_text("simflex: 1\nbodies: {idle: {mass: 1, shape: {sphere: 0.1}}}\n"
                                         "inputs: {angle: 0}\nprobes: {torque: {expression: 3*(0.5 - angle)}}\n")
    subprocess.run([os.environ["SIMFLEX_PROGRAM"], "fmu", "brain.yaml", "--thin", "-q"], cwd=tmp_path, check=True)
    model = make_pendulum(
        controllers={"pid": {"fmu": str(tmp_path / "brain.fmu"), "inputs": {"angle": "angle"}, "outputs": ["torque"],
                             "period": 0.01}},
        connectors={"motor": {"type": "motor", "joint": "pivot", "law": "pid.torque"}})
    output = tmp_path / "results.h5"
    for refused in (lambda: simflex.Session(model), lambda: model.run(output),
                    lambda: model.analyse("transient", duration=0.1)):
        with pytest.raises(simflex.ModelError, match="brain.fmu' is a program.*allow_fmus=True"):
            refused()
    ends = []
    for place in ({"allow_fmus": True}, {"fmus_in_process": True}, {"allow_fmus": True, "fmu_timeout": 30}):
        session = simflex.Session(model, **place)
        session.run(0.1)
        ends.append(session["angle"])
    assert ends[0] > 0 and ends == [ends[0]] * 3
    assert session.analyse("transient", duration=0.1)["angle"][-1] == pytest.approx(ends[0], abs=1e-6)
    model.run(output, allow_fmus=True)
    assert model.analyse("transient", allow_fmus=True, duration=0.1)["angle"][-1] == pytest.approx(ends[0], abs=1e-6)
