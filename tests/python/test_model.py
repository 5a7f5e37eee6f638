"""Sources of models, and messages for invalid ones."""

import doctest

import numpy as np
import pytest
import simflex
from models import make_pendulum


def test_docstrings_are_true():
    result = doctest.testmod(simflex)
    assert result.attempted > 3 and result.failed == 0


def test_dict_file_and_text_move_alike(tmp_path):
    model = make_pendulum(initial={"joints": {"pivot": 0.3}})
    path = tmp_path / "pendulum.yaml"
    path.write_text(model.text)
    ends = []
    for same in (model, simflex.Model(path), simflex.Model.from_text(model.text)):
        session = simflex.Session(same)
        session.run(0.5)
        ends.append(session["bob"])
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])


def test_parameters_and_settings_replace_what_the_file_says(tmp_path):
    path = tmp_path / "pendulum.yaml"
    path.write_text(make_pendulum().text)
    model = simflex.Model(path, {"gravity": np.array([0, -1.62, 0])}, length=np.float64(2))
    session = simflex.Session(model)
    session["joints.pivot.angle"] = 1e-4
    # A physical pendulum: ω² = m g l/(m l² + I).
    session.run(np.pi / 2 / np.sqrt(1.62 * 2 / (4 + 0.02)))
    assert session["angle"] == pytest.approx(0, abs=1e-9)


def test_mistakes_name_key_and_cure():
    with pytest.raises(simflex.ModelError, match="bodies.bob: unknown key 'mas'; did you mean 'mass'"):
        simflex.Session(make_pendulum(bodies={"bob": {"mas": 1}}))
    with pytest.raises(ValueError, match="not a parameter"):
        simflex.Session(make_pendulum(gravity=[0, "-g_moon", 0]))
    model = make_pendulum()
    with pytest.raises(TypeError, match="'bodies.bob.mass': a model file has no object"):
        model.set("bodies.bob.mass", object())
    with pytest.raises(ValueError, match="'bodies.bob.mass': Out of range float"):
        model.bodies.bob.mass = float("nan")
    with pytest.raises(TypeError):
        simflex.Model(3)
    with pytest.raises(RuntimeError, match="nowhere.yaml"):
        simflex.Model("nowhere.yaml")


def test_warnings_are_pythons(tmp_path):
    # The analysis begins statically, without the initial rate of 10 rad/s.
    model = make_pendulum(initial={"start": "static", "rates": {"pivot": 10}})
    with pytest.warns(simflex.SimflexWarning, match="initial velocities have no effect"):
        model.run(tmp_path / "run.h5")
