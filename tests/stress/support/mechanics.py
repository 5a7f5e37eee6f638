"""Laws of mechanics for a run, evaluated only from the states of bodies and the formulas of the model."""

import math

import numpy as np

from .runs import Run

WINDOW = 1e-5  # [s] between samples of the speeds before and after an event
WINDOW_OF_FLEXIBLE = 1e-7  # the same with flexible bodies, which may still vibrate from earlier impacts


# ---- rigid bodies


def calc_rotations(angles: np.ndarray) -> np.ndarray:
    """Rotations (n×3×3) from body-fixed x-y-z angles (n×3)."""
    c, s = np.cos(angles), np.sin(angles)
    zero, one = np.zeros(len(angles)), np.ones(len(angles))
    Rx = np.array([[one, zero, zero], [zero, c[:, 0], -s[:, 0]], [zero, s[:, 0], c[:, 0]]])
    Ry = np.array([[c[:, 1], zero, s[:, 1]], [zero, one, zero], [-s[:, 1], zero, c[:, 1]]])
    Rz = np.array([[c[:, 2], -s[:, 2], zero], [s[:, 2], c[:, 2], zero], [zero, zero, one]])
    return np.einsum("ijn,jkn,kln->nil", Rx, Ry, Rz)


class BodyMotion:
    """Centre of mass, its velocity, the angular velocity, and the inertia about it in Ground's axes: n rows each."""

    def __init__(self, rows, body, view):
        name = body.name
        R = calc_rotations(np.atleast_2d(rows[f"{name}_o"]))
        arm = R @ (view.length * body.center)
        self.w = np.atleast_2d(rows[f"{name}_w"])
        self.x = np.atleast_2d(rows[f"{name}_x"]) + arm
        self.v = np.atleast_2d(rows[f"{name}_v"]) + np.cross(self.w, arm)
        self.mass = body.mass * view.mass
        self.J = R @ (view.unit(1, 2) * body.inertia) @ R.transpose(0, 2, 1)

    def calc_kinetic(self) -> np.ndarray:
        return calc_product(self, self.v, self.w, self.v, self.w) / 2


def calc_product(motion: BodyMotion, v, w, other_v, other_w) -> np.ndarray:
    """m v·v' + ω·J ω'."""
    return motion.mass * np.sum(v * other_v, axis=1) + np.einsum("ni,nij,nj->n", w, motion.J, other_w)


def calc_kinetic(run: Run, body) -> np.ndarray:
    return BodyMotion(run, body, run.builder.view).calc_kinetic()


def calc_momentum(run: Run):
    """Linear momentum and angular momentum about Ground's origin of rigid bodies, n×3 each."""
    linear = angular = 0
    for body in run.builder.bodies:
        motion = BodyMotion(run, body, run.builder.view)
        linear = linear + motion.mass * motion.v
        angular = angular + np.cross(motion.x, motion.mass * motion.v) + np.einsum("nij,nj->ni", motion.J, motion.w)
    return linear, angular


def calc_momentum_size(run: Run) -> float:
    """Size of the momenta of single bodies."""
    mass = sum(body.mass for body in run.builder.bodies)
    return max(1.0, math.sqrt(2 * mass * float(np.max(run["K"]))))


def project_momentum(conserved, linear, angular) -> np.ndarray:
    """The component of momentum that is conserved about a free axis."""
    if conserved.kind == "linear":
        return linear @ conserved.axis
    return (angular - np.cross(conserved.point, linear)) @ conserved.axis


# ---- energy


def calc_energy_size(run: Run) -> float:
    """Energy that is exchanged in a run."""
    sizes = [np.ptp(run[name]) for name in ("P", "W")] + [np.max(run["K"])]
    return max(1e-3, *map(float, sizes))


def calc_largest_force(run: Run) -> float:
    """Largest of the weight on Earth and the forces in joints [N]. It does work on an error as large as the accuracy,
    and no step resolves smaller vibrations of a flexible part."""
    weight = 9.8 * sum(body.mass for body in run.builder.bodies) * run.builder.view.unit(1, 1)
    return max([weight] + [np.abs(run[f"{joint.name}_f"]).max() for joint in run.builder.joints if f"{joint.name}_f" in run])


def calc_potential(run: Run) -> np.ndarray:
    """Potential energy of weight and connectors, by formulas."""
    view, gravity = run.builder.view, run.builder.keys.get("gravity", [0, 0, 0])
    potential = np.zeros(len(run.time))
    for body in run.builder.bodies:
        motion = BodyMotion(run, body, view)
        potential -= motion.mass * motion.x @ np.array(gravity)
    return potential + sum(formula(run) for formula in run.builder.facts.potentials)


# ---- functions of time


