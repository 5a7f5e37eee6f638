#!/usr/bin/python3
"""Is everything this build uses available on a bare Debian?

A developer's machine has more packages than .ci/apt-packages.txt names, which hides omissions of the list. This
compares headers, libraries, programs and Python modules with the packages that apt installs for the list on a bare
machine. It follows the dependencies of the installed packages, so that it needs neither network nor apt's lists.

    check_packages.py --source . --build build/release               the tests
    check_packages.py --source . --build build/release --programs DIR   fills DIR with links to the programs of a bare machine
"""

import argparse
import collections
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

# Programs that simflex, its tests and its benchmarks start. (`.ci/run` hides all but a bare machine's from the tests.)
STARTED = ["bash", "ccx", "gmsh", "ffmpeg", "mpirun", "python3", "xvfb-run", "lintian", "dpkg-deb", "timeout", "gzip", "strace"]


def run(*command):
    return subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout


class Debian:
    """Dependencies and files of the installed packages."""

    def __init__(self):
        self.needs, self.providers, self.base = {}, collections.defaultdict(list), {"apt"}
        fields = "${Package}\t${db:Status-Status}\t${Essential}\t${Pre-Depends}, ${Depends}\t${Provides}\n"
        for line in run("dpkg-query", "-W", "-f", fields).splitlines():
            name, status, essential, needs, provides = line.split("\t")
            if status != "installed":
                continue
            # Names of "a (>= 1), b | c", without versions and architectures.
            self.needs[name] = [[re.split(r"[ (:]", choice.strip())[0] for choice in need.split("|")]
                                for need in needs.split(",") if need.strip()]
            for provided in provides.split(","):
                self.providers[re.split(r"[ (:]", provided.strip())[0]].append(name)
            if essential == "yes":
                self.base.add(name)
        self.owners = {}
        for file in Path("/var/lib/dpkg/info").glob("*.list"):
            for path in file.read_text(encoding="utf-8").splitlines():
                self.owners[path] = file.stem.split(":")[0]

    def closure(self, wanted):
        """Packages that apt installs for the names on a bare system, without recommendations."""
        closure, queue, choices = set(), [*self.base, *wanted], []
        while queue or choices:
            if not queue:   # of several providers: one already included, else the first
                providers = choices.pop()
                queue = [] if closure.intersection(providers) else [sorted(providers)[0]]
                continue
            name = queue.pop()
            if name in closure:
                continue
            closure.add(name)
            for need in self.needs.get(name, []):
                for choice in need:
                    if choice in self.needs:
                        queue.append(choice)
                        break
                    if self.providers[choice]:
                        choices.append(self.providers[choice])
                        break
        return closure

    def owner(self, path):
        """The package of a file, through symbolic links; None if it belongs to none."""
        for name in (os.path.realpath(path), str(path)):
            for place in (name, name.removeprefix("/usr"), "/usr" + name):   # Debian has merged / and /usr
                if place in self.owners:
                    return self.owners[place]
        return None


def read_list(source, build):
    """Names in .ci/apt-packages.txt, and in the preset's list if there is one."""
    lists = [source / ".ci/apt-packages.txt", source / f".ci/apt-packages-{build.name}.txt"]
    return [word for file in lists if file.exists() for line in file.read_text(encoding="utf-8").splitlines()
            for word in line.replace("#optional:", "").split("#")[0].split()]


def read_sources(source):
    """(name, text) of each of the project's own sources."""
    for line in run("find", str(source), "-name", ".git", "-prune", "-o", "-path", str(source / "build"), "-prune", "-o",
                    "-type", "f", "-print").splitlines():
        if re.search(r"\.(cpp|h|py|md|sh|cmake|txt|in)$|/run$", line):
            yield Path(line).relative_to(source), Path(line).read_text(encoding="utf-8")


def find_headers(build):
    headers = set()
    for file in build.rglob("*.d"):
        headers.update(re.findall(r"(?<!\S)/usr/\S+", file.read_text(encoding="utf-8")))
    return headers


def find_libraries(build):
    binaries = []
    for folder in ("bin", "lib"):
        for file in (build / folder).rglob("*"):
            if file.is_file() and not file.is_symlink():
                with open(file, "rb") as start:
                    if start.read(4) == b"\x7fELF":
                        binaries.append(str(file))
    libraries = set(re.findall(r" => (/\S+)", run("ldd", *binaries)))
    return {path for path in libraries if not path.startswith(f"{build}/")}


