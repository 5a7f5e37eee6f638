"""Reduced parts."""

import gc
import os
import subprocess

import numpy as np
import pytest
import simflex

DECK = """*NODE
1,0,0,0
2,1,0,0
3,1,0.1,0
4,0,0.1,0
5,0,0,0.1
6,1,0,0.1
7,1,0.1,0.1
8,0,0.1,0.1
9,2,0,0
10,2,0.1,0
11,2,0,0.1
12,2,0.1,0.1
*ELEMENT,TYPE=C3D8,ELSET=ALL
1,1,2,3,4,5,6,7,8
2,2,9,10,3,6,11,12,7
*NSET,NSET=LEFT
1,4,5,8
*NSET,NSET=RIGHT
9,10,11,12
*MATERIAL,NAME=STEEL
*ELASTIC
2.1e11,0.3
*DENSITY
7850
*SOLID SECTION,ELSET=ALL,MATERIAL=STEEL
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("part")
    (folder / "bar.inp").write_text(DECK)
    subprocess.run([os.environ["SIMFLEX_PROGRAM"], "reduce", "bar.inp", "-o", "bar.h5", "--modes", "20",
                    "--interface", "left=LEFT", "--interface", "right=RIGHT"], cwd=folder, check=True,
                   capture_output=True)
    return folder / "bar.h5"


def test_a_part_is_its_mass_and_modes(path):
    part = simflex.Part(path)
    mass = 7850 * 2 * 0.01
    assert part.mass == pytest.approx(mass)
    assert part.center_of_mass == pytest.approx([1, 0.05, 0.05])
    assert part.inertia[1, 1] == pytest.approx(mass * (4 + 0.01) / 12, rel=0.05)
    assert part.num_modes == 15 and np.all(np.diff(part.frequencies) >= 0)
    assert part.shapes.shape == (3, 12, 15)
    right = part.interfaces["right"]
    assert right.position == pytest.approx([1, 0, 0], abs=1e-9)
    # The centre of a rigid seat moves like the mean of its nodes.
    assert right.translation == pytest.approx(part.shapes[:, right.nodes, :].mean(axis=1), abs=1e-9)


def test_invariants_are_those_of_the_modes(path):
    part = simflex.Part(path)
    n = part.num_modes
    assert part.omega_squared == pytest.approx((2 * np.pi * part.frequencies) ** 2)
    assert part.I1.shape == (6, n) and len(part.I2) == 6 and len(part.N) == 3
    # Modes have unit mass: ½ tr I₂ is the unit matrix; N is antisymmetric.
    assert (part.I2[0] + part.I2[1] + part.I2[2]) / 2 == pytest.approx(np.eye(n), abs=1e-9)
    assert all(np.array_equal(N, -N.T) for N in part.N)
    assert part.positions.shape == (3, 12) and list(part.node_numbers) == list(range(1, 13))
    blocks = part.elements["hex8"]
    assert sum(block.shape[1] for block in blocks) == 2 and all(block.shape[0] == 8 for block in blocks)
    first = part.positions[:, blocks[0][:, 0]]
    assert first.max(axis=1) - first.min(axis=1) == pytest.approx([1, 0.1, 0.1])
    assert set(part.node_numbers[part.node_sets["LEFT"]]) == {1, 4, 5, 8}
    assert part.stress is None and part.stiffening is None and part.derivatives == {}
    full = simflex.reduce("bar", folder=path.parent, deck="bar.inp", modes=20, stress=["LEFT"], stiffening=True,
                          interfaces={"left": "LEFT", "right": "RIGHT"})
    assert full.stress.stress.shape == full.stress.strain.shape == (6, 4, full.num_modes)
    assert len(full.stiffening.turning) == 6 and len(full.stiffening.interfaces["left"]) == 6
    assert full.stiffening.turning[0].shape == (full.num_modes, full.num_modes)
    stress = full.stress.stress
    del full
    gc.collect()
    assert np.isfinite(stress).all()


def test_derivatives_say_what_stiffness_and_mass_would_be(path):
    part = simflex.reduce("bar", folder=path.parent, deck="bar.inp", modes=20, interfaces={"left": "LEFT"},
                          derivatives=["youngs_modulus:STEEL", "density:STEEL"])
    by = part.derivatives["youngs_modulus:STEEL"]
    assert by.value == 2.1e11 and by.unit == "Pa" and not by.K.flags.writeable
    assert by.value * np.diag(by.K) == pytest.approx(part.omega_squared)
    assert np.all(by.M == 0)
    by = part.derivatives["density:STEEL"]
    assert by.unit == "kg/m^3" and by.value * by.M == pytest.approx(np.eye(part.num_modes), abs=1e-9)
    with pytest.raises(simflex.ModelError, match="youngs_modulus:STEEL"):
        simflex.reduce("bar", folder=path.parent, deck="bar.inp", modes=20, derivatives=["density:LEAD"])


def test_views_outlive_their_part_and_cannot_be_written(path):
    part = simflex.Part(path)
    shapes = part.shapes
    copy = shapes.copy()
    del part
    gc.collect()
    assert np.array_equal(shapes, copy)
    with pytest.raises(ValueError):
        shapes[0, 0, 0] = 1


def test_reduced_from_python_as_by_the_program(path):
    part = simflex.reduce("bar", folder=path.parent, deck="bar.inp", modes=20,
                          interfaces={"left": "LEFT", "right": "RIGHT"})
    assert np.array_equal(part.frequencies, simflex.Part(path).frequencies)
    part.write(path.parent / "same.h5")
    assert np.array_equal(simflex.Part(path.parent / "same.h5").shapes, part.shapes)
    with pytest.raises(simflex.ModelError, match="LEFFT"):
        simflex.reduce("bar", folder=path.parent, deck="bar.inp", interfaces={"left": "LEFFT"}, modes=20)
    with pytest.raises(simflex.ModelError, match="a part already"):
        simflex.reduce("bar", folder=path.parent, file="bar.h5")
    with pytest.raises(simflex.ModelError, match="unknown key 'mods'"):
        simflex.reduce("bar", folder=path.parent, deck="bar.inp", mods=20)


def test_a_part_bends_in_a_session(path):
    model = simflex.Model.from_dict({
        "gravity": [0, -9.81, 0],
        "parts": {"bar": {"file": "bar.h5"}},
        "bodies": {"bar": {"part": "bar", "place": {"frame": "left", "at": "ground"}}},
        "joints": {"clamp": {"type": "weld", "between": ["ground", "bar.left"]}},
        "probes": {"tip": {"displacement": "bar.right", "relative_to": "bar.left", "component": "y"}}},
        folder=path.parent)
    session = simflex.Session(model)
    session.settle()
    sag = session["tip"]
    assert sag < 0
    heavy = simflex.Session(model)
    heavy.change("gravity", [0, -2 * 9.81, 0])
    heavy.settle()
    assert heavy["tip"] == pytest.approx(2 * sag, rel=1e-3)
    assert session.eigenmodes().frequency[0] > 0


def test_no_part(tmp_path):
    with pytest.raises(RuntimeError, match="none.h5"):
        simflex.Part(tmp_path / "none.h5")