def evaluate(formula: str, times: np.ndarray) -> np.ndarray:
    """Values of a formula of t, written as in the model file."""
    known = {"cos": np.cos, "sin": np.sin, "step": _step, "t": times, "__builtins__": {}}
    return np.broadcast_to(eval(formula, known), times.shape)


def _step(t, t0, y0, t1, y1):
    """From y0 to y1 with two continuous derivatives, a polynomial of degree 5."""
    x = np.clip((t - t0) / (t1 - t0), 0, 1)
    return y0 + (y1 - y0) * x**3 * (10 - 15 * x + 6 * x**2)


def integrate(values: np.ndarray, h: float) -> np.ndarray:
    """Integral from the first row to each row, by cubics through four neighbours."""
    n = len(values)
    parts = np.zeros(n)
    for k in range(1, n):
        first = min(max(k - 2, 0), n - 4)
        parts[k] = h * np.dot(_WEIGHTS[k - 1 - first], values[first:first + 4])
    return np.cumsum(parts)


# Integrals over each of the three intervals between four points.
_WEIGHTS = [np.array([9, 19, -5, 1]) / 24, np.array([-1, 13, 13, -1]) / 24, np.array([1, -5, 19, 9]) / 24]


# ---- impulses


def _look(session, builder) -> dict:
    names = [name for body in builder.bodies if body.bar is None for name in (f"{body.name}_{k}" for k in "xvow")]
    return {name: np.array(session[name]) for name in [*names, "K", "linear", "angular"]}


def _extrapolate(looks: list) -> dict:
    """Extrapolates to the event by a parabola through samples one, two and three windows away from it."""
    near, middle, far = looks
    return {name: 3 * near[name] - 3 * middle[name] + far[name] for name in near}


def look_at_event(case, time: float):
    """Quantities just before and after an event, from three samples on each side; None if it does not happen there."""
    import warnings

    import simflex

    builder = case.builder
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        session = simflex.Session(simflex.Model(case.folder / "main.yaml", {"solver.accuracy": builder.keys["solver"]["accuracy"] / 100}))
        looks = []
        window = WINDOW_OF_FLEXIBLE if builder.has_flexible() else WINDOW
        for offset in (-3, -2, -1, 1, 2, 3):
            if session.run(time + offset * window) != "reached":
                return None
            looks.append(_look(session, builder))
            happened = sum(1 for _, at in session.events if at > time - window)
            if (offset < 0) != (happened == 0):
                return None
    return _extrapolate(looks[2::-1]), _extrapolate(looks[3:])


def check_impulse(case, name: str, time: float, actions: list):
    """Checks energy and momentum across an event. Yields texts of what is wrong."""
    looks = look_at_event(case, time)
    if looks is None:
        return
    before, after = looks
    facts, builder = case.facts, case.builder
    bound = 1e-4 * max(1e-2, float(before["K"]), float(after["K"]), 0.1 * float(np.max(case.run("main")["K"])))
    is_impulse = any(key in action for action in actions for key in ("lock", "engage"))
    what = f"{name} ({', '.join(key for action in actions for key in action) or 'counts'}) at t = {time:.6g}"
    gain = float(after["K"] - before["K"])
    if not facts.moves_by_time and gain > bound:
        yield f"{what}: kinetic energy grows from {float(before['K']):.6g} to {float(after['K']):.6g} J"
    if not is_impulse and abs(gain) > bound:
        yield f"{what}: kinetic energy goes from {float(before['K']):.6g} to {float(after['K']):.6g} J without an impulse"
    for conserved in facts.conserved:
        values = [float(project_momentum(conserved, look["linear"], look["angular"])) for look in looks]
        size = math.sqrt(2 * sum(body.mass for body in builder.bodies) * max(1e-2, float(before["K"])))
        if abs(values[1] - values[0]) > 1e-4 * size:
            yield f"{what}: {conserved.kind} momentum along {np.round(conserved.axis, 3)} goes from {values[0]:.6g} to {values[1]:.6g}"
    if is_impulse and not facts.moves_by_time and not builder.has_flexible():
        lost = calc_energy_of_change(before, after, builder)
        if abs(-gain - lost) > bound:
            yield f"{what}: {-gain:.6g} J are lost for {lost:.6g} J by Carnot's theorem (T before {float(before['K']):.6g} J)"


def calc_energy_of_change(before: dict, after: dict, builder) -> float:
    """Kinetic energy of the change of speeds, which an inelastic impact dissipates if no constraint moves."""
    energy = 0.0
    for body in builder.bodies:
        old, new = BodyMotion(before, body, builder.view), BodyMotion(after, body, builder.view)
        v, w = new.v - old.v, new.w - old.w
        energy += float(calc_product(old, v, w, v, w)[0]) / 2
    return energy
