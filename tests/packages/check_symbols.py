#!/usr/bin/python3
"""Are our names unique in a process that loads all our libraries?

    check_symbols.py --source . --build build/release

If two libraries define the same function, the loader uses one of them for both. If two classes have the same name,
their inline functions, vtables and type names are merged, whatever they contain.
"""

import argparse
import collections
import re
import subprocess
import sys
import unittest
from pathlib import Path

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--source", type=Path, required=True)
parser.add_argument("--build", type=Path, required=True)
OPTIONS = parser.parse_args()


def read_classes(text):
    """Qualified names of classes defined at namespace scope, without unnamed namespaces and specializations."""
    namespaces = []
    pattern = r"^namespace ([\w:]*) ?\{|^(\}  // namespace.*)|^(?:class|struct|enum class|enum) (\w+)\b(?!<|::)[^;{()]*\{"
    for match in re.finditer(pattern, text, re.M):
        opened, closed, name = match.groups()
        if opened is not None:
            namespaces.append(opened)
        elif closed:
            namespaces.pop()
        elif "" not in namespaces:
            yield "::".join([*namespaces, name])


def find_libraries():
    return [file for file in (OPTIONS.build / "lib").glob("libsimflex*.so.*") if not file.is_symlink()]


class Names(unittest.TestCase):
    maxDiff = None

    def test_no_class_is_defined_twice(self):
        places = collections.defaultdict(list)
        for room in ("plugin", "forces", "render"):
            for file in sorted((OPTIONS.source / room).rglob("*")):
                if file.suffix in (".h", ".cpp"):
                    for name in read_classes(file.read_text(encoding="utf-8")):
                        places[name].append(str(file.relative_to(OPTIONS.source)))
        self.assertGreater(len(places), 100)
        self.assertEqual({name: files for name, files in places.items() if len(files) > 1}, {})

    def test_libraries_show_their_own_only(self):
        for library in find_libraries():
            names = subprocess.run(["nm", "-D", "--defined-only", library], check=True, stdout=subprocess.PIPE, text=True)
            names = [line.split()[-1] for line in names.stdout.splitlines()]
            self.assertGreater(len(names), 100, library)
            self.assertEqual([name for name in names if "7simflex" not in name], [], library)

    def test_no_symbol_is_defined_twice(self):
        libraries = find_libraries()
        self.assertGreaterEqual(len(libraries), 4)
        libraries += (OPTIONS.build / "plugin").rglob("libsimflex_*.a")
        places = collections.defaultdict(list)
        for library in sorted(libraries):
            dynamic = [] if library.suffix == ".a" else ["-D"]
            for line in subprocess.run(["nm", *dynamic, "--defined-only", library], check=True, stdout=subprocess.PIPE,
                                       text=True).stdout.splitlines():
                words = line.split()
                if len(words) == 3 and words[1] in "TDBR" and "7simflex" in words[2]:   # strong, of our namespace
                    places[words[2]].append(library.name)
        self.assertGreater(len(places), 1000)
        self.assertEqual({name: files for name, files in places.items() if len(files) > 1}, {})


unittest.main(argv=sys.argv[:1])
