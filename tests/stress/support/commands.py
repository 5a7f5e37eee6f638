"""Commands of the program, ended when they hang. A busy machine makes none hang: what counts is the time of the processor, and
whether a command stands still."""

import os
import resource
import signal
import subprocess
import tempfile
import time
from pathlib import Path

PROCESSOR_SECONDS = 60  # a command that takes more goes on for ever
STILL_SECONDS = 60  # so does one of which no thread has run, or waited for a processor or a disk, for so long
PERIOD = 0.05  # [s] between two looks
WORKING = "RD"  # states of threads, as proc(5) names them


def call(arguments: list, folder: Path, environment: dict, memory: int = resource.RLIM_INFINITY) -> subprocess.CompletedProcess:
    """Runs a command to its end; the status is None if it hangs, and all of its processes are ended then.

    `memory`: largest size of each process [bytes]"""
    limit = (memory, memory)
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(arguments, cwd=folder, env=dict(os.environ, **environment), stdin=subprocess.DEVNULL,
                                   stdout=output, stderr=errors, start_new_session=True,
                                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limit))
        status = process.poll() if _wait(process) else None
        if status is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        output.seek(0)
        errors.seek(0)
        texts = [file.read().decode(errors="replace") for file in (output, errors)]
        return subprocess.CompletedProcess(arguments, status, *texts)


def _wait(process: subprocess.Popen) -> bool:
    """Waits until it ends or hangs: whether it ends."""
    used, since = -1.0, time.monotonic()
    while True:
        try:
            process.wait(PERIOD)
            return True
        except subprocess.TimeoutExpired:
            seconds, is_working = _look(process.pid)
        if seconds != used or is_working:
            used, since = seconds, time.monotonic()
        if used > PROCESSOR_SECONDS or time.monotonic() - since > STILL_SECONDS:
            return False


def _look(session: int) -> tuple:
    """Processor time [s] of a session's processes with that of their ended children, and whether a thread of theirs works."""
    ticks, is_working = 0, False
    for process in Path("/proc").glob("[0-9]*"):
        try:
            fields = _read_fields(process)
            if int(fields[3]) != session:
                continue
            ticks += sum(map(int, fields[11:15]))
            is_working |= any(_read_fields(thread)[0] in WORKING for thread in (process / "task").iterdir())
        except OSError:  # ended meanwhile
            continue
    return ticks / os.sysconf("SC_CLK_TCK"), is_working


def _read_fields(process: Path) -> list:
    """The fields of proc(5)'s `stat` from the state on."""
    return (process / "stat").read_text(errors="replace").rpartition(")")[2].split()
