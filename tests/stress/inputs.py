#!/usr/bin/env python3
"""Input files with errors put into them.

A case changes one of the files below in some places (bytes, fields, lines; truncated, doubled, mixed with another file)
and gives it to the program. This must hold:

    crash       the program ends by itself, with one of its exit statuses
    hang        it ends within a minute of processor time
    words       a refusal is a message "simflex: FILE ..."
    meaning     files with a checksum (HDF5 files of simflex, archives, journals) are refused or read as before, and so
                are numbers with a letter in them
    scene       the animation of an accepted file is glTF that a reader of our own accepts, and its triangles, written
                back as STL, give a body with the same motion
    rest        a refusal leaves no file
"""

import itertools
import os
import random
import re
import shutil
import subprocess
import time
import zipfile
from pathlib import Path

import h5py
import numpy as np
import scipy.io

from support import commands, gltf, harness, parts
from support.content import read_content

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


def write_matrices(folder: Path) -> None:
    """The corners of a box with a spring between any two and a mass at each, in every file format."""
    nodes = np.array(list(itertools.product((0, 0.1), (0, 0.2), (0, 0.3))))
    stiffness, mass = np.zeros((24, 24)), np.eye(24)
    for i, j in itertools.combinations(range(8), 2):
        row = np.zeros(24)
        row[3 * j:3 * j + 3] = (nodes[j] - nodes[i]) / np.linalg.norm(nodes[j] - nodes[i])
        row[3 * i:3 * i + 3] = -row[3 * j:3 * j + 3]
        stiffness += 1e5 * np.outer(row, row)
    arrays = {"K": stiffness, "M": mass, "nodes": nodes, "seat": np.array([1, 2, 3, 4])}
    np.savez(folder / "net.npz", **arrays)
    scipy.io.savemat(folder / "net.mat", arrays)
    points = [f"{x:g},{y:g},{z:g}" for x, y, z in nodes]
    (folder / "nodes.csv").write_text("number,x,y,z\n" + "".join(f"{k + 1},{point}\n" for k, point in enumerate(points)))
    dmig = []
    for name, label, matrix in (("K", "KAAX", stiffness), ("M", "MAAX", mass)):
        entries = [(i, j, matrix[i, j]) for j in range(24) for i in range(j, 24) if matrix[i, j] != 0]
        (folder / f"{name}.mtx").write_text(f"%%MatrixMarket matrix coordinate real symmetric\n24 24 {len(entries)}\n"
                                            + "".join(f"{i + 1} {j + 1} {value!r}\n" for i, j, value in entries))
        dmig.append(f"DMIG,{label},0,6,2,0")
        for j, column in itertools.groupby(entries, key=lambda entry: entry[1]):
            dmig.append(f"DMIG,{label},{j // 3 + 1},{j % 3 + 1},,"
                        + "\n+,".join(f"{i // 3 + 1},{i % 3 + 1},{value:.9e}" for i, _, value in column))
        (folder / f"{name}_abaqus.mtx").write_text("".join(
            f"{i // 3 + 1},{i % 3 + 1}, {j // 3 + 1},{j % 3 + 1}, {value:.15e}\n" for i, j, value in entries))
    (folder / "dofs.csv").write_text("".join(f"{k // 3 + 1} {k % 3 + 1}\n" for k in range(24)))
    (folder / "net.pch").write_text("\n".join(dmig) + "\n")
    elements = []
    for steps in itertools.permutations((4, 2, 1)):  # six tetrahedra about the diagonal
        corners = [0, *itertools.accumulate(steps)]
        if np.linalg.det(nodes[corners[1:]] - nodes[0]) < 0:
            corners[1:3] = corners[2:0:-1]
        elements.append(f"{len(elements) + 1} 4 2 1 1 " + " ".join(str(corner + 1) for corner in corners))
    (folder / "box.msh").write_text(
        '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 "BODY"\n$EndPhysicalNames\n$Nodes\n8\n'
        + "".join(f"{k + 1} {point}\n" for k, point in enumerate(point.replace(",", " ") for point in points))
        + "$EndNodes\n$Elements\n6\n" + "\n".join(elements) + "\n$EndElements\n")


