"""What calls cost beside what they do, and whether they leave anything behind."""

import gc
import time

import simflex
from models import make_pendulum


def measure(work, count=200, rounds=40):
    """Shortest time of a call [s]."""
    best = float("inf")
    for _ in range(rounds):
        begin = time.perf_counter()
        for _ in range(count):
            work()
        best = min(best, (time.perf_counter() - begin) / count)
    return best


def test_values_cost_little():
    session = simflex.Session(make_pendulum(initial={"joints": {"pivot": 0.3}}))
    session.run(0.1)
    assert measure(lambda: session["angle"]) < 5e-6
    assert measure(lambda: session["bob"]) < 5e-6
    assert measure(lambda: session["joints.pivot.angle"]) < 5e-6
    assert measure(lambda: session.time) < 1e-6


def test_steps_cost_little_beside_themselves():
    session = simflex.Session(make_pendulum(initial={"joints": {"pivot": 0.3}}, solver={"maximum_step": 1e-4}))
    assert measure(lambda: session.take_steps(0)) < 10e-6
    one = measure(lambda: session.take_steps(1))
    many = measure(lambda: session.take_steps(100), 2) / 100
    assert one - many < 10e-6


def test_functions_cost_little():
    model = make_pendulum(probes={"angle": {"coordinate": "pivot"}, "plain": {"expression": "2*angle"},
                                  "called": {"expression": "same(2*angle)"}})
    model.function(lambda x: x, name="same")
    session = simflex.Session(model)
    assert measure(lambda: session["called"]) - measure(lambda: session["plain"]) < 10e-6


def count_bytes():
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096


def grow(work, count):
    """Bytes that each call leaves behind, once memory is warm."""
    for _ in range(count // 4):
        work()
    before = count_bytes()
    for _ in range(count):
        work()
    return (count_bytes() - before) / count


def test_nothing_is_left_behind():
    model = make_pendulum(initial={"joints": {"pivot": 0.3}}, events={"low": {"when": "angle < 0"}})
    driven = make_pendulum(connectors={"motor": {"type": "motor", "joint": "pivot", "law": lambda angle: -angle}})
    session = simflex.Session(model)
    saved = session.save()

    def fail():
        try:
            simflex.Session(make_pendulum(bodies={}))
        except simflex.ModelError:
            pass

    for work, count, allowed in ((lambda: simflex.Session(model).step(0.001), 400, 2000),
                                 (lambda: simflex.Session(driven).step(0.001), 400, 2000),
                                 (lambda: (session.restore(saved), session.run(0.002, 0.001), session.record), 400, 2000),
                                 (session.copy, 100, 8000), (fail, 400, 2000),
                                 (lambda: (session["bob"], session.save(), session.quantities), 2000, 400)):
        assert grow(work, count) < allowed
