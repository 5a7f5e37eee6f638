#!/usr/bin/env python3
"""Programs that are killed at a system call and started again.

A case is a command (run, reduce, sweep, post, fmu) that strace kills with SIGKILL at the n-th system call of some kind
(on files, processes, threads) in one of its threads. A case has one to three such kills in succession. Then this must
hold:

    again       the same command, for a run with --resume, succeeds
    bits        its files have the same bits as those of a command that was not killed
    rest        no other files are left, and none in the temporary folder
    kept        results of an earlier state of the model are kept until those that replace them are complete
    hang        neither command takes more than a minute of processor time, or stands still for a minute
"""

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import h5py

from support import commands, harness, parts
from support.content import read_content

SKIPPED = 77  # exit status, for ctest
FILES = ["openat", "write", "pwrite64", "read", "close", "rename", "unlink", "unlinkat", "mkdir", "rmdir", "fsync", "ftruncate",
         "lseek", "fcntl", "flock", "newfstatat", "access", "fchmod", "getdents64", "mmap", "munmap", "clone3", "vfork", "execve",
         "wait4", "pipe2", "dup2", "chdir", "futex", "exit_group"]

MODEL = """simflex: 1
parameters: {load: 1}
gravity: [0, -9.81, 0]
parts:
  bar: {deck: bar.inp, modes: 14, interfaces: {near: {nodes: NEAR}, far: {nodes: FAR}}}
bodies:
  bar: {part: bar, damping: 0.01}
  weight: {mass: load, shape: {sphere: 0.01}, place: {at: bar.far}}
joints:
  hinge: {type: pin, between: [ground, bar.near]}
  glue: {type: weld, between: [bar.far, weight]}
connectors:
  spring: {type: torsion_spring, between: [ground, bar.near], stiffness: 100, damping: 0.1}
inputs: {torque: {start: 0, unit: N m}}
probes:
  tip: {position: bar.far}
  spin: {rate: hinge}
analyses:
  rest: {type: static}
  swing: {type: transient, duration: 0.02, interval: 0.001}
output: {csv: true}
"""

# Arguments, those to add after a kill, and the files that it leaves.
COMMANDS = {
    "run": (["run", "model.yaml", "-q", "--no-pictures", "-o", "r.h5"], ["--resume"], ["r.h5", "r.rest.csv", "r.swing.csv"]),
    "reduce": (["reduce", "bar.inp", "-i", "near=NEAR", "-i", "far=FAR", "-m", "14", "-q", "-o", "p.h5"], [], ["p.h5"]),
    "sweep": (["sweep", "model.yaml", "--vary", "load=1,2", "-q", "--jobs", "1", "-o", "s"], [],
              ["s/load=1/results.h5", "s/load=2/results.h5", "s/sweep.csv", "s/sweep.h5"]),
    "post": (["post", "earlier.h5", "--set", "probes.more={expression: 2*spin}", "--no-pictures", "-q", "-o", "post.h5"], [],
             ["post.h5", "post.rest.csv", "post.swing.csv"]),
    "fmu": (["fmu", "model.yaml", "--thin", "-q", "-o", "m.fmu"], [], ["m.fmu"]),
    # The model differs from that of earlier.h5, so all analyses run anew.
    "redo": (["run", "model.yaml", "-q", "--no-pictures", "--set", "parameters.load=2", "--resume", "-o", "earlier.h5"], [],
             ["earlier.h5", "earlier.rest.csv", "earlier.swing.csv"]),
}
BESIDE = {"bar.inp", "model.yaml", "earlier.h5"}


def make_folder(folder: Path, shared: Path) -> None:
    for name in BESIDE:
        if (shared / name).exists():
            shutil.copy(shared / name, folder)
    (folder / "tmp").mkdir()


def call(folder: Path, arguments: list, trace: list = ()) -> subprocess.CompletedProcess:
    return commands.call([*trace, os.environ["SIMFLEX_PROGRAM"], *arguments], folder,
                         {"SIMFLEX_CACHE": str(folder / "cache"), "TMPDIR": str(folder / "tmp"), "OMP_NUM_THREADS": "2"})


def read_words(ended: subprocess.CompletedProcess, most: int) -> str:
    return (ended.stdout + ended.stderr)[-most:]


