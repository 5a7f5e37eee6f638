#!/usr/bin/env python3
"""Tries a folder of CalculiX and Abaqus decks: reduces each as one free part without interfaces, and compares its
lowest frequencies and mass with those of CalculiX's own *FREQUENCY on the same deck without its supports.

    try_decks.py FOLDER [--simflex PROGRAM] [--csv TABLE.csv]

For each deck the table lists reduced, refused or crash, the largest relative difference of frequencies and that of
mass, the seconds of the reduction, and the message. Below it refusals are counted by reason. The exit status is 1 if a
deck crashed or a reduced one differs by more than --allowed."""

import argparse
import collections
import csv
import gzip
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

RIGID = 6
FAR = 300  # frequencies above this multiple of a zero mode have five digits: its square is the error of ω²
SOFT = 1e-8  # stiffness of soft springs, relative to mass times the square of the lowest free angular frequency
NODES_OF = {"C3D4": 4, "C3D6": 6, "C3D8": 8, "C3D10": 10, "C3D15": 15, "C3D20": 20, "S3": 3, "S4": 4, "S6": 6, "S8": 8,
            "B31": 2, "B32": 3, "SPRINGA": 2, "SPRING2": 2}
COLUMNS = ["deck", "class", "frequency", "mass", "seconds", "message"]


def read_text(path):
    data = gzip.open(path).read() if path.suffix == ".gz" else path.read_bytes()
    return data.decode("latin-1")


