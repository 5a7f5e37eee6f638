#!/usr/bin/env python3
"""Checks random mechanisms against laws of mechanics, and against themselves.

Each is a model file drawn from (seed, index): trees and loops of rigid and flexible bodies, joints and mobilizers of
every kind, springs, bushings, stops, motors, laws, loads, prescribed motions, friction, states, events, parameters with
the names of quantities in laws. The program runs it, and this must hold:

    momentum    it is conserved about free axes, also over impulses
    energy      T follows from the bodies' states and V from formulas; the balance is constant, and T + V if nothing
                acts
    impulse     no event creates kinetic energy if no constraint moves; a lock or an engagement takes away the energy of
                the change of speeds (Carnot); other events change no speed
    start       flexible bodies begin with the speeds of rigid ones
    turns       angles are the integrals of their rates, and driven coordinates are their functions of time
    zero        coordinates are zero as placed
    statics     driven coordinates keep their turns in static analyses, and in analyses that begin there
    discrete    counts are whole numbers and right
    schemes     bdf, generalized_alpha and radau agree with radau at a hundredth of the accuracy
    rows        rows every 10 h are those of rows every h
    names       other names of parameters, states and events change no bit
    views       another origin, other axes, other units of length and mass change nothing
    analyses    single analyses (--only) and resumed runs give the same bits as a whole run
    post        a probe evaluated later has the same bits as in a run that records it

The bound on the agreement of schemes of order p is FACTOR·G·a^(p/(p+1)), with the accuracy a in metres and the
sensitivity G of the mechanism, found by a run with slightly different masses, weight and initial rates. A method beyond
it has to converge with tighter accuracy according to its order. The program must run every mechanism drawn: a refusal
is a failure.
"""

import numpy as np
import scipy.interpolate

from support import harness, parts
from support.checks import CHECKS
from support.runs import Case

LEAST_SPRING_LENGTH = 2e-3  # [m] the force of a spring reverses if its ends pass through each other
LARGEST_BUSHING_ANGLE = 3.0  # [rad] a bushing's rotation vector, and its torque, changes sign at half a turn


def find_limit(case: Case, main) -> str:
    """Says how a mechanism exceeds the range of its elements; empty if it does not."""
    if any(np.abs(main[probe]).sum(axis=1).max() > LARGEST_BUSHING_ANGLE for probe in case.facts.bushings):
        return "turn a bushing too far"
    if any(calc_least_length(main, *ends) < LEAST_SPRING_LENGTH for ends in case.facts.springs):
        return "pull a spring through itself"
    return "bend a part too far" if any("modes describe" in warning for warning in main.warnings) else ""


def calc_least_length(run, first: str, second: str) -> float:
    """Smallest distance of two points [m], also between rows."""
    way = scipy.interpolate.CubicSpline(run.time, run.nominal(second) - run.nominal(first))
    return np.linalg.norm(way(np.linspace(run.time[0], run.time[-1], 20001)), axis=1).min()


def try_case(seed: int, index: int, folder) -> harness.Outcome:
    """Makes a mechanism, runs it, and does all checks that apply."""
    outcome = harness.Outcome()
    case = Case(seed, index, folder)
    outcome.title = case.builder.title
    try:
        main = case.run("main")
    except Exception as error:
        outcome.fail("run", f"{type(error).__name__}: {error}")
        return outcome
    outcome.counts[f"of kind {outcome.title}"] += 1
    beyond = find_limit(case, main)
    if beyond:
        outcome.counts[f"{beyond} and are not checked"] += 1
        return outcome
    for name, check in CHECKS.items():
        try:
            for text in check(case):
                outcome.fail(name, text)
        except Exception as error:
            outcome.fail(name, f"{type(error).__name__}: {error}")
    return outcome


if __name__ == "__main__":
    harness.main(__doc__, "mechanisms", try_case, count=100, limit=240, prepare=parts.reduce_bars)