def prepare(shared: Path) -> None:
    """Prepares the files of commands that are not killed, and the most calls of each kind in one of their threads."""
    shutil.rmtree(shared, ignore_errors=True)
    shared.mkdir(parents=True)
    parts.write_deck(parts.Bar("bar", 0.3, 0.02, 3, 2e11, 7850, False), shared / "bar.inp")
    (shared / "model.yaml").write_text(MODEL)
    counts = {}
    for kind, (arguments, _, files) in COMMANDS.items():
        folder = shared / kind
        folder.mkdir()
        make_folder(folder, shared)
        log = shared / f"{kind}.log"
        ended = call(folder, arguments, ["strace", "-f", "-qq", "-e", f"trace={','.join(FILES)}", "-o", str(log)])
        if ended.returncode != 0:
            raise RuntimeError(f"{kind}: {read_words(ended, 1000)}")
        if kind == "run":
            shutil.copy(folder / "r.h5", shared / "earlier.h5")
        of_threads = {}
        for line in log.read_text(errors="replace").splitlines():
            found = re.match(r"(\d+) +(\w+)\(", line)
            if found:
                of_threads[found.groups()] = of_threads.get(found.groups(), 0) + 1
        counts[kind] = {}
        for (_, name), count in of_threads.items():
            counts[kind][name] = max(count, counts[kind].get(name, 0))
        log.unlink()
    (shared / "counts.json").write_text(json.dumps(counts))


def list_rest(folder: Path, kind: str) -> list:
    known = BESIDE | {"tmp", "cache"} | {file.split("/")[0] for file in COMMANDS[kind][2]}
    rest = [path.name for path in folder.iterdir() if path.name not in known]
    rest += [f"tmp/{path.name}" for path in (folder / "tmp").iterdir()]
    rest += [str(path.relative_to(folder)) for path in folder.rglob("*.part-*")]
    # Process numbers recur: files that may belong to a living process are left alone.
    return [name for name in rest if not os.path.exists(f"/proc/{name.rpartition('.part-')[2]}")]


def has_results(file: Path, before: bytes) -> bool:
    """True if a file is unchanged, or has both analyses complete."""
    if not file.exists():
        return False
    if file.read_bytes() == before:
        return True
    with h5py.File(file) as results:
        analyses = results.get("analyses", {})
        return all(name in analyses and analyses[name].attrs["complete"] for name in ("rest", "swing"))


def try_case(seed: int, index: int, folder: Path) -> harness.Outcome:
    outcome = harness.Outcome()
    random_ = random.Random(f"{seed} {index}")
    shared = folder.parent / "parts"
    counts = json.loads((shared / "counts.json").read_text())
    kind = random_.choice(list(COMMANDS))
    arguments, again, files = COMMANDS[kind]
    make_folder(folder, shared)
    kills = []
    for k in range(random_.choice([1, 1, 1, 2, 3])):
        name = random_.choice(sorted(counts[kind]))
        place = 1 + int(random_.random() * counts[kind][name])
        more = again if k > 0 and random_.random() < 0.5 else []
        ended = call(folder, arguments + more, ["strace", "-f", "-qq", "-e", f"trace={name}", "-o", os.devnull, "-e",
                                                f"inject={name}:signal=KILL:when={place}"])
        was_killed = ended.returncode in (137, -signal.SIGKILL)
        kills.append(f"{name} {place}" + (" again" if more else "") + ("" if was_killed else " (of a child, or never)"))
        outcome.counts[f"{kind}s killed" if was_killed else "of a child's processes killed, or none"] += 1
        if ended.returncode is None:
            outcome.fail("hang", f"when killed: {read_words(ended, 300)}")
        if kind == "redo":
            before = (shared / "earlier.h5").read_bytes()
            places = [folder / "earlier.h5", *folder.glob("earlier.h5.before-*/earlier.h5")]
            if not any(has_results(file, before) for file in places):
                outcome.fail("kept", f"after {kills[-1]} there are neither the old results nor new ones")
    outcome.title = f"{kind}: {', '.join(kills)}"
    ended = call(folder, arguments + again)
    if ended.returncode is None:
        outcome.fail("hang", read_words(ended, 300))
    elif ended.returncode != 0:
        outcome.fail("again", f"status {ended.returncode}: {read_words(ended, 600)}")
    for file in files:
        mine, reference = folder / file, shared / kind / file
        if not mine.exists():
            outcome.fail("bits", f"there is no '{file}'")
        elif (content := read_content(mine)) != (expected := read_content(reference)):
            differing = ([key for key in content.keys() | expected.keys() if content.get(key) != expected.get(key)]
                         if isinstance(content, dict) else "")
            outcome.fail("bits", f"'{file}' is other than without a kill {differing}")
    rest = list_rest(folder, kind)
    if rest:
        outcome.fail("rest", f"left: {', '.join(sorted(set(rest)))}")
    return outcome


def can_trace() -> bool:
    try:
        return subprocess.run(["strace", "-o", os.devnull, "true"], capture_output=True).returncode == 0
    except OSError:
        return False


if __name__ == "__main__":
    if not can_trace():
        print("strace is not there, or may not trace: nothing was tried")
        sys.exit(SKIPPED)
    harness.main(__doc__, "kills", try_case, count=100, limit=300, prepare=prepare)
