"""Checks of a mechanism. Each yields texts that name the differences and their size."""

import time
import warnings

import numpy as np
import scipy.interpolate

from . import mechanics
from .builder import View, to_rotation
from .generator import DURATION, ROWS
from .runs import Case, Run, run_file, run_program

ACCURACY = 1e-6  # of runs [m]
FINER = 100  # the accuracy is divided by this for the reference
LESS_FINER = 10  # the same when Radau must converge to the reference, which is itself Radau's
FACTOR = 30.0  # of the bounds on errors of methods
ORDER = {"radau": 3, "bdf": 2, "generalized_alpha": 2}  # the order that controls the error of a step
CONVERGENCE = 0.7  # part of its order with which a method must converge if it exceeds the bound
START_BOUND = 1e-3  # of kinetic energy at the start
ROUND_OFF = 1e-9  # of the size of a quantity
PERTURBATION = 1e-5
APART, GRAZE = 5e-3, 1e-4  # [m] distance of carts that have separated; of carts that turn back where they would meet
FLOORS = {"position": 1.0, "velocity": 1.0, "acceleration": 10.0, "force": 10.0, "energy": 1.0, "momentum": 1.0, "discrete": 1.0,
          "angle": 1.0}


# ---- comparison


def calc_scales(run: Run) -> dict:
    """The size of each kind of quantity in a run, in nominal units."""
    scales = dict(FLOORS)
    for name, quantity in run.builder.quantities.items():
        if name in run:
            scales[quantity.kind] = max(scales[quantity.kind], np.nanmax(np.abs(run.nominal(name))))
    scales["position"] = max(scales["position"], 1.0)
    return scales


def is_smooth(run: Run, times: np.ndarray) -> np.ndarray:
    """Rows that are not next to an event or a jump of a load."""
    jumps = [time for _, time in run.events] + run.builder.facts.jumps
    smooth = np.ones(len(times), bool)
    for jump in jumps:
        smooth &= np.abs(times - jump) > 1.01 * DURATION / ROWS
    return smooth


def calc_differences(run: Run, other: Run, kinds, invariant_only: bool = False) -> list:
    """(difference of each row relative to the kind's size, probe) of all probes of these kinds."""
    scales = calc_scales(run)
    rows = min(len(run.time), len(other.time))
    found = []
    for name, quantity in run.builder.quantities.items():
        if quantity.kind not in kinds or name not in other or (invariant_only and not quantity.is_invariant):
            continue
        difference = np.abs(run.nominal(name)[:rows] - other.nominal(name)[:rows]).max(axis=1) / scales[quantity.kind]
        found.append((difference, name))
    return found


def find_worst(differences, mask=None):
    """(size, probe, row) of the largest difference; 0 without probes."""
    worst = (0.0, "", 0)
    for difference, name in differences:
        rows = np.where(mask[:len(difference)], difference, 0) if mask is not None else difference
        rows = np.where(np.isnan(rows), np.inf, rows)
        if len(rows) and rows.max() > worst[0]:
            worst = (float(rows.max()), name, int(np.argmax(rows)))
    return worst


def tell(what: str, worst, bound: float, run: Run) -> str:
    size, probe, row = worst
    return f"{what}: {probe} differs by {size:.3g} of its size at t = {run.time[row]:.6g} (bound {bound:.3g})"


def _perturb(keys: dict) -> None:
    """Slightly changed masses, weight and initial rates."""
    factor = 1 + PERTURBATION
    for body in keys["bodies"].values():
        if "mass" in body:
            body["mass"] *= factor
            break
    keys["gravity"] = [factor * g for g in keys.get("gravity", [0, 0, 0])]
    rates = keys.get("initial", {}).get("rates", {})
    for name in rates:
        rates[name] *= factor


def _refine(keys: dict, times: int = FINER) -> None:
    keys["solver"]["accuracy"] /= times


def get_reference(case: Case) -> Run:
    return case.run("reference", change=_refine)


def grazes(run: Run) -> bool:
    """Whether separated carts turn back just where they would meet: round-off then decides whether they do."""
    if "xb_minus_xa" not in run:
        return False
    way = scipy.interpolate.CubicSpline(run.time, run.nominal("xb_minus_xa")[:, 0])(np.linspace(run.time[0], run.time[-1], 20001))
    turns = (way[1:-1] <= way[:-2]) & (way[1:-1] < way[2:]) & (np.maximum.accumulate(way)[1:-1] > APART)
    return bool((np.abs(way[1:-1][turns]) < GRAZE).any())


