#!/usr/bin/python3
"""Writes the types of the module simflex, as it is built, for editors and type checkers.

    PYTHONPATH=build/release/python plugin/python/write_types.py > plugin/python/__init__.pyi
"""

import inspect
import re

import simflex

HEAD = '''"""Types of the module simflex: written by write_types.py."""

from os import PathLike
from typing import Any, Dict, Iterator, List, Optional, Tuple, Union, overload

import numpy
from numpy.typing import NDArray

__version__: str
'''
TYPES = [(r"numpy\.ndarray\[numpy\.(\w+)\]", r"NDArray[numpy.\1]"), (r"\bnumpy\.ndarray\b", "NDArray[Any]"),
         (r"\bsimflex\.", ""), (r"\bos\.PathLike\b", "Union[PathLike[str], str]"),
         (r"\bobject\b|\bhandle\b", "Any"),
         (r"\bdict\b", "Dict[str, Any]"), (r"\blist\b", "List[Any]"), (r"\btuple\b", "Tuple[Any, ...]"),
         (r"\bIterator\b", "Iterator[str]"), (r"= PosixPath\((.*?)\)", r"= \1"), (r"<simflex\.\w+.*?>", "...")]
SIGNATURE = re.compile(r"^(?:\d+\. )?(\w*)\((.*)\) -> (.+)$")


def translate(text):
    # Parameters may be called like types.
    for old, new in TYPES:
        text = re.sub(rf"(?:{old})(?!\w*:)", new, text)
    return text


def read_signatures(doc):
    """(arguments, result, what is said) of each overload."""
    found = []
    for line in (doc or "").splitlines():
        match = SIGNATURE.match(line)
        if match and match[2] != "*args, **kwargs":
            found.append([match[2], match[3], []])
        elif found and line != "Overloaded function.":
            found[-1][2].append(line)
    return [(translate(re.sub(r"^(self|arg0): [\w.]+", "self", arguments)), translate(result), "\n".join(lines).strip())
            for arguments, result, lines in found]


def write_doc(text, indent):
    if not text:
        return f"{indent}...\n"
    escaped = text.replace("\\", "\\\\").replace('"""', r"\"\"\"")
    lines = [indent + line if line else "" for line in f'"""{escaped}"""'.splitlines()]
    return "\n".join(lines) + "\n"


def write_function(name, doc, indent, decorators=()):
    signatures = read_signatures(doc)
    assert signatures, f"{name}: no signature in its docstring"
    text = ""
    for arguments, result, said in signatures:
        for decorator in [*decorators, *(["overload"] if len(signatures) > 1 else [])]:
            text += f"{indent}@{decorator}\n"
        text += f"{indent}def {name}({arguments}) -> {result}:\n" + write_doc(said, indent + "    ")
    return text


def write_class(name, kind):
    base = kind.__bases__[0].__name__
    text = f"\n\nclass {name}{'' if base == 'pybind11_object' else f'({base})'}:\n" + write_doc(inspect.cleandoc(kind.__doc__ or ""), "    ")
    if base != "pybind11_object":
        return text
    for member, value in kind.__dict__.items():
        if isinstance(value, property):
            text += "\n" + write_function(member, "x" + (value.fget.__doc__.splitlines()[0]) + "\n" + (value.__doc__ or ""), "    ", ["property"])
        elif isinstance(value, staticmethod):
            text += "\n" + write_function(member, value.__func__.__doc__, "    ", ["staticmethod"])
        elif member not in ("__doc__", "__module__", "__setstate__", "__getstate__") and "->" in (getattr(value, "__doc__", None) or ""):
            text += "\n" + write_function(member, value.__doc__, "    ")
    return text


def write_types():
    text = HEAD
    members = {name: value for name, value in vars(simflex).items() if not name.startswith("_")}
    for name, value in members.items():
        if inspect.isclass(value):
            text += write_class(name, value)
    for name, value in members.items():
        if inspect.isroutine(value):
            text += "\n\n" + write_function(name, value.__doc__, "")
    return text


if __name__ == "__main__":
    print(write_types(), end="")
