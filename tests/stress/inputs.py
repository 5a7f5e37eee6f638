#!/usr/bin/env python3
"""Files that the program reads, with errors put into them.

A case takes one of the kinds of files below, changes it in some places (bytes, fields, lines; cut off, doubled, of another file)
and gives it to the program. This must hold:

    crash       the program ends by itself, with one of its exit statuses
    hang        within a minute
    words       what it refuses it names: "simflex: FILE ..."
    meaning     what has a checksum (HDF5 files of simflex, archives) is refused, or read as it was before; and so is a number
                with a letter in it
    rest        a refusal leaves no file
"""

import os
import random
import re
import resource
import shutil
import signal
import subprocess
import zipfile
from pathlib import Path

from support import harness, parts

SECONDS = 60
MEMORY = 6 << 30  # [bytes]
CORPUS = Path(__file__).resolve().parent.parent / "fuzz" / "corpus"
VALUES = ["0", "-1", "2147483648", "1e308", "1e999", "nan", "inf", "1e-320", "", "x", "1.5-3", "99999999999999999999", ",", "{",
          "[", "%n%s", "../../../etc/passwd", "\u00e9", "\x1b[31m", "a" * 3000]

MODEL = """simflex: 1
title: A weight on a spring
parameters: {load: 1.25, stiffness: 1e3}
gravity: [0, -9.81, 0]
tables:
  push: {file: push.csv}
bodies:
  weight: {mass: load, inertia: [0.1, 0.1, 0.1], shape: {mesh: cube.stl}}
joints:
  slide: {type: slider, between: [ground, weight], axis: y}
loads:
  push: {on: weight, force: [0, "push(t)", 0]}
probes:
  height: {position: weight, component: y}
  twice: {expression: 2*height}
analyses:
  fall: {type: transient, duration: 0.1, interval: 0.05}
"""
CUBE = [((0, 0, 0), (0, 1, 0), (1, 0, 0)), ((0, 0, 0), (1, 0, 0), (0, 0, 1)), ((0, 0, 0), (0, 0, 1), (0, 1, 0)),
        ((1, 0, 0), (0, 1, 0), (0, 0, 1))]


def write_surfaces(folder: Path) -> None:
    lines = ["solid cube"]
    for triangle in CUBE:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in triangle), "endloop", "endfacet"]
    (folder / "cube.stl").write_text("\n".join([*lines, "endsolid cube", ""]))
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [[points.index(corner) for corner in triangle] for triangle in CUBE]
    (folder / "cube.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points)
                                     + "".join("f " + " ".join(str(k + 1) for k in face) + "\n" for face in faces))
    numbers = [" ".join(str(x) for row in rows for x in row) for rows in (points, faces)]
    (folder / "cube.vtp").write_text(
        '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">\n<PolyData>\n'
        '<Piece NumberOfPoints="4" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="4">\n<Points>\n'
        f'<DataArray type="Float32" NumberOfComponents="3" format="ascii">\n{numbers[0]}\n</DataArray>\n</Points>\n<Polys>\n'
        f'<DataArray type="Int32" Name="connectivity" format="ascii">\n{numbers[1]}\n</DataArray>\n'
        '<DataArray type="Int32" Name="offsets" format="ascii">\n3 6 9 12\n</DataArray>\n</Polys>\n'
        "</Piece>\n</PolyData>\n</VTKFile>\n")


def write_nastran_bar(path: Path) -> None:
    """Three bricks in a row."""
    lines = ["BEGIN BULK"]
    for i in range(4):
        for k, (y, z) in enumerate([(0, 0), (1, 0), (1, 1), (0, 1)]):
            lines.append(f"GRID,{4 * i + k + 1},,{0.1 * i:.3f},{0.02 * y:.3f},{0.02 * z:.3f}")
    for i in range(3):
        corners = [4 * i + k for k in range(1, 9)]
        lines += [f"CHEXA,{i + 1},1," + ",".join(map(str, corners[:6])), "," + ",".join(map(str, corners[6:]))]
    path.write_text("\n".join([*lines, "PSOLID,1,2", "MAT1,2,2.1+11,,.3,7850.", "ENDDATA", ""]))


