"""What runs leave."""

import h5py
import numpy as np
import pytest
import simflex
from models import make_pendulum


def test_results_are_those_of_the_file(tmp_path):
    path = tmp_path / "run.h5"
    model = make_pendulum(initial={"joints": {"pivot": 0.3}},
                          events={"low": {"when": "angle < 0"}},
                          analyses={"run": {"type": "transient", "duration": 1, "interval": 0.1},
                                    "modes": {"type": "eigen"}})
    results = model.run(path)
    same = simflex.read_results(path)
    assert results.analyses == same.analyses == ["run", "modes"]
    run = same["run"]
    assert run.type == "transient" and run.is_complete and run.probes == ["bob", "angle"]
    assert run.unit("bob") == "m" and run.columns("bob") == ["x", "y", "z"]
    assert [name for name, _ in run.events] == ["low"]
    with h5py.File(path) as file:
        group = file["analyses/run"]
        assert np.array_equal(group["time"], run.time)
        assert np.array_equal(group["probes/bob"], run["bob"])
        assert np.array_equal(group["states/q"], run.q)
        assert np.array_equal(file["analyses/modes/frequency"], same["modes"].frequency)
    with pytest.raises(KeyError, match="angle"):
        run["angel"]
    with pytest.raises(KeyError, match="modes"):
        same["mode"]


def test_files_that_are_none_are_refused(tmp_path):
    bad = tmp_path / "bad.h5"
    bad.write_bytes(b"nothing")
    with pytest.raises(RuntimeError, match="bad.h5"):
        simflex.read_results(bad)


def test_only_what_is_asked_for_is_run(tmp_path):
    model = make_pendulum(analyses={"a": {"type": "eigen"}, "b": {"type": "static"}})
    assert model.run(tmp_path / "run.h5", analyses=["b"]).analyses == ["b"]
    with pytest.raises(Exception, match="'c'"):
        model.run(tmp_path / "run.h5", analyses=["c"])
