"""Compares examples/part_file.py with `simflex info --json` and with a bar in tension, F L / (E A)."""
import json
import math
import subprocess
import sys

program, example, part = sys.argv[1:]
E, L, A, F = 70e9, 0.2, 0.03 * 0.02, 1000.0  # of testing::Brick


def run(*command):
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)


info = run(program, "info", part, "--json")
read = run("/usr/bin/python3", example, part, "--json", "--load", "left=%g,0,0" % -F, "--load", "right=%g,0,0,0,0,0" % F)

assert read["name"] == info["name"]
assert read["mass"] == info["mass"] and abs(read["mass"] - 2700 * L * A) < 1e-9, read["mass"]
assert len(read["frequencies"]) == info["num_modes"] == len(info["modes"]) > 0
for mine, theirs, mode in zip(read["frequencies"], info["frequencies"], info["modes"]):
    assert math.isclose(mine, theirs, rel_tol=1e-14) and mode["frequency"] == theirs
elongation = read["interfaces"]["right"]["translation"][0] - read["interfaces"]["left"]["translation"][0]
assert math.isclose(elongation, F * L / (E * A), rel_tol=1e-7), elongation  # the digits of CalculiX's matrices
assert math.isclose(read["strain_energy"], 0.5 * F * elongation, rel_tol=1e-9)
assert math.isclose(read["largest_displacement"], elongation / 2, rel_tol=1e-6)

missing = subprocess.run(["/usr/bin/python3", example, part, "--load", "pin=1,0,0"], stderr=subprocess.PIPE, text=True)
assert missing.returncode != 0 and "'pin'" in missing.stderr and "left, right" in missing.stderr, missing.stderr