def calc_sensitivity(case: Case) -> float:
    """Growth of a relative change of the mechanism; infinite if the events differ, or might differ."""
    reference = get_reference(case)
    if grazes(reference):
        return np.inf
    perturbed = case.run("perturbed", change=lambda keys: (_refine(keys), _perturb(keys)))
    if [name for name, _ in reference.events] != [name for name, _ in perturbed.events] or len(reference.time) != len(perturbed.time):
        return np.inf
    differences = calc_differences(reference, perturbed, ("position", "velocity"))
    return max(1.0, find_worst(differences, is_smooth(reference, reference.time))[0] / PERTURBATION)


# ---- laws of mechanics


def check_momentum(case: Case):
    """Momentum about free axes is conserved: that reported, and that calculated from the states of rigid bodies."""
    run, builder = case.run("main"), case.builder
    if not case.facts.conserved:
        return
    told = run["linear"], run["angular"]
    own = mechanics.calc_momentum(run) if not builder.has_flexible() else told
    for source, (linear, angular) in {"told": told, "calculated": own}.items():
        size = mechanics.calc_momentum_size(run)
        for conserved in case.facts.conserved:
            value = mechanics.project_momentum(conserved, linear, angular)
            drift = np.abs(value - value[0]).max() / size
            bound = FACTOR * ACCURACY**0.75
            if drift > bound:
                row = int(np.argmax(np.abs(value - value[0])))
                yield (f"{conserved.kind} momentum along {np.round(conserved.axis, 3)} ({source}) goes from {value[0]:.6g} to "
                       f"{value[row]:.6g} at t = {run.time[row]:.6g}, {drift:.3g} of its size (bound {bound:.3g})")


def check_energy(case: Case):
    """T follows from states and V from formulas; the balance is constant, and T + V without external power."""
    run, facts = case.run("main"), case.facts
    size = mechanics.calc_energy_size(run)
    kinetic = sum(run[f"{body.name}_T"] for body in case.builder.bodies)
    yield from _compare_energy("sum of bodies' kinetic energies and all", kinetic, run["K"], size, run, ROUND_OFF)
    for body in case.builder.bodies:
        if body.bar is None:
            yield from _compare_energy(f"kinetic energy of {body.name} by its state", mechanics.calc_kinetic(run, body),
                                       run[f"{body.name}_T"], size, run, ROUND_OFF)
    bound = FACTOR * ACCURACY**0.75 + ACCURACY * mechanics.calc_largest_force(run) / size
    if case.builder.has_flexible():  # fast modes die away
        bound *= 30 if vibrates_after_impact(case) else 3
    yield from _compare_energy("balance and its start", run["B"], run["B"][0] + 0 * run["B"], size, run, bound)
    if facts.has_formula_potential and not case.builder.has_flexible():
        potential = mechanics.calc_potential(run)
        yield from _compare_energy("potential energy (less its start) by formulas", potential - potential[0], run["P"] - run["P"][0],
                                   size, run, 1e-7)
        if facts.is_conservative and not has_impulses(case):
            total = run["K"] + potential
            yield from _compare_energy("T + V and its start", total, total[0] + 0 * total, size, run, bound)


def _compare_energy(what, value, right, size, run, bound):
    difference = np.abs(value - right)
    row = int(np.argmax(difference))
    if not difference[row] <= bound * size:
        yield f"{what}: {value[row]:.9g} and {right[row]:.9g} J at t = {run.time[row]:.6g}, {difference[row] / size:.3g} of its size (bound {bound:.3g})"


def check_turns(case: Case):
    """Angles, including whole turns, are integrals of their rates; driven coordinates follow their functions."""
    run = case.run("main")
    for joint in case.builder.joints:
        if joint.probes and joint.type in ("pin", "slider") and not run.events:
            q, u = run[joint.probes[0]], run[joint.probes[1]]
            h = run.time[1] - run.time[0]
            fine = mechanics.integrate(u, h)
            error = np.abs(q - q[0] - fine).max()
            roughness = np.abs(np.diff(u, 4)).max() * h if len(u) > 4 else 0
            if error > 1e-3 + 20 * roughness:
                yield f"{joint.probes[0]} is {error:.6g} off the integral of its rate"
    for probe, formula in case.facts.driven:
        right = mechanics.evaluate(formula, run.time)
        offset = right[0]
        error = np.abs(run[probe] - right)
        row = int(np.argmax(error))
        if error[row] > 1e-6 * case.builder.view.length:
            yield f"{probe} is {run[probe][row]:.9g} for {right[row]:.9g} at t = {run.time[row]:.6g} (starts at {offset:g})"


