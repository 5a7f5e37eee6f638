"""Reads a .vtu by Python's XML parser and numpy, and checks that every array has the size its tags promise."""
import struct
import sys
import xml.etree.ElementTree as ElementTree

import numpy

content = open(sys.argv[1], "rb").read()
start = content.index(b"<AppendedData")
data = content.index(b"_", start) + 1
end = content.rindex(b"</AppendedData>")
root = ElementTree.fromstring(content[:data] + content[end:])
assert root.get("type") == "UnstructuredGrid" and root.get("header_type") == "UInt64"
order = {"LittleEndian": "<", "BigEndian": ">"}[root.get("byte_order")]
codes = {"Float32": "f4", "Float64": "f8", "Int32": "i4", "Int64": "i8", "UInt8": "u1"}

piece = root.find("UnstructuredGrid/Piece")
points, cells = int(piece.get("NumberOfPoints")), int(piece.get("NumberOfCells"))
arrays, last = {}, data
for array in root.iter("DataArray"):
    at = data + int(array.get("offset"))
    assert at == last, "a gap between the arrays"
    size = struct.unpack_from(order + "Q", content, at)[0]
    last = at + 8 + size
    arrays[array.get("Name")] = numpy.frombuffer(content, order + codes[array.get("type")], offset=at + 8,
                                                 count=size // int(codes[array.get("type")][1]))
assert content[last:end] == b"\n", "bytes behind the last array"
for array in piece.find("PointData"):
    assert len(arrays[array.get("Name")]) == points * int(array.get("NumberOfComponents", 1)), array.get("Name")
assert len(arrays["Points"]) == 3 * points
assert len(arrays["types"]) == len(arrays["offsets"]) == cells
assert arrays["offsets"][-1] == len(arrays["connectivity"]) and arrays["connectivity"].max() < points

texts = {text.get("Name"): bytes(map(int, text.text.split())).decode().split("\0")[:-1] for text in root.iter("Array")}
print("%s: %d points, %d cells, interface names: %s"
      % (root.get("type"), points, cells, " | ".join(texts.get("interface names", []))))
