"""Reads an animation (binary glTF) by the rules of its specification, and again with VTK, and
compares every node at every time with the .vtu files of the same run: at most 1e-4 of the part's size
apart. Prints "N nodes at T times, D apart".

    check_animation.py FILE.glb FOLDER BODY [STRIDE]      FOLDER/BODY_00000.vtu ...
"""

import glob
import sys
from pathlib import Path

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "stress"))
from support.gltf import Animation, require  # noqa: E402


def read_vtu(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    numbers = vtk_to_numpy(grid.GetPointData().GetArray("node number")).astype(int)
    return dict(zip(numbers, vtk_to_numpy(grid.GetPoints().GetData()).astype(float)))


def read_by_vtk(path, time, count):
    """Points of the first mesh with so many at a time [s of the animation]."""
    reader = vtk.vtkGLTFReader()
    reader.SetFileName(path)
    reader.ApplyDeformationsToGeometryOn()
    reader.UpdateInformation()
    reader.EnableAnimation(0)
    reader.SetFrameRate(60)
    reader.UpdateInformation()
    reader.UpdateTimeStep(time)
    walk = reader.GetOutput().NewIterator()
    while not walk.IsDoneWithTraversal():
        data = walk.GetCurrentDataObject()
        if data.GetNumberOfPoints() == count:
            return vtk_to_numpy(data.GetPoints().GetData()).astype(float)
        walk.GoToNextItem()
    sys.exit("VTK finds no mesh with %d points" % count)


def main():
    path, folder, body = sys.argv[1:4]
    animation = Animation(path)
    number = [n for n, node in enumerate(animation.json["nodes"]) if node.get("name") == body][0]
    files = sorted(glob.glob("%s/%s_*.vtu" % (folder, body)))
    times = animation.find_track(number, "translation")[0]
    if times is None:
        times = animation.find_track(number, "weights")[0]
    require(len(files) == len(times), "as many times as .vtu files")
    largest = largest_of_vtk = 0
    require("weights" in animation.json["meshes"][animation.json["nodes"][number]["mesh"]], "bending")
    for frame, file in enumerate(files):
        nodes = read_vtu(file)
        ends = numpy.array(list(nodes.values()))
        size = numpy.linalg.norm(ends.max(axis=0) - ends.min(axis=0))
        points, numbers = animation.place(number, frame)
        isNode = numbers >= 0
        expected = numpy.array([nodes[n] for n in numbers[isNode]])
        apart = numpy.linalg.norm(points[isNode] - expected, axis=1).max()
        largest = max(largest, apart / size)
        if frame % max(1, len(files) // 5) == 0:
            found = read_by_vtk(path, float(times[frame]), len(points))
            apart = numpy.linalg.norm(found - points, axis=1).max()
            largest_of_vtk = max(largest_of_vtk, apart / size)
    print("%d nodes at %d times, %.1e apart; VTK %.1e" %
          (len(set(numbers[isNode])), len(files), largest, largest_of_vtk))
    if not (largest < 1e-4 and largest_of_vtk < 1e-4):
        sys.exit("too far apart")


main()