def check_start(case: Case):
    """Flexible bodies start undeformed, with the speeds of rigid ones where joints and motions determine them."""
    if not case.builder.has_flexible() or not case.facts.has_known_rates:
        return
    import simflex

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = simflex.Model(case.folder / "main.yaml")
        flexible, rigid = (float(simflex.Session(model, rigid=held)["K"]) for held in (False, True))
    if abs(flexible - rigid) > START_BOUND * max(rigid, 1e-3):
        yield f"kinetic energy is {flexible:.6g} J at the start, {rigid:.6g} J of rigid bodies"


def check_zero(case: Case):
    """Coordinates are zero as placed."""
    run = case.run("main")
    for joint in case.builder.joints:
        if joint.probes and joint.name not in case.builder.keys["initial"].get("joints", {}) and not case.facts.driven:
            start = float(run[joint.probes[0]][0])
            if abs(start) > 1e-8:
                yield f"{joint.probes[0]} of a {joint.type} begins at {start:.6g} as placed"


def check_statics(case: Case):
    """Driven coordinates keep their turns in a static analysis and in analyses that start from it."""
    if not case.facts.has_statics:
        return
    results = run_file(case.folder / "main.yaml", case.folder / "statics.h5")
    for name in ("rest", "on"):
        for probe, formula in case.facts.driven:
            right = float(mechanics.evaluate(formula, np.array([DURATION]))[0])
            values = np.atleast_1d(results[name][probe])
            if np.abs(values - right).max() > 1e-6:
                yield f"{name}.{probe} is {values[0]:.9g} for {right:.9g}"
    done = run_program("post", "statics.h5", "--set", "probes.later={energy: total}", "-o", "statics_post.h5", "--no-pictures", folder=case.folder)
    if done.returncode:
        yield f"post: status {done.returncode}: {done.stderr.strip()[-400:]}"


def check_discrete(case: Case):
    """Counters are integers, and correct where they count periods."""
    run = case.run("main")
    for probe in case.facts.whole:
        values = run[probe]
        wrong = np.flatnonzero(values != np.round(values))
        if len(wrong):
            yield f"{probe} is {values[wrong[0]]!r} at t = {run.time[wrong[0]]:.6g} and not whole in {len(wrong)} of {len(values)} rows"
    for probe, period in case.facts.counters:
        phase = run.time / period
        clear = np.abs(phase - np.round(phase)) > 1e-6
        right = np.floor(phase) + 1
        wrong = np.flatnonzero(clear & (run[probe] != right))
        if len(wrong):
            yield f"{probe} is {run[probe][wrong[0]]!r} for {right[wrong[0]]:g} at t = {run.time[wrong[0]]:.6g}"


def check_impulse(case: Case):
    """Speeds just before and after each event obey mechanics; a session stops there to read them."""
    events = [(name, time) for name, time in case.run("main").events if name in case.facts.actions]
    for name, time in events:
        near = [other for other, at in case.run("main").events if 1e-7 < abs(at - time) < 1e-3]
        if near or time < 1e-3 or time > DURATION - 1e-3 or any(1e-7 < abs(jump - time) < 1e-3 for jump in case.facts.jumps):
            continue
        actions = case.facts.actions[name]
        yield from mechanics.check_impulse(case, name, time, actions)


# ---- self-consistency