def write_tests(folder: Path) -> None:
    """Measured shapes and responses."""
    def write_mode(number, frequency, values):
        return (f"    -1\n    55\nMode {number}\nNONE\nNONE\nNONE\nNONE\n"
                "         1         2         2         8         2         3\n"
                f"         2         4         1{number:10d}\n{frequency:13.5E}{1:13.5E}{0.01:13.5E}{0:13.5E}\n"
                + "".join(f"{node:10d}\n" + "".join(f"{x:13.5E}" for x in row) + "\n" for node, row in values.items())
                + "    -1\n")

    (folder / "shapes.unv").write_text(write_mode(1, 12.5, {4: (-1, -0.5, -0.25), 12: (2, 0, 1)})
                                       + write_mode(2, 40, {4: (1, 2, 0), 12: (0, 1, -2)}))
    (folder / "shapes.csv").write_text("frequency [Hz],middle.x,tip.x,tip.y\n12.5,2,-1,-10\n40,0.8,2,1\n")
    text = ""
    for node in (1, 2):
        text += ("    -1\n    58\nFRF\nNONE\n24-NOV-26 00:00:00\nNONE\nNONE\n"
                 f"{4:5d}{1:10d}{0:5d}{0:10d} {'NONE':10s}{node:10d}{3:4d} {'NONE':10s}{1:10d}{3:4d}\n"
                 f"{6:10d}{201:10d}{1:10d}{0:13.5E}{0.01:13.5E}{0:13.5E}\n"
                 + 4 * "        18    0    0    0 Frequency            Hz\n")
        for k in range(201):
            value = node / (1 - 1e-4 * k * k + 0.02j * k / 100)
            text += f"{value.real:20.12E}{value.imag:20.12E}" + ("\n" if k % 2 or k == 200 else "")
        text += "    -1\n"
    (folder / "response.unv").write_text(text)


def stop_run(folder: Path) -> None:
    """Leaves the files of a killed run."""
    (folder / "long.yaml").write_text(MODEL.replace("duration: 0.1, interval: 0.05", "duration: 40, interval: 0.05")
                                      + "output: {checkpoint: 0.01}\nsolver: {accuracy: 1e-9}\n")
    process = subprocess.Popen([os.environ["SIMFLEX_PROGRAM"], *"run long.yaml -q --no-pictures -o stopped.h5".split()], cwd=folder)
    while not (folder / "stopped.h5.checkpoint").exists() and process.poll() is None:
        time.sleep(0.001)
    process.kill()
    if process.wait() == 0:
        raise RuntimeError("the run to be stopped ended before")


SCENE = "run scene.yaml -q --no-pictures --animation scene.glb -o a.h5 --set bodies.weight.shape.mesh="
# File, command that reads it, whether it has a checksum.
READERS = [
    ("model.yaml", "run model.yaml --check", False),
    ("model.yaml", "run model.yaml -q --no-pictures -o a.h5", False),
    ("push.csv", "run model.yaml --check", False),
    ("script.txt", "shell model.yaml -q --script script.txt", False),
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
    ("part.h5", "run bar.yaml -q --no-pictures -o a.h5", True),
    ("slopes.h5", "export slopes.h5 -q -o a.h5", True),
    ("result.h5", "report result.h5 -q -o a.html", True),
    ("sweep.h5", "plot sweep.h5 height.maximum --x load -o figure.svg --csv figure.csv", True),
    ("stopped.h5.rows", "run long.yaml -q --no-pictures --resume -o stopped.h5", True),
    ("stopped.h5.checkpoint", "run long.yaml -q --no-pictures --resume -o stopped.h5", True),
    ("net.npz", "reduce net.npz -m 10 -q -o a.h5", False),
    ("net.mat", "reduce net.mat -m 10 -q -o a.h5", False),
    ("K.mtx", "reduce K.mtx --mass-matrix M.mtx --nodes nodes.csv -m 10 -q -o a.h5", False),
    ("nodes.csv", "reduce K.mtx --mass-matrix M.mtx --nodes nodes.csv -m 10 -q -o a.h5", False),
    ("K_abaqus.mtx", "reduce K_abaqus.mtx --mass-matrix M_abaqus.mtx --nodes nodes.csv -m 10 -q -o a.h5", False),
    ("dofs.csv", "reduce K.mtx --mass-matrix M.mtx --nodes nodes.csv --dofs dofs.csv -m 10 -q -o a.h5", False),
    ("net.pch", "reduce net.pch --nodes nodes.csv -m 10 -q -o a.h5", False),
    ("box.msh", "reduce box.msh --material steel -m 10 -q -o a.h5", False),
    ("shapes.unv", "mac shapes.unv shapes.unv", False),
    ("shapes.csv", "mac shapes.csv shapes.csv", False),
    ("response.unv", "mac response.unv response.unv", False),
    ("scene.yaml", SCENE + "cube.stl", False),
    ("cube.stl", SCENE + "cube.stl", False),
    ("cube.obj", SCENE + "cube.obj", False),
    ("cube.vtp", SCENE + "cube.vtp", False),
    ("unit.fmu", "run unit.yaml --check", True),
    ("modelDescription.xml", "run unit.yaml --check", False),
]


