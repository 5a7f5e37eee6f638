"""A model that moves."""

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
    # As much sideways as down: the middle of the swing is at 45°.
    assert session.settle().iterations > 0
    assert session["angle"] == pytest.approx(np.pi / 4, abs=1e-9)


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