def check_schemes(case: Case):
    """Methods agree with the reference within the limits of their order, or converge to it at their order."""
    reference, sensitivity = get_reference(case), calc_sensitivity(case)
    if not np.isfinite(sensitivity) or vibrates_after_impact(case):
        return
    smooth = is_smooth(reference, reference.time)
    names = [name for name, _ in reference.events]
    for method, order in ORDER.items():
        run = case.run("main") if method == "radau" else case.run(method, change=lambda keys: keys["solver"].update(method=method))
        bound = FACTOR * sensitivity * ACCURACY ** (order / (order + 1))
        others = [name for name, _ in run.events]
        worst = find_worst(_compare_with_reference(case, run), smooth) if names == others else None
        if worst and worst[0] <= bound:
            continue
        times = LESS_FINER if method == "radau" else FINER
        finer = case.run(f"{method}_finer", change=lambda keys: (_refine(keys, times), keys["solver"].update(method=method)))
        still = [name for name, _ in finer.events]
        if still != names:
            yield f"{method}: events {others}, at {times} times finer accuracy {still}, for {names}"
            continue
        left = find_worst(_compare_with_reference(case, finer), smooth)
        fall = times ** (CONVERGENCE * order / (order + 1))
        if left[0] > max(bound, worst[0] / fall if worst else 0):
            yield (tell(f"{method} and reference", worst or left, bound, reference) +
                   f", sensitivity {sensitivity:.3g}; at {times} times finer accuracy {left[1]} by {left[0]:.3g}")


def vibrates_after_impact(case: Case) -> bool:
    """Whether a flexible part has an impact or is released: unresolved modes then decay as each method damps them."""
    return case.builder.has_flexible() and (case.facts.has_impact or case.facts.has_friction or has_impulses(case) or
                                            acts(case, "release"))


def has_impulses(case: Case) -> bool:
    return acts(case, "lock", "engage")


def acts(case: Case, *actions: str) -> bool:
    """Whether an event takes one of these actions."""
    return any(key in action for taken in case.facts.actions.values() for action in taken for key in actions)


def _compare_with_reference(case: Case, run: Run) -> list:
    """Compares only positions with flexible bodies: their fastest mode limits the accuracy of speeds."""
    kinds = ("position",) if case.builder.has_flexible() else ("position", "velocity", "energy", "momentum")
    return calc_differences(get_reference(case), run, kinds)


def check_rows(case: Case):
    """Rows every 10 h equal those every h; the steps agree because both have the same maximum."""
    fine = case.run("main")
    coarse = case.run("coarse", change=lambda keys: keys["analyses"]["run"].update(interval=10 * DURATION / ROWS))
    common = Run.__new__(Run)
    common.__dict__.update(fine.__dict__)
    pick = [int(np.argmin(np.abs(fine.time - time))) for time in coarse.time]
    common.time = fine.time[pick]
    common._rows = {name: rows[pick] for name, rows in fine._rows.items()}
    mask = is_smooth(fine, coarse.time)
    sensitivity = None
    for kinds, base in ((("position", "angle", "velocity", "energy", "momentum", "discrete"), 1.0), (("acceleration", "force"), 10.0)):
        worst = find_worst(calc_differences(common, coarse, kinds), mask)
        if worst[0] > ROUND_OFF:
            sensitivity = sensitivity or calc_sensitivity(case)
            bound = base * FACTOR * sensitivity * ACCURACY**0.75
            if worst[0] > bound:
                yield tell("rows every 10 h", worst, bound, coarse)


def check_names(case: Case):
    """Renaming changes no bit."""
    run = case.run("main")
    plain = case.run("plain_names", View(plain_names=True))
    if not _are_same_bits(run, plain):
        rows = min(len(run.time), len(plain.time))
        worst = find_worst(calc_differences(run, plain, FLOORS))
        yield tell("other names of parameters, states, events", worst, 0, run) + f" ({rows} rows)"


def _are_same_bits(run: Run, other: Run, probes=None) -> bool:
    names = probes if probes is not None else run.builder.quantities
    return (np.array_equal(run.time, other.time) and np.array_equal(run.q, other.q) and np.array_equal(run.u, other.u) and
            all(np.array_equal(run[name], other[name], equal_nan=True) for name in names))


def check_views(case: Case):
    """Another origin, other axes, and other units of length and mass change nothing."""
    if not case.facts.has_known_rates:
        return  # the projection onto joints weights speeds, and weights depend on axes and units
    run = case.run("main")
    turn = to_rotation(case.facts.axis_of_rotation, 0.7)
    views = {"moved": View(tuple(map(tuple, turn)), (1.3, -0.4, 2.1))}
    if not case.builder.has_flexible():
        views["scaled"] = View(length=4.0, mass=2.0)
    for tag, view in views.items():
        other = case.run(tag, view)
        for kinds, base in ((("position", "velocity", "energy", "discrete"), 1.0), (("acceleration", "force"), 10.0)):
            worst = find_worst(calc_differences(run, other, kinds, True), is_smooth(run, run.time))
            if worst[0] <= ROUND_OFF:
                continue
            sensitivity = calc_sensitivity(case)
            bound = base * FACTOR * sensitivity * ACCURACY**0.75
            if worst[0] > bound:
                yield tell(tag, worst, bound, run) + f", sensitivity {sensitivity:.3g}"


