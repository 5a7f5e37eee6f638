"""Overhead of calls from Python, as the shortest of many rounds. The last line is a JSON object of microseconds
(goals: 5 for values, 1 for the time, 10 for the overhead of a step or a function)."""

import json
import time

import simflex
from models import make_pendulum


def measure(work, count=200, rounds=40):
    """Returns the time per call in the fastest round [us]."""
    best = float("inf")
    for _ in range(rounds):
        begin = time.perf_counter()
        for _ in range(count):
            work()
        best = min(best, 1e6 * (time.perf_counter() - begin) / count)
    return best


start = {"joints": {"pivot": 0.3}}
session = simflex.Session(make_pendulum(initial=start))
session.run(0.1)
costs = {"probe": measure(lambda: session["angle"]),
         "vector": measure(lambda: session["bob"]),
         "quantity": measure(lambda: session["joints.pivot.angle"]),
         "time": measure(lambda: session.time)}

session = simflex.Session(make_pendulum(initial=start, solver={"maximum_step": 1e-4}))
costs["no_step"] = measure(lambda: session.take_steps(0))
costs["step_besides"] = measure(lambda: session.take_steps(1)) - measure(lambda: session.take_steps(100), 2) / 100

model = make_pendulum(probes={"angle": {"coordinate": "pivot"}, "plain": {"expression": "2*angle"},
                              "called": {"expression": "same(2*angle)"}})
model.function(lambda x: x, name="same")
session = simflex.Session(model)
costs["function_besides"] = measure(lambda: session["called"]) - measure(lambda: session["plain"])

for name, cost in costs.items():
    print(f"{name:20} {cost:8.2f} us")
print(json.dumps({name: round(cost, 3) for name, cost in costs.items()}))
