"""Results of runs."""

import os
import subprocess
import sys
import types

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
                                    "modes": {"type": "eigen", "about": "static"}})
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


def test_a_run_of_the_program_has_the_same_bits(tmp_path):
    model = make_pendulum(initial={"joints": {"pivot": 0.3}})
    (tmp_path / "pendulum.yaml").write_text(model.text)
    subprocess.run([os.environ["SIMFLEX_PROGRAM"], "run", "pendulum.yaml", "-q", "--no-pictures"], cwd=tmp_path, check=True)
    theirs, ours = simflex.read_results(tmp_path / "pendulum.results.h5")["run"], model.run(tmp_path / "ours.h5")["run"]
    for name in ("time", "q", "u"):
        assert np.array_equal(getattr(ours, name), getattr(theirs, name))
    assert np.array_equal(ours["bob"], theirs["bob"])


def test_tables_and_plots_where_their_packages_are(tmp_path, monkeypatch):
    run = make_pendulum(initial={"joints": {"pivot": 0.3}}).run(tmp_path / "run.h5")["run"]
    session = simflex.Session(make_pendulum())
    session.run(0.1, interval=0.05)
    for name in ("pandas", "matplotlib", "matplotlib.pyplot"):
        monkeypatch.setitem(sys.modules, name, None)
    for work in (run.to_pandas, run.plot, session.to_pandas):
        with pytest.raises(ImportError):
            work()

    class Axes(list):
        def plot(self, x, y, label):
            self.append((x, y, label))

        def set_xlabel(self, text):
            assert text == "t [s]"

        def legend(self):
            pass

    axes = run.plot("bob", axes=Axes())
    assert [label for _, _, label in axes] == ["bob.x [m]", "bob.y [m]", "bob.z [m]"]
    assert np.array_equal(axes[1][0], run.time) and np.array_equal(axes[1][1], run["bob"][:, 1])
    assert len(run.plot(axes=Axes())) == 4
    with pytest.raises(KeyError, match="angle"):
        run.plot("angel", axes=Axes())
    pandas = types.SimpleNamespace(DataFrame=lambda columns, index: (columns, index), Index=lambda values, name: (values, name))
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    for source, rows in ((run, 51), (session, 3)):
        columns, (time, name) = source.to_pandas()
        assert list(columns) == ["bob.x", "bob.y", "bob.z", "angle"] and name == "time"
        assert len(time) == rows and all(column.shape == (rows,) for column in columns.values())


def test_progress_is_told_and_may_end_a_run(tmp_path):
    long = make_pendulum(initial={"joints": {"pivot": 0.3}}, analyses={"run": {"type": "transient", "duration": 1e4, "interval": 1}})
    told = []

    def stop(what, fraction):
        told.append((what, fraction))
        return len(told) < 3

    with pytest.raises(simflex.Cancelled):
        long.run(tmp_path / "run.h5", progress=stop)
    assert len(told) == 3 and told[0][1] <= told[2][1] < 1
    assert not simflex.read_results(tmp_path / "run.h5")["run"].is_complete
    with pytest.raises(LookupError, match="enough"):
        long.run(tmp_path / "run.h5", progress=lambda what, fraction: (_ for _ in ()).throw(LookupError("enough")))
    session = simflex.Session(long)
    fractions = []
    assert session.run(1e4, progress=lambda fraction: fractions.append(fraction) or len(fractions) < 3) == "stopped"
    assert len(fractions) == 3 and 0 < session.time < 1e4
    with pytest.raises(LookupError, match="enough"):
        session.run(1e4, progress=lambda fraction: (_ for _ in ()).throw(LookupError("enough")))
    with pytest.raises(TypeError, match="progress: expected a function"):
        session.run(1e4, progress=3)


def test_an_analysis_that_the_file_does_not_have():
    length = 0.8
    model = make_pendulum(parameters={"length": 1})
    modes = model.analyse("eigen", count=1)
    assert modes.frequency == pytest.approx([np.sqrt(9.81 / 1.02) / (2 * np.pi)])
    session = simflex.Session(model)
    session.change("parameters.length", length)
    campbell = session.analyse("campbell", parameter="length", speeds=[length, 2 * length], count=1)
    lengths = np.array([[length], [2 * length]])
    assert campbell.frequency == pytest.approx(np.sqrt(9.81 * lengths / (lengths**2 + 0.02)) / (2 * np.pi))
    assert list(campbell.speeds) == [length, 2 * length]
    with pytest.raises(simflex.ModelError, match="'eigenn' is none of the choices"):
        model.analyse("eigenn")
    with pytest.raises(simflex.ModelError, match="did you mean 'count'"):
        model.analyse("eigen", cuont=1)


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
