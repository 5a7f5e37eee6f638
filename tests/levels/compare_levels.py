#!/usr/bin/env python3
"""Runs a reduction and a model with the libraries of each level that this processor supports: any x86-64, x86-64-v3 and
x86-64-v4. The loader must take the libraries of the level, two runs on one level must give the same bytes, and levels
must agree up to integrated round-off."""

import argparse
import csv
import os
import shutil
import subprocess
import sys
from pathlib import Path

LOADER = "/lib64/ld-linux-x86-64.so.2"
LIBRARIES = ["libsimflex.so", "libsimflex_model.so", "libsimflex_part.so", "libsimflex_reduction.so", "libsimflex_render.so"]
ANY = "any"
MODEL = """
simflex: 1
gravity: [0, -9.81, 0]
parts:
  bar: {file: crank.h5}
bodies:
  first: {part: bar, damping: 0.01}
  second: {part: bar, damping: 0.01, place: {position: [0.06, 0, 0.007]}}
joints:
  top: {type: pin, between: [ground, first.shaft]}
  middle: {type: pin, between: [{on: first.pin, position: [0, 0, 0.007]}, second.shaft]}
solver: {accuracy: 1e-6}
probes:
  tip: {position: second.pin}
  bending: {largest_displacement: first}
analyses:
  swing: {type: transient, duration: 0.3}
"""
# Allowed effect of round-off in a run that is not chaotic; 2e-12 was observed.
SAME_RUN = 1e-9


def fail(text):
    sys.exit("compare_levels: " + text)


def supported_levels():
    """Levels that this processor supports, according to the loader."""
    text = subprocess.run([LOADER, "--help"], capture_output=True, text=True, check=True).stdout
    return [ANY] + [level for level in ("x86-64-v3", "x86-64-v4") if f"{level} (supported" in text]


def masked(level, arguments):
    """The command with the libraries of one level; the loader looks for no higher ones."""
    return [LOADER, "--glibc-hwcaps-mask", level if level != ANY else "x86-64-v2", *map(str, arguments)]


def check_libraries(level, arguments):
    """Checks that the loader takes all libraries from the folder of the level."""
    listing = subprocess.run([LOADER, "--list", *masked(level, [arguments.program])[1:]],
                             capture_output=True, text=True, check=True).stdout
    folder = arguments.libraries if level == ANY else arguments.libraries / "glibc-hwcaps" / level
    for library in LIBRARIES:
        loaded = [Path(line.split("=>")[1].split("(")[0].strip()) for line in listing.splitlines()
                  if line.strip().startswith(library)]
        if [path.parent for path in loaded] != [folder]:
            fail(f"level {level}: {library} is loaded from {loaded}, must be from {folder}")


def run(level, arguments, folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "model.yaml").write_text(MODEL)
    deck = arguments.parts / "crank.inp"
    environment = dict(os.environ, XDG_CACHE_HOME=str(folder / "cache"), OMP_NUM_THREADS="1")
    for command in (
            ["reduce", deck, "--quiet", "--interface", "shaft=SHAFT", "--interface", "pin=PIN", "--modes", "20",
             "-o", folder / "crank.h5"],
            ["info", folder / "crank.h5"],
            ["run", "model.yaml", "--quiet", "--csv"]):
        done = subprocess.run(masked(level, [arguments.program, *command]), cwd=folder, env=environment,
                              capture_output=True, text=True)
        if done.returncode:
            fail(f"level {level}: {command[0]} ends with {done.returncode}:\n{done.stdout}{done.stderr}")
        (folder / (command[0] + ".txt")).write_text(done.stdout)


def read_numbers(folder):
    """Columns of all tables of the run."""
    columns = {}
    for table in sorted(folder.rglob("*.csv")):
        with open(table, newline="") as file:
            rows = list(csv.reader(line for line in file if not line.startswith("#")))
        for k, name in enumerate(rows[0]):
            columns[f"{table.name}: {name}"] = [float(row[k]) for row in rows[1:]]
    return columns


def compare(level, first, other):
    if not first or first.keys() != other.keys():
        fail(f"level {level}: the run's tables have the columns {sorted(other)}, not {sorted(first)}")
    for name, values in first.items():
        size = max(map(abs, values)) or 1
        if len(values) != len(other[name]):
            fail(f"level {level}: {name} has {len(other[name])} rows, not {len(values)}")
        worst = max(abs(a - b) for a, b in zip(values, other[name])) / size
        print(f"{level}: {name}: {worst:.1e} of {size:.3g}")
        if not worst <= SAME_RUN:
            fail(f"level {level}: {name} differs by {worst:.1e} of its size")


def main():
    parser = argparse.ArgumentParser()
    for name in ("program", "libraries", "parts", "work"):
        parser.add_argument("--" + name, type=Path, required=True)
    arguments = parser.parse_args()
    levels = supported_levels()
    print("levels of this processor: " + ", ".join(levels))
    first = None
    for level in levels:
        check_libraries(level, arguments)
        numbers = []
        for attempt in ("one", "two"):
            run(level, arguments, arguments.work / level / attempt)
            numbers.append(read_numbers(arguments.work / level / attempt))
        if numbers[0] != numbers[1]:
            fail(f"level {level}: two runs differ")
        first = first or numbers[0]
        compare(level, first, numbers[0])


main()
