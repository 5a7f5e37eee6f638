"""Calls leak no memory."""

import gc

import simflex
from models import make_pendulum


def count_bytes():
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096


def grow(work, count):
    """Bytes leaked per call, after a warm-up."""
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