class BareMachine(unittest.TestCase):
    def expect_installed(self, paths, closure=None):
        self.assertTrue(paths, "nothing was found to check: build first, with makefiles")
        missing = collections.defaultdict(list)
        for path in sorted(paths):
            owner = DEBIAN.owner(path)
            if owner not in (closure or CLOSURE):
                missing[owner or "no package"].append(path)
        if missing:
            self.fail("not installed by .ci/apt-packages.txt:\n" + "\n".join(
                f"  {package}: {paths[0]}" + (f" and {len(paths) - 1} more" if len(paths) > 1 else "")
                for package, paths in missing.items()))

    def test_the_list_is_installed(self):
        self.assertEqual([name for name in WANTED if name not in DEBIAN.needs], [])

    def test_headers(self):
        self.expect_installed(find_headers(OPTIONS.build))

    def test_libraries(self):
        self.expect_installed(find_libraries(OPTIONS.build))

    def test_libraries_opened_by_name(self):
        known = dict(re.findall(r"^\t(\S+) .* => (\S+)$", run("/sbin/ldconfig", "-p"), re.M))
        names = {name for file, text in read_sources(OPTIONS.source) if file.suffix == ".cpp" and file.parts[0] != "tests"
                 for name in re.findall(r'"(lib\w+\.so[.\d]*)"', text)}
        self.expect_installed({known[name] for name in names if name in known})

    def test_programs(self):
        found = {name: shutil.which(name, path="/usr/sbin:/usr/bin") for name in STARTED}
        if not found["ccx"]:
            del found["ccx"]  # optional
        self.assertEqual([name for name, path in found.items() if not path], [], "not there")
        self.expect_installed(found.values())

    def test_files_named_in_sources(self):
        self.expect_installed({path for file, text in read_sources(OPTIONS.source) if file.parts[:2] != ("tests", "packages")
                               for path in re.findall(r"(?<![\w/}])/usr/[\w./-]*\w", text) if os.path.isfile(path)})

    def test_python_modules(self):
        names = set()
        for file, text in read_sources(OPTIONS.source):
            if file.suffix in (".py", ".cpp", ".md"):
                for line in re.findall(r"^ *import ([\w., ]+)$", text, re.M):
                    names.update(re.split(r"\W", name.strip())[0] for name in line.split(","))
                names.update(re.findall(r"^ *from (\w+)[\w.]* import ", text, re.M))
        own = {"simflex"}
        for file, _ in read_sources(OPTIONS.source):
            if file.suffix == ".py":
                own |= {file.stem, file.parent.name}  # a module and its package
        modules = {name: importlib.util.find_spec(name) for name in names - own}
        self.assertEqual([name for name, module in modules.items() if not module], [], "not there")
        self.expect_installed({module.origin for module in modules.values() if module.origin not in ("built-in", "frozen", None)})

    def test_a_package_that_is_left_out_is_named(self):
        closure = DEBIAN.closure([name for name in WANTED if name != "libeigen3-dev"])
        with self.assertRaisesRegex(AssertionError, "\n  libeigen3-dev: /usr/include/eigen3/"):
            self.expect_installed(find_headers(OPTIONS.build), closure)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--source", type=Path, required=True)
parser.add_argument("--build", type=Path, required=True)
parser.add_argument("--programs", type=Path, metavar="DIR")
OPTIONS = parser.parse_args()
if not shutil.which("dpkg-query"):
    sys.exit("check_packages.py: not a Debian system, there is nothing to hold against the list")
DEBIAN = Debian()
WANTED = read_list(OPTIONS.source, OPTIONS.build)
CLOSURE = DEBIAN.closure(WANTED)
if OPTIONS.programs:
    shutil.rmtree(OPTIONS.programs, ignore_errors=True)
    OPTIONS.programs.mkdir(parents=True)
    for folder in ("/usr/sbin", "/usr/bin"):
        for program in Path(folder).iterdir():
            if DEBIAN.owner(program) in CLOSURE and not (OPTIONS.programs / program.name).exists():
                (OPTIONS.programs / program.name).symlink_to(program)
else:
    unittest.main(argv=sys.argv[:1])
