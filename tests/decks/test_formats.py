#!/usr/bin/env python3
"""A part has the same mass and frequencies in every format that simflex reads.

    test_formats.py SIMFLEX_PROGRAM

Gmsh meshes a bracket once. The mesh is written as a deck, a moved and rotated instance of an assembly, a deck with
parameters, bulk data, an Ansys model and a universal file, and CalculiX's K and M as matrices of every kind."""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

ALLOWED = 1e-8
GEOMETRY = """SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 0.08, 0.03, 0.01};
Box(2) = {0, 0, 0, 0.01, 0.03, 0.05};
BooleanUnion(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Physical Volume("BODY") = {3};
Mesh.CharacteristicLengthMax = 0.012;
"""
E, NU, RHO = 7e10, 0.3, 2700
MATERIAL = f"*MATERIAL, NAME=METAL\n*ELASTIC\n{E:.0f}.,{NU}\n*DENSITY\n{RHO}.\n"
SECTION = "*SOLID SECTION, ELSET=BODY, MATERIAL=METAL\n"
WALLS = ["--interface", "foot=plane:0.08,0,0,1,0,0", "--interface", "head=plane:0,0,0.05,0,0,1"]
CALCULIX = os.environ.get("SIMFLEX_CCX", "ccx")
os.environ["OMP_NUM_THREADS"] = "1"  # the part is small


def call(command, folder):
    done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: status {done.returncode}\n{done.stdout}")


def read_mesh(path):
    """Positions of the nodes and nodes of the tetrahedra, both by number, from Gmsh's file for CalculiX."""
    nodes, elements, at = {}, {}, ""
    for line in path.read_text().splitlines():
        if line.startswith("*"):
            at = line.replace(" ", "").upper()
            continue
        words = line.split(",")
        if at.startswith("*NODE"):
            nodes[int(words[0])] = [float(word) for word in words[1:4]]
        elif "TYPE=C3D10" in at:
            elements[int(words[0])] = [int(word) for word in words[1:11]]
    return nodes, elements


def deck_mesh(nodes, elements):
    text = "*NODE\n" + "".join(f"{n}, {x[0]!r}, {x[1]!r}, {x[2]!r}\n" for n, x in nodes.items())
    return text + "*ELEMENT, TYPE=C3D10, ELSET=BODY\n" + "".join(
        ", ".join(map(str, [e] + list(of))) + "\n" for e, of in elements.items())


def instance(nodes, elements):
    """A part defined elsewhere, in other axes, whose instance coincides with the other decks."""
    shift, angle = np.array([0.3, -0.2, 0.1]), 40 * np.pi / 180
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    made = {n: [float(v) for v in turn.T @ np.array(x) - shift] for n, x in nodes.items()}
    return ("*HEADING\n part\n*PART, NAME=Bracket\n" + deck_mesh(made, elements) + SECTION + "*END PART\n"
            "*ASSEMBLY, NAME=Assembly\n*INSTANCE, NAME=Bracket-1, PART=Bracket\n"
            f"{', '.join(map(repr, shift.tolist()))}\n0., 0., 0., 0., 0., 1., 40.\n*END INSTANCE\n*END ASSEMBLY\n" + MATERIAL)


def bulk(nodes, elements):
    grids = "".join(f"GRID,{n},,{x[0]!r},{x[1]!r},{x[2]!r}\n" for n, x in nodes.items())
    solids = "".join(f"CTETRA,{e},1,{','.join(map(str, of[:6]))},\n+,{','.join(map(str, of[6:]))}\n"
                     for e, of in elements.items())
    return f"BEGIN BULK\n{grids}{solids}PSOLID,1,1\nMAT1,1,{E:.0f}.,,{NU},{RHO}.\nENDDATA\n"


def ansys(nodes, elements):
    text = "/PREP7\nET,1,187\nNBLOCK,6,SOLID\n(3i9,6e25.16e3)\n"
    text += "".join(f"{n:9d}{0:9d}{0:9d}" + "".join(f"{v:25.16E}" for v in x) + "\n" for n, x in nodes.items())
    text += "N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID\n(19i9)\n"
    for e, of in elements.items():
        row = [1, 1, 1, 1, 0, 0, 0, 0, 10, 0, e] + list(of)
        for first in range(0, len(row), 19):
            text += "".join(f"{v:9d}" for v in row[first:first + 19]) + "\n"
    return text + f"       -1\nMP,EX,1,{E}\nMP,PRXY,1,{NU}\nMP,DENS,1,{RHO}\n"


def matrices(deck, folder):
    """K and M of the deck as CalculiX stores them, three rows per node."""
    (folder / "stored.inp").write_text(deck + "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n*END STEP\n")
    call([CALCULIX, "stored"], folder)
    dofs = [line.strip().split(".") for line in (folder / "stored.dof").read_text().split()]
    numbers = sorted({int(node) for node, _ in dofs})
    row_of = {number: 3 * k for k, number in enumerate(numbers)}
    rows = np.array([row_of[int(node)] + int(axis) - 1 for node, axis in dofs])

    def read(suffix):
        i, j, values = np.loadtxt(folder / f"stored.{suffix}", unpack=True)
        lower = sp.coo_matrix((values, (rows[i.astype(int) - 1], rows[j.astype(int) - 1])), shape=(len(rows),) * 2).tocsc()
        return (lower + lower.T - sp.diags(lower.diagonal())).tocsc()

    return numbers, read("sti"), read("mas")