# Name of the file, what reads it, whether it has a checksum.
READERS = [
    ("model.yaml", "run model.yaml --check", False),
    ("model.yaml", "run model.yaml -q --no-pictures -o a.h5", False),
    ("push.csv", "run model.yaml --check", False),
    ("cube.stl", "run model.yaml --check", False),
    ("cube.obj", "run model.yaml --check --set bodies.weight.shape.mesh=cube.obj", False),
    ("cube.vtp", "run model.yaml --check --set bodies.weight.shape.mesh=cube.vtp", False),
    ("cases.csv", "sweep model.yaml --list cases.csv --dry-run", False),
    ("bar.inp", "reduce bar.inp -i near=NEAR -i far=FAR -m 14 -q -o a.h5", False),
    ("box.geo", "reduce box.geo --material steel --mesh-size 0.05 -m 14 -q -o a.h5", False),
    ("bar.bdf", "reduce bar.bdf -m 14 -q -o a.h5", False),
    ("model.cdb", "reduce model.cdb -m 14 -q -o a.h5", False),
    ("part.fem", "export part.fem -o a.h5", False),
    ("part.h5", "info part.h5", True),
    ("result.h5", "post result.h5 -q --no-pictures -o a.h5", True),
    ("unit.fmu", "run unit.yaml --check", True),
    ("modelDescription.xml", "run unit.yaml --check", False),
]


def call(folder: Path, command: str) -> subprocess.CompletedProcess:
    environment = dict(os.environ, SIMFLEX_CACHE=str(folder / "cache"), TMPDIR=str(folder / "tmp"), OMP_NUM_THREADS="1",
                       OPENBLAS_NUM_THREADS="1")
    process = subprocess.Popen([os.environ["SIMFLEX_PROGRAM"], *command.split()], cwd=folder, env=environment,
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)))
    try:
        output, errors = process.communicate(timeout=SECONDS)
        return subprocess.CompletedProcess(command, process.returncode, output, errors)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return subprocess.CompletedProcess(command, None, b"", b"")


def prepare(shared: Path) -> None:
    shutil.rmtree(shared, ignore_errors=True)
    (shared / "tmp").mkdir(parents=True)
    parts.write_deck(parts.Bar("bar", 0.3, 0.02, 3, 2e11, 7850, False), shared / "bar.inp")
    write_surfaces(shared)
    (shared / "model.yaml").write_text(MODEL)
    (shared / "push.csv").write_text("t,force\n0,1.5\n0.05,2.25\n1,-3e1\n")
    (shared / "cases.csv").write_text("load,stiffness\n1.5,200\n2,300\n")
    (shared / "box.geo").write_text('SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 0.2, 0.1, 0.1};\n'
                                    "Physical Volume(\"BODY\") = {1};\n")
    write_nastran_bar(shared / "bar.bdf")
    shutil.copy(CORPUS / "ansys_deck" / "model.cdb", shared)
    (shared / "unit.yaml").write_text(
        "simflex: 1\nbodies: {weight: {mass: 1, inertia: [1, 1, 1]}}\ncontrollers:\n"
        "  unit: {fmu: unit.fmu, inputs: {}, outputs: [height], period: 0.01}\n"
        "analyses: {run: {type: transient, duration: 0.1}}\n")
    for command in ("reduce bar.inp -i near=NEAR -i far=FAR -m 14 -q -o part.h5", "export part.h5 -o part.fem",
                    "run model.yaml -q --no-pictures -o result.h5", "fmu model.yaml --thin -q -o unit.fmu"):
        ended = call(shared, command)
        if ended.returncode != 0:
            raise RuntimeError(f"{command}: {ended.stderr.decode()}")
    with zipfile.ZipFile(shared / "unit.fmu") as unit:
        unit.extract("modelDescription.xml", shared)
    for _, command, _ in READERS:
        ended = call(shared, command)
        (shared / "a.h5").unlink(missing_ok=True)
        if ended.returncode != 0:
            raise RuntimeError(f"{command}: {ended.stderr.decode()}")


def replace_in_archive(source: Path, target: Path, name: str, data: bytes) -> None:
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for entry in old.namelist():
            new.writestr(entry, data if entry == name else old.read(entry))


