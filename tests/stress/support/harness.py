"""Runs a stress test: COUNT cases drawn from a SEED, each in a worker process that may crash or hang without ending the rest.

    def try_case(seed, index, folder): ...          # returns an Outcome; folder is empty and the case's own
    if __name__ == "__main__":
        harness.main(__doc__, "mechanisms", try_case, count=100, limit=120)

A case is a function of seed and index alone, so `--index` repeats one. The folder of a failed case is kept in
build/stress/NAME; those of other cases are removed. The last line is like '37 passed, 0 failed'; the exit status is 1
if any case failed.
"""

import argparse
import collections
import dataclasses
import multiprocessing
import multiprocessing.connection
import os
import shutil
import signal
import sys
import time
import traceback
from pathlib import Path


@dataclasses.dataclass
class Outcome:
    """Result of a case: its failures, and counts of what was tried or refused, which are summed over all cases."""

    failures: list[str] = dataclasses.field(default_factory=list)
    counts: collections.Counter = dataclasses.field(default_factory=collections.Counter)
    title: str = ""

    def fail(self, check: str, text: str) -> None:
        """Adds a failure; `check` names its kind, such as 'energy'."""
        self.failures.append(f"{check}: {text}")


class Worker:
    """A process that tries one case at a time."""

    def __init__(self, try_case, folder: Path):
        self.folder, self.index = folder, None
        self.log = folder.parent / f"{folder.name}.log"
        here, there = multiprocessing.Pipe()
        self.pipe = here
        self.process = multiprocessing.Process(target=_work, args=(try_case, there, self.log), daemon=True)
        self.process.start()
        there.close()

    def begin(self, seed: int, index: int) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        self.index, self.since = index, time.monotonic()
        self.used = self._read_processor_time()
        self.pipe.send((seed, index, self.folder))

    def calc_seconds(self) -> float:
        """Processor time that the case has taken, which a busy machine does not change."""
        return self._read_processor_time() - self.used

    def _read_processor_time(self) -> float:
        try:
            fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return self.used
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def receive(self) -> Outcome:
        """The outcome of a case that has ended, even if its process ended with it."""
        try:
            return self.pipe.recv()
        except EOFError:
            self.process.join()
            outcome = Outcome()
            outcome.fail("crash", f"{_name_end(self.process.exitcode)}; {_read_tail(self.log)}")
            return outcome

    def end(self, hangs: bool = False) -> None:
        if hangs:
            self.process.kill()
        elif self.process.is_alive():
            self.pipe.send(None)
        self.pipe.close()
        self.process.join()
        self.log.unlink(missing_ok=True)
        shutil.rmtree(self.folder, ignore_errors=True)


def _work(try_case, pipe, log: Path) -> None:
    """The loop of a worker; its standard output and error go to `log`."""
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.dup2(file, 1)
    os.dup2(file, 2)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for seed, index, folder in iter(pipe.recv, None):
        try:
            outcome = try_case(seed, index, folder)
        except Exception:
            outcome = Outcome()
            outcome.fail("exception", traceback.format_exc().strip().replace("\n", "\n      "))
        pipe.send(outcome)


def _name_end(code: int) -> str:
    return f"ended by {signal.Signals(-code).name}" if code < 0 else f"ended with status {code}"


def _read_tail(log: Path) -> str:
    return log.read_text(errors="replace").strip()[-600:] or "nothing on standard error"


def parse(description: str, name: str, count: int) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog=f"tests/run stress {name}", description=description,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", nargs="?", type=int, default=count, help=f"number of cases ({count})")
    parser.add_argument("seed", nargs="?", type=int, default=1, help="seed that they are drawn from (1)")
    parser.add_argument("--index", type=int, help="tries this case alone, and keeps its folder")
    parser.add_argument("--first", type=int, default=0, help="index of the first case (0)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="cases at a time (one a processor)")
    parser.add_argument("--folder", type=Path, default=Path("build/stress") / name,
                        help=f"where failed cases are kept (build/stress/{name})")
    return parser.parse_args()


def main(description: str, name: str, try_case, *, count: int, limit: float, prepare=None) -> None:
    """Tries the cases that the command line selects, and exits.

    `limit`: processor time [s] after which a case counts as hanging.
    `prepare`: called once with the folder FOLDER/parts, which cases find as ../parts."""
    arguments = parse(description, name, count)
    indices = ([arguments.index] if arguments.index is not None
               else list(range(arguments.first, arguments.first + arguments.count)))
    folder = arguments.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    if prepare:
        process = multiprocessing.Process(target=prepare, args=(folder / "parts",))
        process.start()
        process.join()
        if process.exitcode:
            sys.exit(f"{name}: what all cases share could not be made")
    counts = collections.Counter()
    failed = 0
    for index, outcome, seconds in _try_all(try_case, arguments.seed, indices, folder, min(arguments.jobs, len(indices)), limit):
        counts += outcome.counts
        failed += bool(outcome.failures)
        _report(name, arguments.seed, index, outcome, seconds, folder, arguments.index is not None)
    for what, number in sorted(counts.items()):
        print(f"  {number:6d} {what}")
    print(f"{len(indices) - failed} passed, {failed} failed", flush=True)
    sys.exit(1 if failed else 0)


def _try_all(try_case, seed, indices, folder, jobs, limit):
    """Yields (index, outcome, seconds) of each case, in the order in which they end."""
    waiting = collections.deque(indices)
    workers = [Worker(try_case, folder / f".{os.getpid()}-{k}") for k in range(jobs)]
    for worker in workers:
        worker.begin(seed, waiting.popleft())
    while workers:
        ready = multiprocessing.connection.wait([worker.pipe for worker in workers], timeout=1)
        for worker in list(workers):
            seconds = time.monotonic() - worker.since
            hangs = worker.pipe not in ready and worker.calc_seconds() > limit
            if worker.pipe not in ready and not hangs:
                continue
            if hangs:
                outcome = Outcome()
                outcome.fail("hang", f"not done after {limit:g} s of the processor")
            else:
                outcome = worker.receive()
            _keep(worker.folder, folder / f"{seed}-{worker.index}", outcome, len(indices) == 1)
            yield worker.index, outcome, seconds
            is_over = hangs or not worker.process.is_alive()
            if is_over or not waiting:
                worker.end(hangs)
                workers.remove(worker)
                if is_over and waiting:
                    workers.append(Worker(try_case, worker.folder))
                    workers[-1].begin(seed, waiting.popleft())
            else:
                worker.begin(seed, waiting.popleft())


def _keep(source: Path, target: Path, outcome: Outcome, always: bool) -> None:
    shutil.rmtree(target, ignore_errors=True)
    if outcome.failures or always:
        shutil.copytree(source, target)


def _report(name, seed, index, outcome, seconds, folder, always) -> None:
    if not outcome.failures and not always:
        return
    print(f"{name} {seed} --index {index} ({outcome.title}; {seconds:.1f} s): {folder / f'{seed}-{index}'}")
    for failure in outcome.failures:
        print(f"    {failure}")
    sys.stdout.flush()
