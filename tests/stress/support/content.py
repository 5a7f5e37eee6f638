"""Content of files, except for what depends on the clock and the folder."""

from pathlib import Path

import h5py
import numpy as np


def read_content(file: Path):
    """The bytes of a file; of an HDF5 file, all content except the time taken and the path of the model."""
    if file.suffix != ".h5":
        return file.read_bytes()
    content = {}
    with h5py.File(file) as open_file:

        def visit(name, item):
            for key, value in item.attrs.items():
                if not key.endswith("seconds") and (name, key) != ("model", "path"):
                    content[f"{name}@{key}"] = np.asarray(value).tobytes()
            if isinstance(item, h5py.Dataset) and not name.endswith("seconds"):
                content[name] = repr(item[()]) if h5py.check_string_dtype(item.dtype) else item[()].tobytes()

        visit("", open_file)
        open_file.visititems(visit)
    return content
