"""Reads the page of `simflex report` without a browser: its data, and that nothing in it comes from
elsewhere. Vertices of a body, by its shapes and weights at factor 1, must be at nodes of the .vtu files
of the same run: at most 1e-4 of the part's size apart. Prints "N vertices at T times".

    check_report.py FILE.html FOLDER BODY      FOLDER/BODY_00000.vtu ...
"""

import base64
import glob
import json
import re
import sys

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy


def decode(text, kind):
    return numpy.frombuffer(base64.b64decode(text), kind)


def turn(quaternion, points):
    axis, w = quaternion[:3], quaternion[3]
    return points + 2 * numpy.cross(axis, numpy.cross(axis, points) + w * points)


def read_vtu(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).astype(float)


def main():
    path, folder, name = sys.argv[1:4]
    with open(path, encoding="utf-8") as file:
        page = file.read()
    foreign = re.findall(r"(?:src|href)\s*=|https?://|@import|url\(", page)
    if foreign:
        sys.exit("the page loads what is elsewhere: %s" % foreign)
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.S)[1])
    scene = data["analyses"][0]["scene"]
    body = [b for b in scene["bodies"] if b["name"] == name][0]
    rest = decode(scene["geometries"][body["geometry"]]["positions"], "<f4").reshape(-1, 3).astype(float)
    shapes = [s["scale"] * decode(s["values"], "<i2").reshape(-1, 3).astype(float) for s in body["shapes"]]
    weights = decode(body["weights"], "<f4").reshape(-1, len(shapes))
    assert shapes, "bending"
    poses = decode(body["poses"][scene["factors"].index(1)], "<f4").reshape(-1, 7).astype(float)
    files = sorted(glob.glob("%s/%s_*.vtu" % (folder, name)))
    assert len(files) == len(scene["time"]) == len(weights) == len(poses), "times"
    for k, file in enumerate(files):
        points = rest + sum(float(w) * s for w, s in zip(weights[k], shapes))
        points = turn(poses[k, 3:], points) + poses[k, :3]
        nodes = read_vtu(file)
        size = numpy.linalg.norm(nodes.max(axis=0) - nodes.min(axis=0))
        apart = numpy.linalg.norm(points[:, None] - nodes[None], axis=2).min(axis=1).max() / size
        if not apart < 1e-4:
            sys.exit("%g of the part's size apart at time %d" % (apart, k))
    # A spring from a fixed place to the body's far end.
    (spring,) = scene["links"]["ends"]
    ends = decode(spring[scene["factors"].index(1)], "<f4").reshape(-1, 6)
    assert len(ends) == len(files) and abs(ends[:, :3] - [0, 0.1, 0]).max() < 1e-6, "fixed end"
    reach = numpy.linalg.norm(ends[:, 3:], axis=1)
    assert abs(reach - 0.2).max() < 0.02 and numpy.ptp(ends[:, 3:], axis=0).max() > 0.05, "moved end"
    print("%d vertices at %d times" % (len(rest), len(files)))


main()