def write_matrices(numbers, K, M, nodes, folder):
    """Writes K and M in every format. @returns each one's file and arguments."""
    xyz = np.array([nodes[n] for n in numbers])
    lower = {"K": sp.tril(K).tocoo(), "M": sp.tril(M).tocoo()}
    for name, A in lower.items():
        with open(folder / f"{name}.mtx", "w") as out:
            out.write(f"%%MatrixMarket matrix coordinate real symmetric\n{A.shape[0]} {A.shape[1]} {A.nnz}\n")
            out.writelines(f"{i + 1} {j + 1} {v:.17g}\n" for i, j, v in zip(A.row, A.col, A.data))
        with open(folder / f"job_{name}.mtx", "w") as out:
            out.writelines(f"{numbers[i // 3]},{i % 3 + 1}, {numbers[j // 3]},{j % 3 + 1}, {v:.17e}\n"
                           for i, j, v in zip(A.row, A.col, A.data))
    with open(folder / "part.pch", "w") as out:
        for name, A in (("KAAX", lower["K"].tocsc()), ("MAAX", lower["M"].tocsc())):
            out.write(f"DMIG,{name},0,6,2,0\n")
            for j in range(A.shape[1]):
                entries = range(A.indptr[j], A.indptr[j + 1])
                head = f"DMIG,{name},{numbers[j // 3]},{j % 3 + 1},"
                out.writelines((head if k == 0 else "+") + f",{numbers[A.indices[e] // 3]},{A.indices[e] % 3 + 1},"
                               f"{A.data[e]:.17g},\n" for k, e in enumerate(entries))
    (folder / "nodes.csv").write_text("number, x, y, z\n" + "".join(
        f"{n}, {x[0]!r}, {x[1]!r}, {x[2]!r}\n" for n, x in zip(numbers, xyz.tolist())))
    np.savez(folder / "part.npz", K_data=K.data, K_indices=K.indices, K_indptr=K.indptr, M_data=M.data,
             M_indices=M.indices, M_indptr=M.indptr, nodes=np.column_stack([numbers, xyz]))
    scipy.io.savemat(folder / "part.mat", {"K": K, "M": M, "nodes": np.column_stack([numbers, xyz])})
    return [("K.mtx", ["--mass-matrix", "M.mtx", "--nodes", "nodes.csv"]),
            ("job_K.mtx", ["--mass-matrix", "job_M.mtx", "--nodes", "stored.inp"]),
            ("part.pch", ["--nodes", "part.bdf"]), ("part.npz", []), ("part.mat", [])]


def main():
    simflex = str(Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory(prefix="simflex-formats-") as name:
        folder = Path(name)
        (folder / "part.geo").write_text(GEOMETRY)
        metal = ["--material", f"E={E},nu={NU},rho={RHO}"]
        gmsh = os.environ.get("SIMFLEX_GMSH", "gmsh")
        call([gmsh, "-3", "-order", "2", "part.geo", "-o", "part.msh"], folder)
        for suffix in ("unv", "inp"):
            call([gmsh, "-0", "part.msh", "-o", f"mesh.{suffix}"], folder)
        nodes, elements = read_mesh(folder / "mesh.inp")
        used = {n for of in elements.values() for n in of}
        nodes = {n: x for n, x in nodes.items() if n in used}
        plain = deck_mesh(nodes, elements) + MATERIAL + SECTION
        texts = {"plain.inp": plain, "instance.inp": instance(nodes, elements), "part.bdf": bulk(nodes, elements),
                 "part.cdb": ansys(nodes, elements),
                 "names.inp": "*PARAMETER\nlength = 0.08\nE = 2*35.e9\nname = 'METAL'\n" +
                 plain.replace(f"{E:.0f}.", "<E>").replace("MATERIAL=METAL", "MATERIAL=<name>")
                 .replace(" 0.08,", " <length>,"),
                 "crlf.inp": plain.replace("\n", "\r\n").lower()}
        for file, text in texts.items():
            (folder / file).write_text(text, newline="")
        routes = [(file, []) for file in texts] + [("part.msh", metal), ("mesh.unv", metal)]
        routes += write_matrices(*matrices(plain, folder), nodes, folder)
        answers = {}
        for file, arguments in routes:
            call([simflex, "reduce", file, "--no-resume", "-q", "-m", "24", "-o", "out.h5"] + arguments + WALLS, folder)
            done = subprocess.run([simflex, "info", "out.h5", "--json"], cwd=folder, stdout=subprocess.PIPE, check=True)
            answers[file] = json.loads(done.stdout)
        expected, worst = answers["plain.inp"], 0
        for file, answer in answers.items():
            own = np.array(answer["frequencies"] + [answer["mass"]])
            difference = np.abs(own / np.array(expected["frequencies"] + [expected["mass"]]) - 1).max()
            print(f"{file:16} {len(answer['frequencies'])} frequencies, the lowest {answer['frequencies'][0]:.9g} Hz, "
                  f"mass {answer['mass']:.9g} kg, differ by {difference:.1e}")
            worst = max(worst, difference)
        # The two boxes without their overlap.
        volume = 0.08 * 0.03 * 0.01 + 0.01 * 0.03 * 0.04
        mass = abs(expected["mass"] / (RHO * volume) - 1)
        print(f"{len(answers)} formats differ by {worst:.1e}, the mass from ρV by {mass:.1e}")
        assert len(answers) == 13 and worst < ALLOWED and mass < ALLOWED


if __name__ == "__main__":
    main()
