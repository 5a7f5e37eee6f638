#!/usr/bin/env python3
"""Runs the models of examples/models and compares results with closed forms, and the slider-crank with the C++ program
of the same mechanism."""

import argparse
import csv
import math
import os
import shutil
import subprocess
import unittest
from pathlib import Path

import h5py
import numpy
import yaml

OPTIONS = None
G = 9.80665


def run(model, *arguments):
    """Runs a model and opens its results."""
    work = OPTIONS.work / model
    work.mkdir(parents=True, exist_ok=True)
    subprocess.run([OPTIONS.simflex, "run", OPTIONS.source / f"examples/models/{model}.yaml", "--quiet", "--no-pictures",
                    *arguments], cwd=work, check=True, stdout=subprocess.DEVNULL,
                   env=dict(os.environ, SIMFLEX_CACHE=str(OPTIONS.work / "cache")))
    return h5py.File(work / f"{model}.results.h5")["analyses"]


class Models(unittest.TestCase):
    def test_ruler_sags_like_a_cantilever(self):
        rest = run("ruler", "--only", "rest")["rest/probes"]
        length, width, thickness, load = 0.3, 0.02, 0.002, 0.05
        stiffness = 210e9 * width * thickness**3 / 12
        sag = G * length**3 / stiffness * (load / 3 + 7850 * width * thickness * length / 8)
        # The clamp prevents anticlastic curvature near it, which adds less than ν² to the stiffness.
        ratio = -rest["bending"][:].ravel()[0] / sag
        self.assertLess(ratio, 1)
        self.assertGreater(ratio, 1 - 0.3**2)
        self.assertAlmostEqual(ratio, 1, delta=0.02)

    def test_pendulum_swings_like_a_bar(self):
        analyses = run("pendulum")
        arm, length = 0.09, 0.192
        frequency = math.sqrt(G * arm / (arm**2 + length**2 / 12)) / (2 * math.pi)
        self.assertAlmostEqual(analyses["modes/frequency"][:].ravel()[0] / frequency, 1, delta=2e-3)

    def test_rocker_turns_between_its_dead_centres(self):
        angle = run("four_bar", "--only", "run")["run/probes/rocker_angle"][:].ravel()
        a, b, c, d = 0.06, 0.18, 0.18, 0.15
        first, last = (math.pi - math.acos((d**2 + c**2 - (b + sign * a)**2) / (2 * d * c)) for sign in (1, -1))
        self.assertAlmostEqual(min(angle), first, delta=2e-3)  # parts deform, samples miss the extremes
        self.assertAlmostEqual(max(angle), last, delta=2e-3)

    def test_whirl_parts_into_backward_and_forward(self):
        frequency = run("rotor", "--only", "campbell")["campbell/frequency"][:]
        for backward, forward in ((0, 1), (2, 3)):
            self.assertTrue(all(frequency[1:, backward] < frequency[:-1, backward]))
            self.assertTrue(all(frequency[1:, forward] > frequency[:-1, forward]))

    def test_robot_holds_its_weight(self):
        probes = run("robot_arm", "--only", "rest")["rest/probes"]
        upper, forearm, reach, load = math.radians(60), math.radians(60 - 80), 0.3, 1.5
        arm = 0.1973923
        elbow = reach * math.cos(upper)
        torque = G * (arm * elbow / 2 + arm * (elbow + reach / 2 * math.cos(forearm))
                      + load * (elbow + reach * math.cos(forearm)))
        self.assertAlmostEqual(probes["shoulder_torque"][:].ravel()[0] / torque, 1, delta=2e-3)  # the arm sags a little

    def test_controller_holds_the_arm_and_loses_it_by_the_tip(self):
        results = run("controlled_arm")
        # The integral term equals the torque of arm and load; no pole is unstable.
        torque = G * 0.3 * (0.1973923 / 2 + 1.5)
        self.assertAlmostEqual(results["rest/probes/torque"][:].ravel()[0] / torque, 1, delta=2e-3)
        self.assertTrue(all(results["poles/damping_ratio"][:] > 0))
        by_tip = run("controlled_arm", "--set", "parameters.tip_share=1")
        frequency, damping = by_tip["poles/frequency"][:], by_tip["poles/damping_ratio"][:]
        unstable = [f for f, d in zip(frequency, damping) if d < 0]
        self.assertEqual(len(unstable), 1)
        self.assertAlmostEqual(unstable[0], 807, delta=10)

    def test_brake_takes_the_work_of_the_gas(self):
        table = yaml.safe_load((OPTIONS.source / "examples/models/engine.yaml").read_text())["tables"]["pressure"]
        throw, rod, area = 0.045, 0.144, math.pi * 0.04**2
        angle = numpy.linspace(0, 720, 72001)
        turn = numpy.radians(angle)
        place = throw * numpy.cos(turn) + numpy.sqrt(rod**2 - (throw * numpy.sin(turn))**2)
        probes = run("engine")["run/probes"]
        turned, torque = (probes[name][:].ravel() for name in ("angle", "brake_torque"))
        pressure = 1e5 * numpy.interp(angle, table["x"], numpy.array(table["z"])[:, 1])
        mean = -4 * area * numpy.trapz(pressure, place) / (4 * math.pi)
        last = turned > turned[-1] - 4 * math.pi
        taken = -numpy.trapz(torque[last], turned[last]) / (turned[last][-1] - turned[last][0])
        self.assertAlmostEqual(taken / mean, 1, delta=0.01)

    def test_ram_carries_boom_and_load(self):
        def rest(*arguments):
            probes = run("crane", "--only", "rest", *arguments)["rest/probes"]
            return [probes[name][:].ravel()[0] for name in ("force", "ram_length")]

        tilt = math.radians(10)
        arm = complex(2, -0.23) * complex(math.cos(tilt), math.sin(tilt))
        ram = arm - complex(1, 0.12 - 1.5)
        lever = (arm.conjugate() * ram).imag / abs(ram)
        force, length = rest()
        self.assertAlmostEqual(length, abs(ram), delta=1e-3)
        more = rest("--set", "parameters.load=1000")[0] - force
        self.assertAlmostEqual(more * lever / (400 * G * 6 * math.cos(tilt)), 1, delta=5e-3)

    def test_pendulum_tears_off_where_its_sleeve_cannot_hold_it(self):
        probes = run("froude_pendulum")["run/probes"]
        angle, slip, balance = (probes[name][:].ravel() for name in ("angle", "slip", "balance"))
        r, sticking = 0.06, 0.45
        parts = [(math.pi * (1.4 * r)**2 * 0.04, 0), (0.03 * 0.2 * 0.02, 0.16), (0.09 * 0.03 * 0.03, 0.25)]
        arm = sum(volume * y for volume, y in parts) / sum(volume for volume, _ in parts)
        carried = [a for a, v in zip(angle, slip) if abs(v) < 1e-9]
        # The parts that turn with the shaft are slightly heavier than those that hang, and rows are 0.01 s apart.
        self.assertAlmostEqual(max(carried), math.asin(sticking * r / arm), delta=0.01)
        self.assertGreater(len(carried), 100)
        self.assertLess(max(slip) - min(slip), 10)
        self.assertLess(max(abs(balance - balance[0])), 1e-5)

    def test_slider_crank_is_that_of_the_program(self):
        parts = OPTIONS.build / "parts"
        slider = run("slider_crank", "--set", "parameters.offset=0", "--set", "solver.method=bdf",
                     "--set", f"parts.crank={{file: {parts}/crank.h5}}",
                     "--set", f"parts.rod={{file: {parts}/rod.h5}}")["run/probes/slider"][:].ravel()
        out = OPTIONS.work / "program"
        subprocess.run([OPTIONS.build / "bin/slider_crank", "--parts", parts, "--output", out, "--no-frames"], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(out / "probes.csv", newline="", encoding="ascii") as file:
            expected = [float(row["slider_flexible_m"]) for row in csv.DictReader(file)]
        self.assertEqual(len(slider), len(expected))
        # Both are within the accuracy of each step, 1e-6 m.
        self.assertLess(max(abs(a - b) for a, b in zip(slider, expected)), 1e-6)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("simflex", "source", "build", "work"):
        parser.add_argument("--" + name, type=lambda path: Path(path).absolute(), required=True)
    parser.add_argument("tests", nargs="*")
    OPTIONS = parser.parse_args()
    shutil.rmtree(OPTIONS.work, ignore_errors=True)
    unittest.main(argv=["check_models", *OPTIONS.tests])
