"""Reads binary glTF according to its specification, without any code of simflex.

    scene = gltf.Animation(path)     # ValueError if the file breaks a rule
    points, nodes = scene.place(number, frame)

Khronos: glTF 2.0 Specification, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

import json
import struct

import numpy

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TYPES = {5121: numpy.uint8, 5123: numpy.uint16, 5125: numpy.uint32, 5126: numpy.float32}


def require(is_true, what):
    if not is_true:
        raise ValueError("not glTF: " + what)


class Animation:
    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        magic, version, size = struct.unpack("<4sII", data[:12])
        require(magic == b"glTF" and version == 2 and size == len(data), "header")
        length, kind = struct.unpack("<I4s", data[12:20])
        require(kind == b"JSON" and length % 4 == 0, "first chunk")
        self.json = json.loads(data[20:20 + length])
        rest = data[20 + length:]
        length, kind = struct.unpack("<I4s", rest[:8])
        require(kind == b"BIN\0" and length == len(rest) - 8 and length % 4 == 0, "second chunk")
        self.bytes = rest[8:]
        require(self.json["asset"]["version"] == "2.0", "version")
        require(len(self.json["buffers"]) == 1 and "uri" not in self.json["buffers"][0], "buffer")
        require(0 <= len(self.bytes) - self.json["buffers"][0]["byteLength"] < 4, "buffer's length")
        self.arrays = [self.read(accessor) for accessor in self.json["accessors"]]
        self.check()

    def read(self, accessor):
        view = self.json["bufferViews"][accessor["bufferView"]]
        require(view["byteOffset"] % 4 == 0, "alignment")
        end = view["byteOffset"] + view["byteLength"]
        require(view["byteLength"] > 0 and end <= len(self.bytes), "buffer view")
        kind, width = TYPES[accessor["componentType"]], WIDTHS[accessor["type"]]
        require(accessor["count"] > 0, "count")
        values = numpy.frombuffer(self.bytes[view["byteOffset"]:end], kind)
        require(values.size == accessor["count"] * width, "size of an accessor")
        values = values.reshape(-1, width)
        require(numpy.isfinite(values).all(), "number that is not finite")
        for key, found in (("min", values.min(axis=0)), ("max", values.max(axis=0))):
            if key in accessor:
                require(numpy.array_equal(numpy.float32(accessor[key]), found), key)
        return values

    def check(self):
        """Checks what the specification requires of meshes, nodes and animations."""
        accessors = self.json["accessors"]
        for mesh in self.json["meshes"]:
            for primitive in mesh["primitives"]:
                place = primitive["attributes"]["POSITION"]
                count = accessors[place]["count"]
                require("min" in accessors[place] and "max" in accessors[place], "bounds")
                for name, number in primitive["attributes"].items():
                    require(accessors[number]["count"] == count, "count of " + name)
                    require(name[0] == "_" or name in ("POSITION", "NORMAL", "COLOR_0"), name)
                normals = self.arrays[primitive["attributes"]["NORMAL"]]
                require(abs(numpy.linalg.norm(normals, axis=1) - 1).max() < 1e-5, "normals")
                if "indices" in primitive:
                    require(self.arrays[primitive["indices"]].max() < count, "index")
                    require(accessors[primitive["indices"]]["count"] % 3 == 0, "triangles")
                targets = primitive.get("targets", [])
                require(len(mesh.get("weights", [])) == len(targets), "weights of a mesh")
                for target in targets:
                    require(accessors[target["POSITION"]]["count"] == count, "target")
                    require("min" in accessors[target["POSITION"]], "bounds of a target")
        seen = set()
        for node in self.json["nodes"]:
            for child in node.get("children", []):
                require(child not in seen, "node with two parents")
                seen.add(child)
            if "rotation" in node:
                require(abs(numpy.linalg.norm(node["rotation"]) - 1) < 1e-6, "rotation")
        require(self.json["scenes"][0]["nodes"] == [
            n for n in range(len(self.json["nodes"])) if n not in seen], "roots")
        for animation in self.json.get("animations", []):
            used = set()
            for channel in animation["channels"]:
                target = (channel["target"]["node"], channel["target"]["path"])
                require(target not in used, "second channel of a target")
                used.add(target)
                sampler = animation["samplers"][channel["sampler"]]
                times, values = self.arrays[sampler["input"]], self.arrays[sampler["output"]]
                require("min" in accessors[sampler["input"]], "bounds of times")
                require((numpy.diff(times[:, 0]) > 0).all() and times[0, 0] >= 0, "times")
                per_time = 1
                if target[1] == "weights":
                    mesh = self.json["meshes"][self.json["nodes"][target[0]]["mesh"]]
                    per_time = len(mesh["weights"])
                require(len(values) == per_time * len(times), "length of a track")
                if target[1] == "rotation":
                    require(abs(numpy.linalg.norm(values, axis=1) - 1).max() < 1e-5, "rotations")
                    require((values[1:] * values[:-1]).sum(axis=1).min() >= 0, "turn the long way")

    def find_track(self, node, path):
        animation = self.json["animations"][0]
        for channel in animation["channels"]:
            if channel["target"] == {"node": node, "path": path}:
                sampler = animation["samplers"][channel["sampler"]]
                return self.arrays[sampler["input"]][:, 0], self.arrays[sampler["output"]]
        return None, None

    def place(self, number, frame):
        """Vertices of a scene node's mesh, in the axes of the scene, and their numbers in the finite element mesh."""
        node = self.json["nodes"][number]
        mesh = self.json["meshes"][node["mesh"]]
        primitive = mesh["primitives"][0]
        points = self.arrays[primitive["attributes"]["POSITION"]].astype(float)
        targets = primitive.get("targets", [])
        if targets:
            weights = self.find_track(number, "weights")[1].reshape(-1, len(targets))[frame]
            for weight, target in zip(weights, targets):
                points = points + float(weight) * self.arrays[target["POSITION"]]
        for path in ("rotation", "translation"):
            track = self.find_track(number, path)[1]
            value = numpy.array(node[path] if track is None else track[frame], float)
            points = points + value if path == "translation" else turn(value, points)
        parent = [p for p in self.json["nodes"] if number in p.get("children", [])][0]
        if "rotation" in parent:
            points = turn(numpy.array(parent["rotation"]), points)
        return points, self.arrays[primitive["attributes"]["_NODE"]][:, 0].astype(int)


def turn(quaternion, points):
    axis, w = quaternion[:3], quaternion[3]
    return points + 2 * numpy.cross(axis, numpy.cross(axis, points) + w * points)
