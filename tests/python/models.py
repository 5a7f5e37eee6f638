"""Models shared by tests."""

import simflex


def make_pendulum(**changes):
    """A hanging pendulum: 1 kg on a massless rod of 1 m, with 0.02 kg m² about its centre of mass."""
    return simflex.Model.from_dict({
        "gravity": [0, -9.81, 0],
        "parameters": {"length": 1},
        "bodies": {"bob": {"mass": 1, "inertia": [0.02, 0.02, 0.02], "place": {"position": [0, "-length", 0]}}},
        "joints": {"pivot": {"type": "pin", "axis": "z",
                             "between": ["ground", {"on": "bob", "position": [0, "length", 0]}]}},
        "probes": {"bob": {"position": "bob"}, "angle": {"coordinate": "pivot"}},
        "solver": {"accuracy": 1e-8, "maximum_step": 0.01},
        "analyses": {"run": {"type": "transient", "duration": 0.5, "interval": 0.01}},
        **changes,
    })
