"""Runs commands of the program, and ends those that hang. A busy machine does not count as a hang: the criteria are
processor time, and whether a command makes no progress at all."""

import os
import resource
import signal
import subprocess
import tempfile
import time
from pathlib import Path

PROCESSOR_SECONDS = 60  # a command that takes more counts as endless
STILL_SECONDS = 60  # so does one with no thread running or waiting for a processor or a disk for so long
PERIOD = 0.05  # [s] between two checks
WORKING = "RD"  # states of working threads, as named in proc(5)


def call(arguments: list, folder: Path, environment: dict, memory: int = resource.RLIM_INFINITY) -> subprocess.CompletedProcess:
    """Runs a command to its end. If it hangs, all of its processes are ended and the status is None.

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
    """Waits until the process ends or hangs. Returns whether it ended."""
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
    """Processor time [s] of a session's processes and their ended children, and whether any of their threads works."""
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
    """The fields of `stat` in proc(5), beginning with the state."""
    return (process / "stat").read_text(errors="replace").rpartition(")")[2].split()
