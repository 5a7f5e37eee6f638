#!/usr/bin/env python3
"""Mutation score of the tests: puts errors into the product one at a time, and runs the tests that could notice them.

Checkout and build stay unchanged. A mutated copy of one source is compiled with the build's command, and its library
(or, for a static one, each test program) is linked anew, all in a folder of this run. A mutant with the object code of
the original does not count. Mutants are drawn from a seed, one of each room in turn: the K-th is the same however many
are wanted. A journal keeps the verdicts, so that a stopped run continues, and --report prints the score so far, by room
and by kind, without lines that have changed since.

Test programs first run without a mutant, which measures the cost of each suite; tests that fail then are left out. For
a mutant, suites that noticed others in the same file run first, then cheap ones. The first failure, crash or exceeded
time limit (of the processor, so that a busy machine makes little difference) ends it. A test that also fails without
the mutant has noticed nothing and is left out from then on.
"""

import argparse
import collections
import concurrent.futures
import dataclasses
import json
import os
import random
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

# Room: folders of its sources, and test programs, the closest first.
ROOMS = {
    "solver": (["plugin/solver"], ["test_solver", "test_validation"]),
    "body": (["plugin/body"], ["test_body", "test_forces", "test_solver", "test_validation"]),
    "reduction": (["plugin/reduction"], ["test_reduction", "test_fe", "test_validation"]),
    "forces": (["forces"], ["test_forces", "test_solver", "test_validation"]),
    "fe": (["plugin/fe"], ["test_fe", "test_reduction"]),
    "model": (["plugin/model"],
              ["test_formula", "test_model_file", "test_model", "test_shell", "test_run"]),
    "render": (["render"], ["test_render"]),
}
STRING = "\x01"  # replaces each character of strings and messages before the search
CHUNK = 5.0  # [s] cheap suites share a process up to this total cost
MOST_MEMORY = 8 << 30
# Estimates of work and its shares among threads affect the speed, not the results.
SPEED = re.compile(r"\b(?:processors|m_work|kWorth\w+|kRowsPerShare)\b")
TOLERANCE = 1e-5  # smaller numbers are tolerances
NUMBER = re.compile(r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")


@dataclasses.dataclass
class Mutant:
    file: str
    kind: str
    start: int
    end: int
    text: str


def mask(source):
    """The source at the same length. Comments and preprocessor lines become blanks; strings, throws, assertions and
    reservations of memory, which affect no result, become STRING."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group())

    def fill(match):
        return re.sub(r"[^\n]", STRING, match.group())

    pattern = r'(?P<raw>R"(?P<tag>\w*)\(.*?\)(?P=tag)")|(?P<string>"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)+\')|' \
              r"(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<line>^[ \t]*#(?:[^\n\\]|\\.|\\\n)*)"
    text = re.sub(r"(?<=\d)'(?=\d)", "0", source)  # digits in groups
    text = re.sub(pattern, lambda match: blank(match) if match.group("comment") or match.group("line") else fill(match),
                  text, flags=re.S | re.M)
    return re.sub(r"\b(?:throw|static_assert|assert)\b[^;]*;|\b(?:reserve|shrink_to_fit)\([^;]*;", fill, text)


def find_term_end(text, start):
    depth = 0
    for match in re.finditer(r"[(\[{]|[)\]}]|[;,?:]| (?:[-+<>]|[<>=!]=|&&|\|\||<<|>>)(?= |\n)", text[start:]):
        token = match.group()
        if token in "([{":
            depth += 1
        elif token in ")]}":
            if depth == 0:
                return start + match.start()
            depth -= 1
        elif depth == 0:
            return start + match.start()
    return len(text)


def find_mutants(file, source):
    text = mask(source)
    mutants = []

    def add(kind, start, end, replacement):
        # Statements with strings compose messages.
        begin = max(text.rfind(mark, 0, start) for mark in ";{}") + 1
        statement = text[begin:text.find(";", end)]
        if STRING not in statement and not SPEED.search(statement):
            mutants.append(Mutant(file, kind, start, end, replacement))

    def swap(kind, pattern, replacements):
        for match in re.finditer(pattern, text):
            for replacement in replacements[match.group(1)]:
                add(kind, match.start(1), match.end(1), replacement)

    swap("sign", r" ([-+]) ", {"+": "-", "-": "+"})
    swap("sign", r" ([-+]=) ", {"+=": ["-="], "-=": ["+="]})
    swap("sign", r"(?:[(\[]|, |= |return |\? |: )(-)(?=[\w(])", {"-": [""]})
    swap("factor", r" ([*/]) ", {"*": "/", "/": "*"})
    swap("comparison", r" (<|>|<=|>=|==|!=) ",
         {"<": [">="], ">": ["<="], "<=": [">"], ">=": ["<"], "==": ["!="], "!=": ["=="]})
    swap("off by one", r" (<|>|<=|>=) ", {"<": ["<="], ">": [">="], "<=": ["<"], ">=": [">"]})
    swap("logic", r" (&&|\|\|) ", {"&&": ["||"], "||": ["&&"]})
    swap("logic", r"[( ](!)[\w(]", {"!": [""]})
    for match in NUMBER.finditer(text):
        number = match.group()
        if re.fullmatch(r"\d+", number):
            add("off by one" if number in "01" else "constant", match.start(), match.end(),
                str(int(number) + 1 if int(number) < 10 else 2 * int(number)))
        else:  # twice a tolerance would still be valid
            factor = "1e6" if float(number) <= TOLERANCE else "2"
            add("constant", match.start(), match.end(), "1.0" if float(number) == 0 else f"({factor} * {number})")
    for match in re.finditer(r" [-+] (?=[^=])", text):
        end = find_term_end(text, match.end())
        if text[match.end():end].strip():
            add("dropped term", match.start(), end, "")
    for match in re.finditer(r"^[ \t]+((?!return\b|delete\b|using\b)[A-Za-z_][\w.:>\[\]-]*\([^;{}\n]*\));$", text, re.M):
        if match.group(1).count("(") == match.group(1).count(")"):
            mutants.append(Mutant(file, "removed call", match.start(1), match.end(1), ""))
    return mutants


class Build:
    """Compile and link commands of the build, and the library of each source."""

    def __init__(self, source, build):
        self.source, self.build = source, build
        commands = json.loads((build / "compile_commands.json").read_text())
        self.commands = {}
        for entry in commands:  # the first of a file is the library's
            self.commands.setdefault(entry["file"], entry)
        self.links = {}  # target: folder and words of its link
        for path in build.rglob("CMakeFiles/*.dir/link.txt"):
            self.links[path.parent.stem] = (path.parent.parent.parent, shlex.split(path.read_text().splitlines()[0]))

    def compile(self, file, source, target):
        """Compiles the text `source` as if it were `file`. @returns whether it compiles."""
        entry = self.commands[str(self.source / file)]
        words = shlex.split(entry["command"])
        at = words.index("-o")
        del words[at:at + 2]
        words.remove(entry["file"])
        words = [word for word in words if word != "-Werror"]
        original = (self.source / file).parent
        mutated = target.parent / Path(file).name
        mutated.write_text(source)
        launcher = [word for word in os.environ.get("CMAKE_CXX_COMPILER_LAUNCHER", "").split(";") if word]
        command = [*launcher, *words, "-w", "-iquote", str(original), f"-fmacro-prefix-map={mutated.parent}={original}",
                   "-o", str(target), str(mutated)]
        status = subprocess.run(command, cwd=entry["directory"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                check=False).returncode
        if status < 0:
            raise KeyboardInterrupt
        return status == 0

    def get_object(self, file):
        entry = self.commands[str(self.source / file)]
        words = shlex.split(entry["command"])
        return Path(entry["directory"]) / words[words.index("-o") + 1]

    def find_library(self, file):
        """@returns the name of the library that holds `file`; None if it is in none."""
        original = self.get_object(file)
        for name, (directory, words) in self.links.items():
            if ("-shared" in words or "qc" in words) and os.path.relpath(original, directory) in words:
                return name
        return None

    def link(self, file, object_file, folder, programs):
        """Links the library of `file`, or the programs with it, into folder/lib and folder/bin. @returns the programs
        that use it."""
        name = self.find_library(file)
        directory, words = self.links[name][0], list(self.links[name][1])
        programs = [program for program in programs if (self.build / "bin" / program).exists()]
        if "-shared" in words:
            words[words.index(os.path.relpath(self.get_object(file), directory))] = str(object_file)
            soname = next(word for word in words if "-soname," in word).rpartition(",")[2]
            words[words.index("-o") + 1] = str(folder / "lib" / soname)
            subprocess.run(words, cwd=directory, check=True)
            return programs
        users = [program for program in programs if any(word.endswith(f"/lib{name}.a") for word in self.links[program][1])]
        for program in users:  # the object precedes the static library and replaces its member
            directory, words = self.links[program][0], list(self.links[program][1])
            at = words.index("-o")
            words[at:at + 2] = [str(object_file), "-o", str(folder / "bin" / program)]
            subprocess.run(words, cwd=directory, check=True)
        return users


class Tests:
    """The test programs: cost of their suites, and tests that fail without a mutant."""

    def __init__(self, build, work):
        self.build, self.work = build, work
        self.baselines = {}
        self.lock = threading.Lock()
        self.running, self.stopped = set(), False

    def get_baseline(self, program):
        with self.lock:
            if program not in self.baselines:
                self.baselines[program] = self.find_baseline(program)
            return self.baselines[program]

    def find_baseline(self, program):
        path = self.work / f"baseline-{program}.json"
        binary = self.build / "bin" / program
        stamp = binary.stat().st_mtime
        if not path.exists() or json.loads(path.read_text())["stamp"] != stamp:
            print(f"running {program} as it is", flush=True)
            result = self.work / "result.json"
            environment = dict(os.environ, OMP_WAIT_POLICY="passive", GTEST_BRIEF="1", GTEST_OUTPUT=f"json:{result}")
            subprocess.run([binary], cwd=self.work, env=environment, check=False, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
            suites, failed = {}, []
            for suite in json.loads(result.read_text())["testsuites"]:
                suites[suite["name"]] = float(suite["time"].rstrip("s"))
                failed += [f"{suite['name']}.{test['name']}" for test in suite["testsuite"] if "failures" in test]
            path.write_text(json.dumps({"stamp": stamp, "suites": suites, "failed": failed}))
        baseline = json.loads(path.read_text())
        for test in baseline["failed"]:
            print(f"{program}: {test} fails without any mutant and is left out", flush=True)
        return baseline

    def stop(self):
        self.stopped = True
        for process in list(self.running):
            process.kill()

    def leave_out(self, program, test):
        print(f"{program}: {test} fails now and then without any mutant and is left out", flush=True)
        with self.lock:
            baseline = self.baselines[program]
            if test not in baseline["failed"]:
                baseline["failed"].append(test)
            (self.work / f"baseline-{program}.json").write_text(json.dumps(baseline))

    def run(self, program, suites, folder):
        """@returns the first failing test, "crash" or "time"; "" if all tests pass."""
        while True:
            baseline = self.get_baseline(program)
            names = ":".join(f"{suite}.*" for suite in suites)
            if baseline["failed"]:
                names += "-" + ":".join(baseline["failed"])
            seconds = 20 + 5 * sum(baseline["suites"][suite] for suite in suites)
            noticed = self.run_program(program, names, seconds, folder, folder)
            if self.stopped or "." not in noticed or not self.run_program(program, noticed, seconds, folder, self.build):
                return noticed
            self.leave_out(program, noticed)

    def run_program(self, program, names, seconds, folder, linked):
        """Runs tests `names` with the libraries and programs in the folder `linked`. @returns as run()."""
        binary = linked / "bin" / program
        if not binary.exists():
            binary = self.build / "bin" / program
        temporary = folder / "tmp"
        temporary.mkdir()
        environment = dict(os.environ, LD_LIBRARY_PATH=str(linked / "lib"), TMPDIR=str(temporary), OMP_WAIT_POLICY="passive",
                           GTEST_FAIL_FAST="1", GTEST_BRIEF="1", GTEST_FILTER=names)
        limits = ["prlimit", f"--cpu={int(2 * seconds)}:{int(2 * seconds) + 5}", f"--as={MOST_MEMORY}", "--core=0"]
        with open(folder / "output.txt", "wb") as output:
            process = subprocess.Popen([*limits, binary], cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=output,
                                       stderr=subprocess.STDOUT, start_new_session=True)
            self.running.add(process)
            try:
                status = process.wait(0 if self.stopped else 10 * seconds)
            except subprocess.TimeoutExpired:
                status = -signal.SIGXCPU
            finally:
                try:
                    os.killpg(process.pid, signal.SIGKILL)
                except ProcessLookupError:
                    pass
                process.wait()
                self.running.discard(process)
        shutil.rmtree(temporary, ignore_errors=True)
        if status == 0:
            return ""
        failed = re.search(r"^\[  FAILED  \] ([\w/.]+)", (folder / "output.txt").read_text(errors="replace"), re.M)
        return failed.group(1) if failed else "time" if status in (-signal.SIGXCPU, -signal.SIGKILL) else "crash"


class Campaign:
    def __init__(self, arguments):
        self.source, self.build_folder, self.seed = arguments.source, arguments.build, arguments.seed
        self.jobs, self.longest = arguments.jobs, arguments.longest
        self.rooms = arguments.room or list(ROOMS)
        self.build = Build(arguments.source, arguments.build)
        self.work = arguments.work
        self.work.mkdir(parents=True, exist_ok=True)
        self.tests = Tests(arguments.build, self.work)
        self.journal = self.work / "journal.jsonl"
        self.known, self.mutants = {}, {}
        self.kills = collections.defaultdict(collections.Counter)  # file: numbers of mutants noticed by its suites
        self.lock = threading.Lock()
        self.stopped = False
        if self.journal.exists():
            for line in self.journal.read_text().splitlines():
                self.remember(json.loads(line))

    def remember(self, record):
        self.known[record["id"]] = record
        if "." in record.get("by", ""):
            self.kills[record["file"]][record["by"].rpartition(".")[0]] += 1

    def get_mutants(self, room):
        if room not in self.mutants:
            files = [str(path.relative_to(self.source)) for folder in ROOMS[room][0]
                     for path in sorted((self.source / folder).rglob("*.cpp")) if str(path) in self.build.commands]
            self.mutants[room] = [mutant for file in files if self.build.find_library(file)
                                  for mutant in find_mutants(file, (self.source / file).read_text())]
        return self.mutants[room]

    def draw(self, number):
        """The number-th mutant of the seed. The sequence of a room does not depend on which others are tried."""
        turn, room = number // len(self.rooms), self.rooms[number % len(self.rooms)]
        choose = random.Random(f"{self.seed}/{room}/{turn}")
        kind = choose.choice(sorted({mutant.kind for mutant in self.get_mutants(room)}))
        return room, choose.choice([mutant for mutant in self.get_mutants(room) if mutant.kind == kind])

    def describe(self, room, mutant):
        """The journal's record of a mutant. Its line is identified by its text, so that it may move."""
        source = (self.source / mutant.file).read_text()
        begin, end = source.rfind("\n", 0, mutant.start) + 1, source.find("\n", mutant.end)
        before = source[begin:end]
        after = source[begin:mutant.start] + mutant.text + source[mutant.end:end]
        same = source.count(f"\n{before}\n", 0, begin)
        return {"id": f"{mutant.file}:{same}:{mutant.start - begin}:{mutant.end - mutant.start}:{mutant.text}:{before}",
                "room": room, "file": mutant.file, "line": source.count("\n", 0, mutant.start) + 1, "kind": mutant.kind,
                "before": before.strip(), "after": after.strip()}

    def check(self, room, mutant, folder):
        """@returns the verdict, and the test that noticed."""
        source = (self.source / mutant.file).read_text()
        shutil.rmtree(folder, ignore_errors=True)
        for part in ("source", "lib", "bin"):
            (folder / part).mkdir(parents=True)
        object_file = folder / "source" / "mutant.o"
        if not self.build.compile(mutant.file, source[:mutant.start] + mutant.text + source[mutant.end:], object_file):
            return "does not compile", ""
        if object_file.read_bytes() == self.build.get_object(mutant.file).read_bytes():
            return "equivalent", ""
        for program in self.build.link(mutant.file, object_file, folder, ROOMS[room][1]):
            for suites in self.order_suites(program, mutant.file):
                noticed = self.tests.run(program, suites, folder)
                if noticed:
                    return "killed", noticed
        return "survived", ""

    def order_suites(self, program, file):
        costs = self.tests.get_baseline(program)["suites"]
        stem = re.sub("(?:Setup|Impl)$", "", Path(file).stem).lower()
        near = {suite for suite in costs
                if self.kills[file][suite] or stem in suite.lower() or suite.lower().replace("test", "") in stem}
        chunk, cost = [], 0.0
        cheap = [name for name in costs if costs[name] <= self.longest]
        for suite in sorted(cheap, key=lambda name: (name not in near, -self.kills[file][name], costs[name])):
            if chunk and cost + costs[suite] > CHUNK:
                yield chunk
                chunk, cost = [], 0.0
            chunk.append(suite)
            cost += costs[suite]
        if chunk:
            yield chunk

    def run(self, count, again):
        """Tries the first `count` mutants of the seed; with `again`, all that have survived so far."""
        absent = sorted({program for room in self.rooms for program in ROOMS[room][1]
                         if not (self.build_folder / "bin" / program).exists()})
        if absent:
            print(f"not built, so that their tests notice nothing: {', '.join(absent)}", flush=True)
        if again:
            drawn = [(room, mutant) for room in self.rooms for mutant in self.get_mutants(room)]
        else:
            drawn = [self.draw(number) for number in range(count)]
        todo, wanted = [], set()
        for room, mutant in drawn:
            record = self.describe(room, mutant)
            verdict = self.known.get(record["id"], {"verdict": ""})["verdict"]
            if record["id"] not in wanted and verdict == ("survived" if again else ""):
                wanted.add(record["id"])
                todo.append((mutant, record))
        for program in dict.fromkeys(program for room in self.rooms for program in ROOMS[room][1] if program not in absent):
            self.tests.get_baseline(program)
        libraries = {path: path.stat().st_mtime for path in (self.build_folder / "lib").glob("*.so.?")}
        folders = [self.work / f"mutant{job}" for job in range(self.jobs)]

        def work(folder):
            while not self.stopped:
                with self.lock:
                    if not todo:
                        return
                    mutant, record = todo.pop(0)
                if any(path.stat().st_mtime != stamp for path, stamp in libraries.items()):
                    raise SystemExit("the build has changed: start anew")
                started = time.monotonic()
                record["verdict"], record["by"] = self.check(record["room"], mutant, folder)
                if self.stopped:
                    return
                record["seconds"] = round(time.monotonic() - started, 1)
                with self.lock:
                    self.remember(record)
                    with open(self.journal, "a", encoding="utf-8") as journal:
                        journal.write(json.dumps(record) + "\n")
                    print(f"{len(todo)} left; {record['file']}:{record['line']} {record['kind']}: {record['verdict']} "
                          f"{record['by']} ({record['seconds']:.0f} s)", flush=True)

        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            workers = [pool.submit(work, folder) for folder in folders]
            try:
                for worker in workers:
                    worker.result()
            finally:
                self.stopped = True
                self.tests.stop()

    def is_there(self, record):
        path, before = self.source / record["file"], record["before"]
        source = path.read_text() if path.exists() else ""
        same = int(record["id"][len(record["file"]) + 1:].partition(":")[0])  # number of equal lines before it
        return sum(line.strip() == before for line in source.splitlines()) > same or "\n" in before and before in source

    def report(self):
        counts = collections.defaultdict(collections.Counter)
        records = [record for record in self.known.values() if self.is_there(record)]
        for record in records:
            for group in (record["room"], record["kind"], "all"):
                counts[group][record["verdict"]] += 1
        for record in sorted(records, key=lambda record: (record["file"], record["line"])):
            if record["verdict"] == "survived":
                print(f"{record['file']}:{record['line']} {record['kind']}\n    - {record['before']}\n    + {record['after']}")
        print("                 killed  survived  score  (equivalent, do not compile)")
        for group in [*ROOMS, *sorted(set(counts) - set(ROOMS) - {"all"}), "all"]:
            count = counts[group]
            tested = count["killed"] + count["survived"]
            if tested:
                print(f"{group:16} {count['killed']:6} {count['survived']:9}  {count['killed'] / tested:5.0%}  "
                      f"({count['equivalent']}, {count['does not compile']})")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = Path(__file__).resolve().parents[2]
    parser.add_argument("count", nargs="?", type=int, default=200, help="mutants to draw (200)")
    parser.add_argument("seed", nargs="?", default="1")
    parser.add_argument("--source", type=Path, default=root)
    parser.add_argument("--build", type=Path, default=root / "build/mutation",
                        help="a build of the test programs, a source at a time; nobody builds there meanwhile")
    parser.add_argument("--work", type=Path, default=root / "build/mutation/mutants",
                        help="folder of the journal and all that is made")
    parser.add_argument("--jobs", type=int, default=max(1, os.cpu_count() // 2), help="mutants at a time (half the processors)")
    parser.add_argument("--longest", type=float, default=float("inf"), metavar="SECONDS",
                        help="suites that take longer are left out: what survives may not survive --again without this")
    parser.add_argument("--again", action="store_true", help="those that survived until now, once tests have been added")
    parser.add_argument("--room", action="append", choices=ROOMS, help="only these")
    parser.add_argument("--report", action="store_true", help="what the journal tells")
    parser.add_argument("--programs", action="store_true", help="the test programs that have to be built")
    arguments = parser.parse_args()
    if arguments.programs:
        print(*sorted({program for room in ROOMS.values() for program in room[1]}), sep="\n")
        return 0
    campaign = Campaign(arguments)
    for stop in (signal.SIGINT, signal.SIGTERM):  # even if a background shell ignores them
        signal.signal(stop, signal.default_int_handler)
    try:
        if not arguments.report:
            campaign.run(arguments.count, arguments.again)
    except KeyboardInterrupt:
        pass
    campaign.report()
    return 0


if __name__ == "__main__":
    sys.exit(main())
