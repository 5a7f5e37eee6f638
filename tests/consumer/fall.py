"""Lets a body fall for a second and prints the libraries that were loaded."""

import simflex

model = simflex.Model()
model.gravity = [0, -9.81, 0]
model.bodies.add("apple", mass=0.1, inertia=[1e-4, 1e-4, 1e-4])
model.probes.height = {"position": "apple", "component": "y"}
session = simflex.Session(model)
session.run(1)
with open("/proc/self/maps", encoding="utf-8") as maps:
    libraries = {line.split()[-1] for line in maps if "libsimflex_model" in line}
print(session["height"], *libraries)
