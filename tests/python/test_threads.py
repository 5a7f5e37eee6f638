"""Sessions in threads and processes, and Ctrl-C."""

import _thread
import multiprocessing
import pathlib
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import simflex
from models import make_pendulum


def test_sessions_move_in_threads_of_their_own():
    model = make_pendulum(initial={"joints": {"pivot": 0.3}})
    sessions = [simflex.Session(model) for _ in range(4)]
    threads = [threading.Thread(target=session.run, args=(2,)) for session in sessions]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    ends = [session["bob"] for session in sessions]
    assert all(np.array_equal(end, ends[0]) for end in ends)


def test_a_session_is_of_one_thread_at_a_time():
    session = simflex.Session(make_pendulum(initial={"joints": {"pivot": 0.3}}))
    thread = threading.Thread(target=session.run, args=(500,))
    thread.start()
    refusals = 0
    while thread.is_alive() and refusals == 0:
        try:
            session["angle"]
        except RuntimeError as error:
            assert "another thread" in str(error)
            refusals += 1
        time.sleep(0.001)
    thread.join()
    assert refusals == 1


def test_ctrl_c_keeps_the_state():
    session = simflex.Session(make_pendulum(initial={"joints": {"pivot": 0.3}}))
    threading.Timer(0.3, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        session.run(1e6)
    stopped = session.time
    assert 0 < stopped < 1e6
    session.step(0.1)
    assert session.time == pytest.approx(stopped + 0.1)


LEAVE = """
import threading, time, simflex
from models import make_pendulum
model = make_pendulum(initial={"joints": {"pivot": 0.3}}, connectors={"motor": {"type": "motor", "joint": "pivot", "law": lambda angle: -angle}})
session = simflex.Session(model)
threading.Thread(target=session.run, args=(1e6,), daemon=True).start()
time.sleep(0.2)
print("leaving")
"""


def test_a_program_may_end_while_a_session_moves():
    result = subprocess.run([sys.executable, "-c", LEAVE], cwd=pathlib.Path(__file__).parent, capture_output=True, text=True,
                            timeout=60, check=False)
    assert (result.returncode, result.stdout, result.stderr) == (0, "leaving\n", "")


def swing(model):
    session = simflex.Session(model)
    session.run(0.5, interval=0.01)
    return session.record["bob"]


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_sessions_move_in_processes(method):
    models = [make_pendulum(initial={"joints": {"pivot": angle}}) for angle in (0.1, 0.2, 0.3)]
    here = [swing(model) for model in models]   # a fork does not inherit its threads
    with multiprocessing.get_context(method).Pool(2) as pool:
        there = pool.map_async(swing, models).get(60)
    assert all(np.array_equal(a, b) for a, b in zip(here, there))
