#!/usr/bin/python3
"""Reads a part file of simflex with h5py: mass, free-free frequencies, and how the part deforms under
forces on its interfaces. The layout of the file is described in plugin/part/ReducedBodyFile.h.

    examples/part_file.py rod.h5
    examples/part_file.py rod.h5 --load big_end=-1000,0,0 --load small_end=1000,0,0,0,0,0

A load is a force in N and, if there are six numbers, a moment in N m, on the master point of the
interface along the deck's axes. What the loads do not balance accelerates the part (inertia relief).
Needs python3-h5py and python3-numpy.
"""
import argparse
import json

import h5py
import numpy


def read_part(path):
    """The part as a dict of numpy arrays; matrices as in the formulas: modes are columns."""
    with h5py.File(path, "r") as file:
        if file.attrs.get("format") not in ("simflex reduced body", b"simflex reduced body"):
            raise SystemExit("%s is no part file of simflex" % path)
        groups = [file["interfaces/%d" % k] for k in range(len(file["interfaces"]))]
        return {
            "name": text(file.attrs["name"]),
            "mass": file["mass"][0],
            "center_of_mass": file["center_of_mass"][:],
            "omega_squared": file["omega_squared"][:],
            "Phi": file["Phi"][:].T,  # HDF5 shows what is stored column by column as the transpose
            "positions": file["mesh/positions"][:],  # from the centre of mass
            "node_numbers": file["mesh/node_numbers"][:],
            "interfaces": [
                {
                    "name": text(group.attrs["name"]),
                    "position": group["position"][:],
                    "Phi": group["Phi"][:].T,  # 3 x modes: translation of the master point
                    "Psi": group["Psi"][:].T,  # 3 x modes: its rotation
                }
                for group in groups
            ],
        }


def text(value):
    return value.decode() if isinstance(value, bytes) else str(value)


def calc_frequencies(part):
    """Free-free frequencies in Hz."""
    return numpy.sqrt(part["omega_squared"]) / (2 * numpy.pi)


def calc_deflection(part, loads):
    """Modal coordinates under constant loads, {interface: force and moment}: xi = f / Omega^2."""
    force = numpy.zeros(len(part["omega_squared"]))
    for name, load in loads.items():
        seats = [seat for seat in part["interfaces"] if seat["name"] == name]
        if not seats:
            names = ", ".join(seat["name"] for seat in part["interfaces"])
            raise SystemExit("there is no interface '%s'; the part has: %s" % (name, names))
        force += seats[0]["Phi"].T @ load[:3] + seats[0]["Psi"].T @ load[3:]
    return force / part["omega_squared"]


def parse_load(argument):
    name, _, numbers = argument.rpartition("=")
    load = numpy.array([float(number) for number in numbers.split(",")])
    if not name or len(load) not in (3, 6):
        raise ValueError
    return name, numpy.concatenate([load, numpy.zeros(6 - len(load))])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", metavar="PART.h5")
    parser.add_argument("--load", metavar="NAME=FX,FY,FZ[,MX,MY,MZ]", type=parse_load, action="append", default=[])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    arguments = parser.parse_args()

    part = read_part(arguments.part)
    frequencies = calc_frequencies(part)
    xi = calc_deflection(part, dict(arguments.load))
    u = (part["Phi"] @ xi).reshape(-1, 3)
    sizes = numpy.linalg.norm(u, axis=1)
    deflections = {
        seat["name"]: {"translation": (seat["Phi"] @ xi).tolist(), "rotation": (seat["Psi"] @ xi).tolist()}
        for seat in part["interfaces"]
    }

    if arguments.json:
        print(json.dumps({
            "name": part["name"],
            "mass": part["mass"],
            "frequencies": frequencies.tolist(),
            "interfaces": deflections,
            "largest_displacement": sizes.max(),
            "strain_energy": 0.5 * float(xi @ (part["omega_squared"] * xi)),
        }))
        return
    print("%s: %.6g kg, %d modes" % (part["name"], part["mass"], len(frequencies)))
    print("frequencies [Hz]:", " ".join("%.6g" % hertz for hertz in frequencies))
    if arguments.load:
        print("largest displacement %.6g m, of node %d" % (sizes.max(), part["node_numbers"][sizes.argmax()]))
        for name, seat in deflections.items():
            print("%-20s moves %s m, turns %s rad" % (name, *(
                "(" + ", ".join("%.4g" % x for x in seat[key]) + ")" for key in ("translation", "rotation"))))


if __name__ == "__main__":
    main()
