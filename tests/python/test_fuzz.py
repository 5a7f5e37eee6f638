"""Wrong arguments raise errors of Python and never end the interpreter."""

import copy
import inspect
import pathlib
import pickle
import random

import numpy as np
import pytest
import simflex
from models import make_pendulum


class Strange:
    """Fails wherever it is looked at."""

    def __getattr__(self, name):
        raise AttributeError(name)

    def __float__(self):
        raise OverflowError("no number")

    def __str__(self):
        raise UnicodeError("no text")

    def __iter__(self):
        raise LookupError("no items")


def make_values(model, session, rng):
    nested = []
    nested.append(nested)
    return [None, True, 0, -1, 1, 2**70, -2**70, 0.5, float("nan"), float("inf"), -1e308, 1e-320, 3 + 2j, "", "x", "angle",
            "joints.pivot.angle", "\0", "\udcff", "é" * 1000, "a.b", "bodies.bob", "gif", b"bytes", [], [1], [[1], [2]], [None], ["a"],
            nested, (), {}, {"a": 1}, {1: 2}, {"x": {"y": [1, {"z": "2"}]}}, {"__class__": 3}, object(), Strange(), int, len, lambda: 1,
            lambda *x: x, lambda x, y=1: x, np.array(0.5), np.zeros(0), np.zeros(3), np.zeros((2, 2)), np.array(["a"]), np.array([1 + 1j]),
            np.array([None]), np.ones(3)[::-1], np.float32(1), np.int64(-3), range(3), iter([1]), pathlib.Path("."), pathlib.Path("nowhere/x"),
            model, session, simflex, rng.random(), "%n%s", "!!python/object:os.system", "[", "{a: &b [*b]}", "1e999", "sin(", "((" * 300]


SLOW = {"analyse", "run", "animation", "picture", "_repr_png_", "_repr_html_", "write", "keep"}   # tried less often


def list_callables(objects):
    found = []
    for thing in objects:
        for name in dir(type(thing)) if not inspect.ismodule(thing) else dir(thing):
            if name in ("__class__", "__init_subclass__", "__subclasshook__", "__new__", "__reduce__", "__reduce_ex__"):
                continue
            function = getattr(thing, name, None)
            if callable(function):
                found.append((name, function))
    return found


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("seed", [7])
def test_any_arguments(seed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng, numpy_rng = random.Random(seed), np.random.default_rng(seed)
    numbers = {"raised": 0, "returned": 0}
    for round_number in range(12):
        model = make_pendulum(initial={"joints": {"pivot": 0.3}})
        session = simflex.Session(model)
        saved = session.save()
        values = [*make_values(model, session, numpy_rng), saved]
        names = [key for key in simflex.schema()["properties"]] + ["folder", "settings", "value", "type", "mas"]
        for name, function in list_callables([model, model.bodies, model.bodies.bob, session, saved, simflex]):
            for _ in range(1 if name in SLOW else 6):
                arguments = rng.choices(values, k=rng.choice([0, 1, 1, 2, 2, 3]))
                if name in ("run", "step", "take_steps"):   # short runs suffice
                    arguments = [value for value in arguments if not isinstance(value, (int, float)) or value < 2]
                keywords = {rng.choice(names): rng.choice(values) for _ in range(rng.choice([0, 0, 1]))}
                try:
                    function(*arguments, **keywords)
                    numbers["returned"] += 1
                except Exception as error:   # pylint: disable=broad-except
                    assert not isinstance(error, (SystemError, MemoryError)), f"{name}{arguments}: {error!r}"
                    assert str(error) != "std::exception"
                    numbers["raised"] += 1
    assert numbers["raised"] > 1000 and numbers["returned"] > 300


def test_what_cannot_be_made_or_copied_says_so():
    for kind in (simflex.Keys, simflex.SavedState, simflex.Results, simflex.Analysis, simflex.Animation):
        with pytest.raises(TypeError):
            kind()
    session = simflex.Session(make_pendulum())
    for thing in (session, session.save(), make_pendulum().bodies):
        for work in (copy.copy, copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError):
                work(thing)

    class Half(simflex.Session):
        def __init__(self):
            pass

    with pytest.raises(TypeError, match="__init__"):
        Half()