def free_deck(text, num_modes, soft=0):
    """The model of a deck without its supports, with a step for its lowest modes and its mass. `soft` adds springs of
    this stiffness to the ground, in all directions at some nodes of its elements, so that K can be factored."""
    kept, is_left_out, size, numbers, held, springs = [], False, 0, [], [], []
    elements = [0]
    for line in text.splitlines():
        keyword = re.sub(r"\s", "", line.split(",")[0]).upper()
        if keyword == "*STEP":
            break
        if line.startswith("*") and not line.startswith("**"):
            is_left_out = keyword == "*BOUNDARY"
            found = re.search(r"TYPE=([A-Z0-9]*)", re.sub(r"\s", "", line).upper()) if keyword == "*ELEMENT" else None
            size, numbers = NODES_OF.get(re.sub("[IRTM]+$", "", found[1]), 0) if found else 0, []
        elif size and not line.startswith("**"):
            numbers += [int(word) for word in line.split(",") if word.strip().isdigit()]
            if len(numbers) > size:
                elements.append(numbers[0])
                (springs if size == 2 else held).extend(numbers[1:size + 1])
                numbers = []
        if not is_left_out:
            kept.append(line)
    largest = max(elements)
    if soft:
        number = largest
        held = sorted(set(held))
        for node in sorted(set(held[::max(1, len(held) // 8)] + springs)):
            for axis in (1, 2, 3):
                number += 1
                kept.append(f"*ELEMENT, TYPE=SPRING1, ELSET=SOFT{axis}\n{number}, {node}")
        kept += [f"*SPRING, ELSET=SOFT{axis}\n{axis}\n{soft:.12g}" for axis in (1, 2, 3)]
    return "\n".join(kept) + (f"\n*ELSET, ELSET=TRIED, GENERATE\n1, {largest}\n*STEP\n*FREQUENCY\n{num_modes}\n"
                              "*EL PRINT, ELSET=TRIED, TOTALS=ONLY\nEMAS\n*END STEP\n")


def give_density(text, density):
    """The deck with a *DENSITY for each material that has none."""
    blocks = re.split(r"(?im)^(?=\s*\*\s*MATERIAL\b)", text)
    for k, block in enumerate(blocks[1:], 1):
        own = re.split(r"(?im)^\s*\*\s*(?:STEP|[A-Z ]*SECTION)\b", block)[0]
        if not re.search(r"(?im)^\s*\*\s*DENSITY\b", own):
            line, rest = (block.split("\n", 1) + [""])[:2]
            blocks[k] = f"{line}\n*DENSITY\n{density}\n{rest}"
    return "".join(blocks)


def run(command, folder, seconds, threads="1"):
    """Returns the exit status (None: time limit) and output."""
    environment = dict(os.environ, OMP_NUM_THREADS=threads)
    try:
        done = subprocess.run(command, cwd=folder, env=environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=seconds)
        return done.returncode, done.stdout.decode("utf-8", "replace")
    except subprocess.TimeoutExpired:
        return None, "not ready after the time allowed"


def calculix_answer(text, folder, num_modes, arguments, soft=0):
    """Frequencies of the flexible modes [Hz], the largest of those that should be zero, and the mass (None if there is
    none); None without frequencies."""
    (folder / "free.inp").write_text(free_deck(text, num_modes + RIGID, soft), encoding="latin-1")
    run([arguments.ccx, "free"], folder, arguments.seconds)
    output = folder / "free.dat"
    lines = output.read_text(errors="replace").splitlines() if output.exists() else []
    output.unlink(missing_ok=True)
    frequencies, zero, mass, table = [], 0, None, ""
    for k, line in enumerate(lines):
        words = line.split()
        if "E I G E N V A L U E" in line or "P A R T I C I P" in line:
            table = line
        if "E I G E N V A L U E" in table and len(words) == 5 and words[0].isdigit():
            frequencies.append(float(words[3]))
            if len(frequencies) <= RIGID:
                zero = max(zero, float(words[3]), float(words[4]))  # column 4: of a negative eigenvalue
        if "total mass for set" in line and mass is None:
            mass = float(lines[k + 2])
    return (frequencies[RIGID:], zero, mass) if any(frequencies) else None


def worst_difference(part, full, zero):
    """Largest relative difference of the part's frequencies from the nearest of CalculiX, which may have more. Only
    those that keep five digits count, see FAR; None if there are none."""
    return max((min(abs(a / b - 1) for b in full if b > 0) for a in part if FAR * zero < a <= max(full)), default=None)


def try_deck(path, arguments):
    row = dict.fromkeys(COLUMNS, "")
    row["deck"] = path.name
    text = read_text(path)
    if arguments.density:
        text = give_density(text, arguments.density)
    with tempfile.TemporaryDirectory(prefix="simflex-decks-") as name:
        folder = Path(name)
        for include in re.findall(r"(?i)\*INCLUDE\s*,\s*INPUT\s*=\s*\"?([^\"\s,]+)", text):
            if (path.parent / include).is_file() and not (folder / include).exists():
                (folder / include).parent.mkdir(parents=True, exist_ok=True)
                (folder / include).symlink_to((path.parent / include).resolve())
        (folder / "deck.inp").write_text(text, encoding="latin-1", newline="")
        start = time.monotonic()
        # Six of the modes are rigid.
        status, output = run([arguments.simflex, "reduce", "deck.inp", "-m", str(arguments.modes + RIGID),
                              "--no-resume", "-q", "-o", "part.h5"], folder, arguments.seconds)
        row["seconds"] = f"{time.monotonic() - start:.1f}"
        if status != 0:
            row["message"] = " ".join(line for line in output.splitlines() if "warning:" not in line)
            row["class"] = "refused" if status is not None and status > 0 else "crash"
            return row
        row["class"] = "reduced"
        info = json.loads(run([arguments.simflex, "info", "part.h5", "--json"], folder, arguments.seconds)[1])
        # With six zero modes CalculiX sometimes finds spurious modes. Ask for other numbers of modes (fewer for few
        # elements), and finally add soft springs.
        answers = []
        soft = SOFT * info["mass"] * (2 * math.pi * info["frequencies"][0])**2 if info["frequencies"] else 0
        few = 3 - arguments.modes
        for more, stiffness in ((0, 0), (5, 0), (11, 0), (few, 0), (5, soft), (few, soft), (few, 100 * soft)):
            answer = calculix_answer(text, folder, arguments.modes + more, arguments, stiffness)
            if answer:
                frequencies, zero, mass = answer
                row["mass"] = f"{abs(info['mass'] / mass - 1):.1e}" if mass else ""
                difference = worst_difference(info["frequencies"], frequencies, zero)
                if difference is not None:
                    answers.append(difference)
            if answers and answers[-1] <= arguments.allowed:
                break
        if answers:
            row["frequency"] = f"{min(answers):.1e}"
        else:
            row["message"] = "CalculiX gives no free modes of the deck to five digits"
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="decks: *.inp, *.inp.gz")
    parser.add_argument("--simflex", default="simflex")
    parser.add_argument("--ccx", default=os.environ.get("SIMFLEX_CCX", "ccx"))
    parser.add_argument("--modes", type=int, default=10, help="flexible modes to compare")
    parser.add_argument("--seconds", type=float, default=300, help="allowed for each program")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--allowed", type=float, default=1e-5, help="difference of frequencies and mass")
    parser.add_argument("--density", help="of materials that have none, so that they can be compared, too")
    parser.add_argument("--csv", help="write the table there too")
    arguments = parser.parse_args()
    if "/" in arguments.simflex:
        arguments.simflex = str(Path(arguments.simflex).resolve())
    decks = sorted(p for p in arguments.folder.iterdir() if re.search(r"\.inp(\.gz)?$", p.name, re.I))
    if not decks:
        sys.exit(f"{arguments.folder}: there are no decks (*.inp, *.inp.gz)")
    with ThreadPoolExecutor(arguments.jobs) as pool:
        rows = []
        for row in pool.map(lambda path: try_deck(path, arguments), decks):
            rows.append(row)
            print(f"{row['deck']:32} {row['class']:8} {row['frequency']:>8} {row['mass']:>8} {row['seconds']:>6} "
                  f"{row['message'][:160]}", flush=True)
    if arguments.csv:
        with open(arguments.csv, "w", newline="") as out:
            writer = csv.DictWriter(out, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)

    def difference(row):
        return max([float(row[key]) for key in ("frequency", "mass") if row[key]], default=0)

    reasons = collections.Counter(re.sub(r"\S*deck\.inp(:\d+)?:|\b\d[\d.e+-]*\b", "", row["message"])[:110].strip()
                                  for row in rows if row["class"] == "refused")
    print()
    for reason, count in reasons.most_common():
        print(f"{count:5} {reason}")
    wrong = [row for row in rows if row["class"] == "reduced" and not difference(row) <= arguments.allowed]
    crashed = [row for row in rows if row["class"] == "crash"]
    counts = collections.Counter(row["class"] for row in rows)
    print(f"\n{len(rows)} decks: " + ", ".join(f"{count} {name}" for name, count in counts.most_common()) +
          f"; {len(wrong)} of the reduced differ by more than {arguments.allowed:g}"
          + (": " + ", ".join(row["deck"] for row in wrong) if wrong else ""))
    sys.exit(1 if wrong or crashed else 0)


if __name__ == "__main__":
    main()