def mutate(data: bytes, other: bytes, random_: random.Random) -> bytes:
    """One change; `other` is a file of the same kind, or of another."""
    at = random_.randrange(len(data) + 1)
    lines = data.split(b"\n")
    line = random_.randrange(len(lines))
    kind = random_.randrange(9)
    if kind == 0:
        return data[:at] + bytes([random_.randrange(256)]) + data[at + 1:]
    if kind == 1 and at < len(data):
        return data[:at] + bytes([data[at] ^ 1 << random_.randrange(8)]) + data[at + 1:]
    if kind in (2, 3):
        fields = list(re.finditer(rb"[\w.+-]+", data))
        if fields:
            field = random_.choice(fields)
            value = random_.choice(VALUES).encode() if kind == 2 else random_.choice(fields).group()
            return data[:field.start()] + value + data[field.end():]
    if kind == 4:
        del lines[line]
    if kind == 5:
        lines.insert(line, lines[line])
    if kind == 6:
        return data[:at]
    if kind == 7:
        lines.insert(line, random_.choice(other.split(b"\n")))
    if kind == 8:
        lines[line] = lines[line] + b" " + lines[random_.randrange(len(lines))]
    return b"\n".join(lines)


def spoil_number(data: bytes, random_: random.Random):
    """A letter within a number of several digits; None: there is none."""
    numbers = [found for found in re.finditer(rb"(?<![\w.#-])-?\d+\.?\d+(?![\w.-])", data)]
    if not numbers:
        return None
    found = random_.choice(numbers)
    at = random_.randrange(found.start() + 1, found.end())
    return data[:at] + random_.choice([b"x", b"q", b"_", b"'", b"O"]) + data[at:]


def try_case(seed: int, index: int, folder: Path) -> harness.Outcome:
    outcome = harness.Outcome()
    random_ = random.Random(f"{seed} {index}")
    shared = folder.parent / "parts"
    name, command, has_checksum = random_.choice(READERS)
    for path in shared.iterdir():
        if path.is_file():
            shutil.copy(path, folder)
    (folder / "tmp").mkdir()
    data = (shared / name).read_bytes()
    must_be_same = has_checksum
    spoilt = spoil_number(data, random_) if not has_checksum and random_.random() < 0.25 else None
    if spoilt is not None:
        data, must_be_same, outcome.title = spoilt, True, f"{command}, a number spoilt"
    else:
        other = random_.choice([path for path in shared.iterdir() if path.is_file()]).read_bytes()
        for _ in range(random_.choice([1, 1, 2, 4])):
            data = mutate(data, other, random_)
        outcome.title = command
    (folder / name).write_bytes(data)
    if name == "modelDescription.xml":
        replace_in_archive(shared / "unit.fmu", folder / "unit.fmu", name, data)
    before = {path.name for path in folder.iterdir()}
    ended = call(folder, command)
    errors = ended.stderr.decode(errors="replace")
    if ended.returncode is None:
        outcome.fail("hang", f"not done after {SECONDS} s")
    elif ended.returncode not in (0, 1, 2, 3):
        outcome.fail("crash", f"status {ended.returncode}: {errors[-300:]}")
    elif ended.returncode != 0:
        outcome.counts["refused"] += 1
        if not errors.startswith("simflex: ") or "\x1b" in errors:
            outcome.fail("words", errors[-300:] or "it said nothing")
        rest = {path.name for path in folder.iterdir()} - before - {"cache"}
        rest |= {f"tmp/{path.name}" for path in (folder / "tmp").iterdir()}
        if rest and "a.h5" in rest:
            outcome.fail("rest", ", ".join(sorted(rest)))
    else:
        outcome.counts["accepted"] += 1
        if must_be_same and b": setting '" not in ended.stdout:  # a sweep lists its cases, and what is wrong with them
            outcome.counts["accepted that has to be as before"] += 1
            outputs = [ended.stdout, (folder / "a.h5").read_bytes() if (folder / "a.h5").exists() else b""]
            for file in ("a.h5",):
                (folder / file).unlink(missing_ok=True)
            (folder / name).write_bytes((shared / name).read_bytes())
            shutil.copy(shared / "unit.fmu", folder)
            original = call(folder, command)
            if [original.stdout, (folder / "a.h5").read_bytes() if (folder / "a.h5").exists() else b""] != outputs:
                outcome.fail("meaning", "accepted, and read otherwise than without the change")
            (folder / name).write_bytes(data)
    return outcome


if __name__ == "__main__":
    harness.main(__doc__, "inputs", try_case, count=200, limit=120, prepare=prepare)