def call(folder: Path, command: str) -> subprocess.CompletedProcess:
    environment = {"SIMFLEX_CACHE": str(folder / "cache"), "TMPDIR": str(folder / "tmp"), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return commands.call([os.environ["SIMFLEX_PROGRAM"], *command.split()], folder, environment, MEMORY)


def prepare(shared: Path) -> None:
    shutil.rmtree(shared, ignore_errors=True)
    (shared / "tmp").mkdir(parents=True)
    parts.write_deck(parts.Bar("bar", 0.3, 0.02, 3, 2e11, 7850, False), shared / "bar.inp")
    write_surfaces(shared)
    (shared / "model.yaml").write_text(MODEL)
    (shared / "scene.yaml").write_text(MODEL.replace("mass: load, inertia: [0.1, 0.1, 0.1]", "density: 1e4"))
    (shared / "push.csv").write_text("t,force\n0,1.5\n0.05,2.25\n1,-3e1\n")
    (shared / "script.txt").write_text("set parameters.load 1.5\nset joint.slide.displacement 0.25\nget height\nrun 0.05\nget height twice\nlist frames\n")
    (shared / "cases.csv").write_text("load,stiffness\n1.5,200\n2,300\n")
    (shared / "box.geo").write_text('SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 0.2, 0.1, 0.1};\n'
                                    "Physical Volume(\"BODY\") = {1};\n")
    write_nastran_bar(shared / "bar.bdf")
    write_matrices(shared)
    write_tests(shared)
    (shared / "bar.yaml").write_text("simflex: 1\nparts: {bar: {file: part.h5}}\nbodies: {bar: {part: bar}}\n"
                                     "joints: {wall: {type: weld, between: [ground, bar.near]}}\n"
                                     "analyses: {modes: {type: eigen, count: 4}}\n")
    shutil.copy(CORPUS / "ansys_deck" / "model.cdb", shared)
    (shared / "unit.yaml").write_text(
        "simflex: 1\nbodies: {weight: {mass: 1, inertia: [1, 1, 1]}}\ncontrollers:\n"
        "  unit: {fmu: unit.fmu, inputs: {}, outputs: [height], period: 0.01}\n"
        "analyses: {run: {type: transient, duration: 0.1}}\n")
    for command in ("reduce bar.inp -i near=NEAR -i far=FAR -m 14 -q -o part.h5", "export part.h5 -o part.fem",
                    "reduce bar.inp -i near=NEAR -m 8 --derivative density:M --derivative youngs_modulus:M -q -o slopes.h5",
                    "run model.yaml -q --no-pictures -o result.h5", "fmu model.yaml --thin -q -o unit.fmu",
                    "sweep model.yaml --vary load=1,2 -q --jobs 1 -o s"):
        ended = call(shared, command)
        if ended.returncode != 0:
            raise RuntimeError(f"{command}: {ended.stderr}")
    with zipfile.ZipFile(shared / "unit.fmu") as unit:
        unit.extract("modelDescription.xml", shared)
    shutil.copy(shared / "s" / "sweep.h5", shared)
    stop_run(shared)
    for _, command, _ in READERS:
        folder = shared / "tried"
        copy_files(shared, folder)
        ended = call(folder, command)
        shutil.rmtree(folder)
        if ended.returncode != 0:
            raise RuntimeError(f"{command}: {ended.stderr}")


def copy_files(shared: Path, folder: Path) -> None:
    """Sets up a folder as for a case."""
    (folder / "tmp").mkdir(parents=True)
    for path in shared.iterdir():
        if path.is_file():
            shutil.copy(path, folder)


def read_outputs(folder: Path, ended: subprocess.CompletedProcess) -> list:
    """A command's output and files, without checksums and sizes of its inputs."""
    outputs = [re.sub(r", [\d.]+ [kM]?B\n", "\n", ended.stdout)]
    for file in [folder / name for name in ("a.h5", "stopped.h5", "figure.csv")]:
        content = read_content(file) if file.exists() else {}
        if file.suffix == ".h5":
            content.pop("input_checksums", None)
        outputs.append(content)
    return outputs


def check_scene(folder: Path, outcome: harness.Outcome) -> None:
    """Reads the animation of a run of scene.yaml, and writes it back as a surface with the same motion."""
    scenes = list(folder.glob("*.glb"))
    outcome.counts["scenes read"] += len(scenes)
    for path in scenes:
        try:
            scene = gltf.Animation(path)
            nodes = scene.json["nodes"]
            weight = [node for node in nodes if node.get("name") == "weight"]
            meshes = [nodes[child] for node in weight for child in node["children"] if "mesh" in nodes[child]]
            primitives = [primitive for node in meshes for primitive in scene.json["meshes"][node["mesh"]]["primitives"]]
        except (ValueError, KeyError, IndexError) as error:
            return outcome.fail("scene", repr(error))
        if len(weight) != 1 or len(primitives) != 1:
            return outcome.fail("scene", f"it has {len(weight)} bodies 'weight', of {len(primitives)} surfaces")
        points = scene.arrays[primitives[0]["attributes"]["POSITION"]] * meshes[0].get("scale", 1)
        corners = scene.arrays[primitives[0]["indices"]][:, 0]
        lines = ["solid back"]
        for triangle in points[corners].reshape(-1, 3, 3):
            vertices = [f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle.tolist()]
            lines += ["facet normal 0 0 0", "outer loop", *vertices, "endloop", "endfacet"]
        (folder / "back.stl").write_text("\n".join([*lines, "endsolid back", ""]))
        ended = call(folder, "run scene.yaml -q --no-pictures -o back.h5 --set bodies.weight.shape.mesh=back.stl")
        if ended.returncode != 0:
            return outcome.fail("scene", f"written back it is refused: {ended.stderr[-300:]}")
        fallen = []
        for name in ("a.h5", "back.h5"):
            with h5py.File(folder / name) as results:
                height = results["analyses/fall/probes/height"][()].ravel()
                fallen.append(height - height[0])
        if np.abs(fallen[0] - fallen[1]).max() > 1e-3 * np.abs(fallen[0]).max():
            outcome.fail("scene", f"written back it falls by {fallen[1]} instead of {fallen[0]} m")


def replace_in_archive(source: Path, target: Path, name: str, data: bytes) -> None:
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for entry in old.namelist():
            new.writestr(entry, data if entry == name else old.read(entry))


def mutate(data: bytes, other: bytes, random_: random.Random) -> bytes:
    """Makes one change; `other` is any other file."""
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


def spoil_number(name: str, data: bytes, random_: random.Random):
    """Puts a letter into a number of several digits. None without such a number, or if Gmsh would read it as
    hexadecimal (0x.2)."""
    numbers = [found for found in re.finditer(rb"(?<![\w.#-])-?\d+\.?\d+(?![\w.-])", data)]
    if not numbers:
        return None
    found = random_.choice(numbers)
    at = random_.randrange(found.start() + 1, found.end())
    letter = random_.choice([b"x", b"q", b"_", b"'", b"O"])
    is_hexadecimal = letter == b"x" and found.group()[:at - found.start()] in (b"0", b"-0") and name.endswith((".msh", ".geo"))
    return None if is_hexadecimal else data[:at] + letter + data[at:]


def try_case(seed: int, index: int, folder: Path) -> harness.Outcome:
    outcome = harness.Outcome()
    random_ = random.Random(f"{seed} {index}")
    shared = folder.parent / "parts"
    name, command, has_checksum = random_.choice(READERS)
    copy_files(shared, folder)
    data = (shared / name).read_bytes()
    must_be_same = has_checksum
    spoilt = spoil_number(name, data, random_) if not has_checksum and random_.random() < 0.25 else None
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
    errors = ended.stderr
    if ended.returncode is None:
        outcome.fail("hang", "it goes on, or stands still")
    elif ended.returncode not in (0, 1, 2):
        outcome.fail("crash", f"status {ended.returncode}: {errors[-300:]}")
    elif ended.returncode != 0:
        outcome.counts["refused"] += 1
        if not errors.startswith("simflex: ") or "\x1b" in errors:
            outcome.fail("words", errors[-300:] or "it said nothing")
        rest = {path.name for path in folder.iterdir()} - before - {"cache"}
        rest |= {f"tmp/{path.name}" for path in (folder / "tmp").iterdir()}
        if rest:
            outcome.fail("rest", ", ".join(sorted(rest)))
    else:
        outcome.counts["accepted"] += 1
        if must_be_same and ": setting '" not in ended.stdout:  # a sweep lists its cases with their errors
            outcome.counts["accepted that has to be as before"] += 1
            unchanged = folder / "unchanged"
            copy_files(shared, unchanged)
            original = call(unchanged, command)
            if read_outputs(unchanged, original) != read_outputs(folder, ended):
                outcome.fail("meaning", "accepted, and read otherwise than without the change")
        if SCENE in command:
            check_scene(folder, outcome)
    return outcome


if __name__ == "__main__":
    harness.main(__doc__, "inputs", try_case, count=200, limit=120, prepare=prepare)