def check_analyses(case: Case):
    """All analyses at once, one at a time, and stopped and resumed give the same bits."""
    path = case.write("analyses")
    whole = run_file(path, case.folder / "whole.h5")
    for name in case.builder.keys["analyses"]:
        single = run_file(path, case.folder / "single.h5", [name])
    yield from _compare_analyses("one at a time", whole, single)
    main = case.run("main")
    on = Run(whole["on"], case.builder)
    if not main.events and not case.facts.has_statics:
        for probe, quantity in case.builder.quantities.items():
            if quantity.kind == "position" and not np.allclose(on[probe][0], main[probe][-1], rtol=0, atol=1e-8):
                yield f"`on` begins at {probe} = {on[probe][0]} where `run` ends at {main[probe][-1]}"
    yield from _check_resumed(case, path, whole)


def _compare_analyses(what, whole, other):
    for name in whole:
        for probe in whole[name]:
            if not np.array_equal(whole[name][probe], other[name][probe], equal_nan=True):
                right, value = np.asarray(whole[name][probe]), np.asarray(other[name][probe])
                difference = np.abs(right - value).max() if right.shape == value.shape else np.inf
                yield f"{what}: {name}.{probe} differs by {difference:.3g}"
                return


def _check_resumed(case: Case, path, whole):
    """Stops a run at a row by a slow probe, because progress is reported only every 50 ms."""
    import simflex

    calls = iter(range(10**9))
    slow_row = 3 + case.index % (ROWS - 5)
    is_stopping = []

    def dawdle(t):
        if next(calls) == slow_row:
            time.sleep(0.06)
            is_stopping.append(True)
        return 0.0

    def run(**more):
        model = simflex.Model(path, {"probes.dawdle": {"expression": "dawdle(t)"}})
        model.function(dawdle)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return model.run(case.folder / "resumed.h5", **more)

    try:
        run(progress=lambda what, fraction: not is_stopping)
        return
    except simflex.Cancelled:
        pass
    yield from _compare_analyses("resumed", whole, run(resume=True))


def check_post(case: Case):
    """A probe evaluated later equals one evaluated in the run."""
    import simflex

    new = {"later_x": {"center_of_mass": True}, "later_m": {"momentum": "angular"}, "later_e": {"energy": "total"}}
    joints = [joint for joint in case.builder.joints if joint.probes]
    if joints:
        new["later_q"] = {"coordinate": joints[0].name}
        if not case.facts.is_redundant:
            new["later_f"] = {"reaction": joints[0].name, "axes": "F"}
    new["later_a"] = {"acceleration": case.builder.bodies[-1].name}
    right = case.run("with_probes", change=lambda keys: keys["probes"].update(new))
    case.run("main")
    sets = [argument for name, keys in new.items() for argument in ("--set", f"probes.{name}={_to_flow(keys)}")]
    done = run_program("post", "main.h5", *sets, "-o", "post.h5", "--no-pictures", folder=case.folder)
    if done.returncode:
        yield f"status {done.returncode}: {done.stderr.strip()[-400:]}"
        return
    later = simflex.read_results(case.folder / "post.h5")["run"]
    for name in new:
        if not np.array_equal(right[name], later[name], equal_nan=True):
            size = max(1e-300, np.abs(right[name]).max())
            yield f"{name} differs by {np.abs(right[name] - later[name]).max() / size:.3g} of its size from that of a run with it"


def _to_flow(keys: dict) -> str:
    return "{" + ", ".join(f"{key}: {str(value).lower() if isinstance(value, bool) else value}" for key, value in keys.items()) + "}"


CHECKS = {"momentum": check_momentum, "energy": check_energy, "impulse": check_impulse, "start": check_start, "turns": check_turns, "zero": check_zero, "statics": check_statics, "discrete": check_discrete,
          "schemes": check_schemes, "rows": check_rows, "names": check_names, "views": check_views, "analyses": check_analyses,
          "post": check_post}
