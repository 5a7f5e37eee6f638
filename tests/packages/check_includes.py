#!/usr/bin/python3
"""Do includes between rooms go downwards only?

    check_includes.py --source .

A room may include headers of the rooms below it, directly or through others, and of no other.
"""

import argparse
import collections
import posixpath
import re
import sys
import unittest
from pathlib import Path

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--source", type=Path, required=True)
OPTIONS = parser.parse_args()

# Room: the rooms directly below it.
HOUSE = {
    "base": [],
    "part": ["base"],
    "fe": ["part"],
    "body": ["part"],
    "reduction": ["fe"],
    "forces": ["body"],
    "render": ["body"],
    "solver": ["body"],
    "fmi": ["base"],
    "model": ["reduction", "render", "solver", "forces", "fmi"],
    "fmu": ["model"],
    "cli": ["fmu"],
    "python": ["model"],
}
SOLVER = {"elimination": [], "equations": ["elimination"], "integration": ["equations"], "equilibrium": ["integration"]}
WITHOUT_SIMBODY = ["base", "part", "fe", "reduction"]
# (room, header of a room above that it includes): each is to be removed.
EXCEPTIONS = set()


def below(house, room):
    """The room and all rooms below it."""
    return {room}.union(*(below(house, under) for under in house[room]))


def read_includes():
    """Headers included by each of our files, by path from "simflex/" on; those of others in angle brackets."""
    texts = {}
    for top in ("plugin", "forces", "render"):
        root = OPTIONS.source / ("plugin" if top == "plugin" else ".")
        for file in sorted((OPTIONS.source / top).rglob("*")):
            if file.suffix in (".h", ".cpp"):
                texts[file.relative_to(root).as_posix()] = file.read_text(encoding="utf-8")
    # Public headers of the solver's rooms are included as simflex/solver/NAME.h.
    public = {re.sub(r"^solver/\w+/", "solver/", name): name for name in texts}

    def find(header, includer):
        for path in (header[len("simflex/"):], posixpath.join(posixpath.dirname(includer), header)):
            path = public.get(path, path)
            if path in texts:
                return path
        return f"<{header}>"

    pattern = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)', re.M)
    return {name: [find(header, name) for header in pattern.findall(text)] for name, text in texts.items()}


def find_room(name):
    return name.split("/")[0]


class Includes(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.includes = read_includes()

    def test_files_were_found(self):
        self.assertGreater(len(self.includes), 300)
        missing = {header for headers in self.includes.values() for header in headers if header.startswith("<simflex/")}
        self.assertEqual(missing, set())
        rooms = {find_room(name) for name in self.includes if "/" in name}
        self.assertEqual(rooms, set(HOUSE), "a room that is not in HOUSE, or is no more")

    def test_arrows_between_rooms_run_downwards(self):
        upward, needed = [], set()
        for name, headers in self.includes.items():
            room = find_room(name)
            if room not in HOUSE:  # Simflex.h, which includes them all
                continue
            for header in headers:
                if header.startswith("<") or find_room(header) in below(HOUSE, room):
                    continue
                if (room, header) in EXCEPTIONS:
                    needed.add((room, header))
                else:
                    upward.append(f"{name} includes {header}")
        self.assertEqual(upward, [])
        self.assertEqual(EXCEPTIONS - needed, set(), "paid debts: strike them out")

    def test_arrows_between_rooms_of_the_solver_run_downwards(self):
        upward = []
        for name, headers in self.includes.items():
            inside = re.match(r"solver/(\w+)/", name)
            for header in headers:
                other = re.match(r"solver/(\w+)/", header)
                if inside and other and other[1] not in below(SOLVER, inside[1]):
                    upward.append(f"{name} includes {header}")
        self.assertEqual(upward, [])

    def test_no_header_includes_itself_through_others(self):
        state = collections.defaultdict(int)  # 1: being visited, 2: done
        circles = []

        def visit(name, way):
            if state[name] == 1:
                circles.append(" -> ".join([*way[way.index(name):], name]))
            if state[name]:
                return
            state[name] = 1
            for header in self.includes.get(name, []):
                visit(header, [*way, name])
            state[name] = 2

        for name in self.includes:
            visit(name, [])
        self.assertEqual(circles, [])

    def test_states_are_copied_by_our_own_function(self):
        """Simbody's copies can show lazily computed values of the original: see body/StateCopy.h."""
        plain = [
            f"{file.name}: {copy}"
            for file in sorted((OPTIONS.source / "plugin").rglob("*.cpp"))
            for copy in re.findall(r"^ *(?:const )?(?:SimTK::)?State \w+ = [\w.>\[\]-]+;", file.read_text(encoding="utf-8"), re.M)
            if "WorkTeam" not in file.name
        ]
        self.assertEqual(plain, [])

    def test_parts_are_made_without_simbody(self):
        simbody = [
            f"{name} includes {header}"
            for name, headers in self.includes.items()
            if find_room(name) in WITHOUT_SIMBODY
            for header in headers
            if re.match(r"<(Simbody|SimTK|simbody/)", header)
        ]
        self.assertEqual(simbody, [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
