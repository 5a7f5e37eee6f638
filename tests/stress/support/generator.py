"""Random mechanisms: trees and loops of rigid and flexible bodies, with the forces, motions and events in them.

A mechanism is a function of (seed, index): `make(seed, index, view)` draws the same one for every View. Bodies are
connected as placed (joints are closed to round-off), and loops remove no more freedom than their bodies have.
Mechanisms without a definite answer are not made: none is over-constrained, and none moves by more than some metres a
second.
"""

import numpy as np

from .builder import Builder, Conserved, View, frame_along, to_rotation
from .parts import BARS

TEMPLATES = ["tree", "tree", "tree", "isolated", "isolated", "four_bar", "carts", "slider_crank", "winch"]
DURATION = 0.4  # [s]
ROWS = 40
X, Y, Z = np.eye(3)


def make(seed: int, index: int, view: View = View()) -> Builder:
    """Draws mechanism number `index`."""
    rng = np.random.default_rng([seed, index])
    builder = Builder(view, np.random.default_rng([seed, index, 1]))
    builder.title = str(rng.choice(TEMPLATES))
    {"tree": _make_tree, "isolated": _make_isolated, "four_bar": _make_four_bar, "carts": _make_carts,
     "slider_crank": _make_slider_crank, "winch": _make_winch}[builder.title](builder, rng)
    builder.facts.has_known_rates = _are_rates_known(builder)
    _add_probes(builder)
    _drop_released(builder)
    _add_solver(builder, rng)
    return builder


# ---- pieces of mechanisms


def _unit_vector(rng) -> np.ndarray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def _add_rigid_bar(b: Builder, rng, start, end, mobilizer=None):
    """A rigid body about a line, with arbitrarily rotated axes. @param mobilizer  called with R and x, returns the key"""
    start, end = np.asarray(start), np.asarray(end)
    along = end - start
    length = np.linalg.norm(along)
    R = frame_along(along, 0) @ to_rotation(_unit_vector(rng), rng.uniform(0, 3))
    x = start + rng.uniform(0.2, 0.8) * along
    mass = rng.uniform(0.3, 2)
    edges = np.array([length, rng.uniform(0.05, 0.2), rng.uniform(0.05, 0.2)])
    principal = np.diag(mass / 12 * (np.sum(edges**2) - edges**2))
    turn = to_rotation(_unit_vector(rng), rng.uniform(0, 3)) if rng.random() < 0.5 else R.T @ frame_along(along, 0)
    inertia = turn @ principal @ turn.T
    center = R.T @ (0.5 * (start + end) - x) + (rng.uniform(-0.03, 0.03, 3) if rng.random() < 0.5 else 0)
    return b.add_rigid(mass, R, x, center, inertia, mobilizer(R, x) if mobilizer else None)


def _add_flexible_bar(b: Builder, rng, start, direction, bar):
    """A flexible part with `near` at a point and `far` in a direction."""
    return b.add_flexible(bar, frame_along(direction, 0) , start, damping=float(rng.choice([0.01, 0.05])))


def _draw_type(rng, can_weld=False) -> str:
    types = ["pin"] * 4 + ["slider"] * 2 + ["ball"] * 2 + ["universal", "cylinder", "planar", "screw"] + ["weld"] * can_weld
    return str(rng.choice(types))


def _add_link(b: Builder, rng, parent, point, type: str, may_bend: bool, planar: bool):
    """A bar attached to its parent (None: Ground) at a point. Returns the body, its joint or None, and its far end."""
    direction = _unit_vector(rng)
    axis = Z if planar else _unit_vector(rng)
    if planar:
        direction = np.array([direction[0], direction[1], 0])
        direction /= np.linalg.norm(direction)
        axis = direction if type == "slider" else Z
    bends = may_bend and rng.random() < 0.35
    can_be_mobilizer = not bends and (parent is None or parent.bar is None) and type != "screw"
    if bends:
        bar = BARS[rng.integers(len(BARS))]
        body = _add_flexible_bar(b, rng, point, direction, bar)
        end = point + direction * bar.length
    else:
        end = point + direction * rng.uniform(0.2, 0.6)
        mobilizer = None
        if can_be_mobilizer and rng.random() < 0.35:
            mobilizer = lambda R, x: b.mobilize(type, parent, R, x, point, axis)
        body = _add_rigid_bar(b, rng, point, end, mobilizer)
        if mobilizer:
            b.probe_mobilizer(body, type)
            return body, None, end
    more = {"pitch": float(b.number(0.05, 0, 1))} if type == "screw" else {}
    apart = rng.uniform(-0.3, 0.3) if type == "slider" and not _bends(parent) and rng.random() < 0.5 else 0
    return body, b.add_joint(type, parent, body, point, axis, apart, **more), end


def _bends(body) -> bool:
    return body is not None and body.bar is not None


def _grow_tree(b: Builder, rng, root, root_point, root_type: str, count: int, planar: bool, may_bend: bool):
    """Returns a list of (body, joint or None, parent, end point)."""
    tips = []
    for k in range(count):
        parent, point = (root, root_point) if k == 0 else (lambda tip: (tip[0], tip[3]))(tips[rng.integers(max(0, len(tips) - 2), len(tips))])
        type = root_type if k == 0 else str(rng.choice(["pin", "pin", "slider"])) if planar else _draw_type(rng, k > 1)
        body, joint, end = _add_link(b, rng, parent, point, type, may_bend, planar)
        tips.append((body, joint, parent, end))
    return tips


def _close_loops(b: Builder, rng, tips, with_ground: bool) -> None:
    """At most one loop that removes one degree of freedom: a rod, a point on a plane, or coupled coordinates."""
    kind = rng.choice(["none", "rod", "plane", "coupler", "gear"])
    single = [joint for joint in b.joints if joint.type == "pin" and (with_ground or joint.bodies[0] is not None)]
    mobilizers = [body["mobilizer"]["type"] for body in b.keys["bodies"].values() if "mobilizer" in body]
    if "weld" in mobilizers + [joint.type for joint in b.joints]:  # there may be no freedom to remove
        return
    if kind == "rod" and len(tips) >= 3:
        anchor = tips[0][3] + rng.normal(size=3)
        far = None if with_ground else tips[0][0]
        b.add_joint("rod", far, tips[-1][0], tips[-1][3], Z)
        entry = b.keys["joints"][b.joints[-1].name]
        entry["between"][0] = b.frame(far, anchor if far is None else tips[0][3] + 0.1)
    elif kind == "plane" and with_ground and len(tips) >= 3:
        joint = b.add_joint("point_in_plane", None, tips[-1][0], tips[-1][3], X)
        entry = b.keys["joints"][joint.name]
        entry.pop("as_placed", None)
        entry["axis"] = b.view.direction(_unit_vector(rng))
    elif kind == "coupler" and len(single) >= 2 and len(tips) >= 3:
        b.keys["joints"]["coupled"] = {"type": "coupler", "terms": [
            {"joint": single[0].name, "coefficient": 1}, {"joint": single[1].name, "coefficient": float(rng.choice([-2, -0.5, 0.5, 1.5, 3]))}]}
    elif kind == "gear" and len(single) >= 2 and len(tips) >= 3:
        b.keys["joints"]["coupled"] = {"type": "gear", "wheels": [single[0].name, single[1].name], "teeth": [17, int(rng.integers(17, 60))]}
    else:
        return
    b.has_loop = True


# ---- templates


def _make_tree(b: Builder, rng) -> None:
    """A tree on Ground, possibly with a loop, under weight and loads."""
    planar = rng.random() < 0.3
    b.set_gravity([0, -9.8, 0] if rng.random() < 0.8 else [0, 0, 0])
    tips = _grow_tree(b, rng, None, rng.uniform(-1, 1, 3), str(rng.choice(["pin", "pin", "slider", "ball", "universal", "cylinder"])),
                      int(rng.integers(1, 6)), planar, may_bend=rng.random() < 0.5)
    if not planar and rng.random() < 0.5:
        _close_loops(b, rng, tips, with_ground=True)
    _add_internal_connectors(b, rng, tips, with_ground=True)
    _add_drives(b, rng, tips)
    _add_friction(b, rng, tips)
    _add_states(b, rng)
    _add_events(b, rng, [joint for _, joint, *_ in tips if joint])
    _add_rates(b, rng)


def _make_isolated(b: Builder, rng) -> None:
    """Bodies without external loads, free or on one joint: internal forces conserve momentum about free axes."""
    type = str(rng.choice(["free", "pin", "pin", "slider", "cylinder", "planar", "ball"]))
    point, axis = rng.uniform(-0.5, 0.5, 3), _unit_vector(rng)
    mobilizer = None
    if type == "free" or rng.random() < 0.3:
        mobilizer = (lambda R, x: {"type": "free"}) if type == "free" else lambda R, x: b.mobilize(type, None, R, x, point, axis)
    first_end = point + 0.4 * _unit_vector(rng)
    root = _add_rigid_bar(b, rng, point, first_end, mobilizer)
    if mobilizer is None:
        b.add_joint(type, None, root, point, axis)
    elif type != "free":
        b.probe_mobilizer(root, type)
    b.facts.conserved = _list_conserved(type, point, axis)
    if type == "pin" and rng.random() < 0.5:
        b.set_gravity(9.8 * axis)
        b.facts.axis_of_rotation = tuple(axis)
    tips = _grow_tree(b, rng, root, first_end, _draw_type(rng), int(rng.integers(1, 4)), False, may_bend=rng.random() < 0.5)
    tips.insert(0, (root, None, None, first_end))
    if rng.random() < 0.4:
        _close_loops(b, rng, tips, with_ground=False)
    inner = [joint for _, joint, *_ in tips if joint]
    _add_internal_connectors(b, rng, tips, with_ground=False)
    if rng.random() < 0.4:
        _add_motion(b, rng, inner)
    _add_states(b, rng)
    _add_events(b, rng, inner)
    if type == "free":
        b.keys["initial"]["bodies"][root.name] = {"velocity": [b.view.length * v for v in b.view.direction(rng.normal(size=3))],
                                                  "angular_velocity": b.view.direction(rng.normal(size=3) * 3)}
    _add_rates(b, rng)


def _list_conserved(type: str, point, axis) -> list:
    across = frame_along(axis, 2)[:, :2].T
    linear = {"free": [X, Y, Z], "slider": [axis], "cylinder": [axis], "planar": list(across)}.get(type, [])
    angular = {"free": [X, Y, Z], "pin": [axis], "cylinder": [axis], "planar": [axis], "ball": [X, Y, Z]}.get(type, [])
    return [Conserved("linear", a, point) for a in linear] + [Conserved("angular", a, point) for a in angular]


def _make_four_bar(b: Builder, rng) -> None:
    """Three bars in a plane between two bearings: all pins are along z, so out-of-plane reactions are indeterminate."""
    b.facts.is_redundant = True
    b.facts.axis_of_rotation = (0.0, 1.0, 0.0)
    b.set_gravity([0, -9.8, 0])
    A, B = np.array([0.0, 0, 0.2]), np.array([0.0, 0.15, 0.2])
    bar = BARS[0] if rng.random() < 0.4 else None
    length = bar.length if bar else rng.uniform(0.4, 0.6)
    C = B + length * np.array([np.cos(0.4), np.sin(0.4), 0])
    D = np.array([rng.uniform(0.35, 0.45), 0, 0.2])
    crank = _add_rigid_bar(b, rng, A, B)
    coupler = _add_flexible_bar(b, rng, B, C - B, bar) if bar else _add_rigid_bar(b, rng, B, C)
    rocker = _add_rigid_bar(b, rng, C, D)
    main = b.add_joint("pin", None, crank, A, Z)
    b.add_joint("pin", crank, coupler, B, Z)
    b.add_joint("pin", coupler, rocker, C, Z)
    pivot = b.add_joint("pin", None, rocker, D, Z)
    b.has_loop = True
    tips = [(crank, main, None, B), (coupler, None, crank, C), (rocker, pivot, None, C)]
    _add_internal_connectors(b, rng, tips, with_ground=True)
    _add_drives(b, rng, tips[:1])
    _add_states(b, rng)
    _add_events(b, rng, [main])
    if not b.keys["motions"]:
        b.keys["initial"]["rates"][main.name] = float(rng.uniform(-8, 8))


def _make_slider_crank(b: Builder, rng) -> None:
    """A slider-crank whose rod has a ball at one end and a universal joint at the other: not redundant."""
    b.set_gravity([0, -9.8, 0])
    A, B = np.zeros(3), np.array([0.1 * np.cos(0.5), 0.1 * np.sin(0.5), 0])
    bar = BARS[rng.integers(2)] if rng.random() < 0.5 else None
    length = bar.length if bar else rng.uniform(0.3, 0.5)
    C = np.array([B[0] + np.sqrt(length**2 - B[1]**2), 0, 0])
    crank = _add_rigid_bar(b, rng, A, B)
    rod = _add_flexible_bar(b, rng, B, C - B, bar) if bar else _add_rigid_bar(b, rng, B, C)
    piston = _add_rigid_bar(b, rng, C, C + [0.1, 0, 0])
    main = b.add_joint("pin", None, crank, A, Z)
    b.add_joint("ball", crank, rod, B, Z)
    b.add_joint("universal", piston, rod, C, X)
    guide = b.add_joint("slider", None, piston, C, X)
    b.has_loop = True
    tips = [(crank, main, None, B), (rod, None, crank, C), (piston, guide, None, C)]
    _add_internal_connectors(b, rng, tips, with_ground=True)
    _add_drives(b, rng, tips[:1])
    _add_friction(b, rng, tips)
    _add_states(b, rng)
    _add_events(b, rng, [main])
    if not b.keys["motions"]:
        b.keys["initial"]["rates"][main.name] = float(rng.uniform(-20, 20))


def _make_carts(b: Builder, rng) -> None:
    """Coupled carts on a rail, on springs, under loads and motors; released, and coupled again where they meet."""
    axis = X
    carts = [_add_rigid_bar(b, rng, [0, 0, 0.1 * k], [0.2, 0.1, 0.1 * k]) for k in range(2)]
    rails = [b.add_joint("slider", None, cart, cart.x, axis) for cart in carts]
    hook = b.add_joint("weld", carts[0], carts[1], carts[0].x, axis)
    b.facts.is_redundant = True
    c, r = b.probe("xb_minus_xa", {"expression": f"{rails[1].probes[0]} - {rails[0].probes[0]}"}, "position", length=1), rails[1]
    b.keys["initial"]["joints"] = {rail.name: 0 for rail in rails} if rng.random() < 0.5 else {}
    stiffness = float(rng.uniform(200, 2000))
    start = float(rng.uniform(0.02, 0.08))
    b.keys["connectors"]["pull"] = {"type": "spring", "between": [b.frame(None, carts[1].x + [0.5, 0, 0]), b.frame(carts[1], carts[1].x)],
                                    "stiffness": b.parameter(stiffness, 1), "free_length": b.parameter(0.3, 0, 1)}
    _add_spring_potential(b, "pull", stiffness, 0.3)
    _add_internal_connectors(b, rng, [(carts[0], None, None, carts[0].x), (carts[1], None, None, carts[1].x)], with_ground=True)
    actions = [{"release": hook.name}]
    if rng.random() < 0.5:
        b.keys["motions"]["hold"] = {"joint": rails[0].name, "position": 0}
        actions.append({"release": "hold"})
        b.facts.driven = []
    go, catch = b.names.take(), b.names.take()
    b.keys["events"][go] = {"when": f"t > {start!r}", "once": True, "do": actions}
    b.keys["states"]["apart"] = {"hysteresis": {"input": c, "lower": float(b.number(-1e3, 0, 1)), "upper": float(b.number(0.005, 0, 1))}}
    b.keys["events"][catch] = {"when": f"{c} <= 0 && apart > 0.5", "once": True, "do": [{"engage": hook.name}]}
    b.facts.actions.update({go: actions, catch: [{"engage": hook.name}]})
    b.facts.jumps.append(start)
    _add_loads(b, rng, carts)
    _add_states(b, rng)


def _make_winch(b: Builder, rng) -> None:
    """A driven drum makes several turns and winds up the rope of a load; later static analyses keep its turns."""
    b.set_gravity([0, -9.8, 0])
    drum = _add_rigid_bar(b, rng, [0, 0, 0], [0.2, 0, 0])
    load = _add_rigid_bar(b, rng, [0.5, -1, 0], [0.5, -1.2, 0])
    shaft = b.add_joint("pin", None, drum, [0, 0, 0], Z)
    b.add_joint("slider", None, load, [0.5, -1, 0], Y)
    turn, radius, w = rng.choice([-1, 1]) * rng.uniform(2.5, 30), rng.uniform(0.005, 0.02), float(rng.uniform(30, 100))
    formula = f"step(t, 0, 0, 0.3, {float(turn)!r})"
    b.keys["motions"]["drive"] = {"joint": shaft.name, "position": formula}
    b.facts.driven.append((shaft.probes[0], formula))
    b.facts.moves_by_time, b.facts.is_conservative = True, False
    drum_angle = b.names.take(stands_in_law=True)
    b.keys["probes"][drum_angle] = {"coordinate": shaft.name}
    stiffness, damping = b.number(load.mass * w**2, 1), b.number(0.2 * load.mass * w, 1)
    b.keys["connectors"]["rope"] = {
        "type": "spring", "between": [b.frame(None, [0.5, 0, 0]), b.frame(load, [0.5, -1, 0])],
        "law": f"{stiffness}*(length - {b.number(1, 0, 1)} + {b.number(radius, 0, 1)}*{drum_angle}) + {damping}*rate"}
    b.facts.has_statics = True
    _add_states_without_samples(b, rng)


# ---- forces, motions and events


def _add_spring_potential(b: Builder, name: str, stiffness: float, free_length: float) -> None:
    """Records the potential energy of a built-in spring as a function of its length."""
    between = b.keys["connectors"][name]["between"]
    probe = b.probe(f"{name}_l", {"distance": between}, "position", length=1)
    k, l0 = stiffness * b.view.mass, free_length * b.view.length
    b.facts.potentials.append(lambda run: 0.5 * k * (run[probe] - l0) ** 2)


def _add_internal_connectors(b: Builder, rng, tips, with_ground: bool) -> None:
    """Up to three connectors of any kind between bodies (or Ground)."""
    makers = [_add_spring, _add_law_spring, _add_bushing, _add_torsion_spring, _add_stop, _add_actuator, _add_motor]
    for k in range(rng.integers(0, 4)):
        maker = makers[rng.integers(len(makers))]
        ends = list(rng.permutation(len(tips)))[:2]
        first = tips[ends[0]]
        second = tips[ends[1]] if len(ends) > 1 else None
        if with_ground and (second is None or rng.random() < 0.5):
            second = (None, None, None, first[3] + rng.normal(size=3) * 0.5)
        if second is not None:
            maker(b, rng, f"c{k}", first, second)


def _add_spring(b, rng, name, first, second) -> None:
    stiffness, free, damping = float(rng.uniform(20, 2000)), float(rng.uniform(0.1, 0.6)), float(rng.choice([0, 0, 5]))
    start = second[3] + [0.3, 0, 0] if np.linalg.norm(second[3] - first[3]) < 0.1 else second[3]
    b.keys["connectors"][name] = {"type": "spring", "between": [b.frame(second[0], start), b.frame(first[0], first[3])],
                                  "stiffness": b.parameter(stiffness, 1), "free_length": b.parameter(free, 0, 1),
                                  "damping": b.parameter(damping, 1)}
    _add_spring_potential(b, name, stiffness, free)
    _add_ends(b, name)
    b.facts.is_conservative &= damping == 0


def _add_law_spring(b, rng, name, first, second) -> None:
    start = second[3] + [0.3, 0, 0]
    stiffness, damping = b.number(rng.uniform(20, 1000), 1), b.number(rng.uniform(0, 10), 1)
    b.keys["connectors"][name] = {"type": "spring", "between": [b.frame(second[0], start), b.frame(first[0], first[3])],
                                  "law": f"{stiffness}*(length - {b.number(0.3, 0, 1)}) + {damping}*rate"}
    _add_ends(b, name)
    b.facts.is_conservative = False


def _add_ends(b: Builder, name: str) -> None:
    ends = b.keys["connectors"][name]["between"]
    b.facts.springs.append([b.probe(f"{name}_{k}", {"position": end}, "position", 0, 1, False) for k, end in enumerate(ends)])


def _add_bushing(b, rng, name, first, second) -> None:
    R = frame_along(_unit_vector(rng), 2)
    stiffness = [float(b.number(rng.uniform(0.5, 20), 1, 2)) for _ in range(3)] + [float(b.number(rng.uniform(50, 1000), 1)) for _ in range(3)]
    damping = float(rng.choice([0, 0, 0.01]))
    b.keys["connectors"][name] = {"type": "bushing", "between": [b.frame(second[0], first[3], R), b.frame(first[0], first[3], R)],
                                  "stiffness": stiffness, "damping": [damping * k for k in stiffness]}
    ends = b.keys["connectors"][name]["between"]
    b.facts.bushings.append(b.probe(f"{name}_turn", {"orientation": ends[1], "relative_to": ends[0]}, "angle"))
    b.facts.has_formula_potential = False
    b.facts.is_conservative &= damping == 0


def _add_torsion_spring(b, rng, name, first, second) -> None:
    pins = [joint for joint in b.joints if joint.type == "pin" and joint.bodies[0] is not None or joint.type == "pin" and second[0] is None]
    if not pins:
        return
    pin = pins[rng.integers(len(pins))]
    frames = [dict(frame) for frame in _turned_frames(b, pin)]
    b.facts.sprung.add(pin.name)
    entry = {"type": "torsion_spring", "between": frames}
    if rng.random() < 0.5:
        stiffness = float(rng.uniform(1, 50))
        entry.update(stiffness=b.parameter(stiffness, 1, 2))
        probe, unit = pin.probes[0], b.view.unit(1, 2)
        b.facts.potentials.append(lambda run: 0.5 * stiffness * unit * run[probe] ** 2)
    else:
        entry["law"] = f"{b.number(rng.uniform(1, 50), 1, 2)}*angle + {b.number(rng.uniform(0, 1), 1, 2)}*speed"
        b.facts.is_conservative = False
    b.keys["connectors"][name] = entry


def _turned_frames(b: Builder, joint):
    """The two frames of a joint with z along its axis, coincident as placed: the angle between them starts at 0."""
    R = frame_along(joint.axis, 2)
    return [b.frame(body, joint.point, R) for body in joint.bodies]


def _add_stop(b, rng, name, first, second) -> None:
    normal = _unit_vector(rng)
    point = first[3] - normal * rng.uniform(0.02, 0.2)
    b.keys["connectors"][name] = {"type": "stop", "between": [b.frame(second[0], point, frame_along(normal, 2)), b.frame(first[0], first[3])],
                                  "stiffness": b.parameter(rng.uniform(1e3, 1e4), 1),
                                  "dissipation": float(rng.choice([0, 0.5])) / b.view.length}
    b.facts.has_impact = True
    b.facts.has_formula_potential = False
    b.facts.is_conservative &= b.keys["connectors"][name]["dissipation"] == 0


def _add_actuator(b, rng, name, first, second) -> None:
    start = second[3] + [0, 0.3, 0]
    b.keys["connectors"][name] = {"type": "actuator", "between": [b.frame(second[0], start), b.frame(first[0], first[3])],
                                  "law": f"{b.number(rng.uniform(-100, 100), 1)}*({b.number(0.3, 0, 1)} - length) - {b.number(2, 1)}*rate"}
    b.facts.is_conservative = False


def _add_motor(b, rng, name, first, second) -> None:
    joints = [joint for joint in b.joints if joint.probes and (joint.bodies[0] is not None or second[0] is None) and joint.type != "screw"]
    if not joints:
        return
    joint = joints[rng.integers(len(joints))]
    turns = joint.type == "pin"
    unit = (1, 2) if turns else (1, 0)
    place, speed = ("angle", "speed") if turns else ("length", "rate")
    target = rng.uniform(-1, 1) * (1 if turns else b.view.length)
    b.keys["connectors"][name] = {"type": "motor", "joint": joint.name,
                                  "law": f"{b.number(rng.uniform(0, 20), *unit)}*({target!r} - {place}) - {b.number(rng.uniform(0, 1), *unit)}*{speed}"}
    b.facts.is_conservative = False


def _add_drives(b: Builder, rng, tips) -> None:
    """External loads and prescribed motions."""
    if rng.random() < 0.6:
        _add_loads(b, rng, [tip[0] for tip in tips])
    if rng.random() < 0.4:
        _add_motion(b, rng, [joint for _, joint, *_ in tips if joint])


def _add_loads(b: Builder, rng, bodies) -> None:
    body = bodies[rng.integers(len(bodies))]
    shapes = ["sin({w}*t)", "if(t < {T}, 1, -0.5)", "pulse(t, {T}, {T2})", "step(t, 0, 0, {T2}, 1)", "1"]
    T = float(np.round(rng.uniform(0.05, 0.2), 4)) + 0.00037
    shape = str(rng.choice(shapes)).format(w=repr(float(rng.uniform(5, 40))), T=T, T2=T + 0.1)
    b.facts.jumps += [T] if "if" in shape else [T, T + 0.1] if "pulse" in shape else []
    force, torque = rng.normal(size=3) * 5, rng.normal(size=3)
    follows = rng.random() < 0.4
    turn = (lambda v: v) if follows else b.view.direction
    entry = {"on": b.frame(body, body.x if body.bar is None else body.x, None if not follows else body.R),
             "force": [f"{b.number(f, 1, 1)}*{shape}" for f in turn(force)]}
    if rng.random() < 0.5:
        entry["torque"] = [f"{b.number(f, 1, 2)}*{shape}" for f in turn(torque)]
    if follows:
        entry["axes"] = "frame"
    b.keys["loads"]["push"] = entry
    b.facts.is_conservative = False


def _add_motion(b: Builder, rng, joints) -> None:
    joints = [joint for joint in joints if joint.type in ("pin", "slider")]
    if not joints or "coupled" in b.keys["joints"]:
        return
    joint = joints[rng.integers(len(joints))]
    turns = joint.type == "pin"
    size = (rng.uniform(0.2, 1) if turns else rng.uniform(0.05, 0.2)) * (1 if turns else b.view.length)
    w = float(rng.uniform(3, 20))
    formulas = [f"{size!r}*(1 - cos({w!r}*t))", "0*t"]
    if turns:
        formulas += [f"{3 * w!r}*t", f"step(t, 0, 0, 0.3, {float(rng.uniform(4, 12))!r})"]
    formula = str(rng.choice(formulas))
    b.keys["motions"]["drive"] = {"joint": joint.name, "position": formula}
    b.facts.moves_by_time = formula != "0*t"
    b.facts.driven.append((joint.probes[0], formula))
    b.facts.is_conservative &= not b.facts.moves_by_time
    b.probe("drive_f", {"driving": "drive"}, "force", 1, 2 if turns else 1)


def _add_friction(b: Builder, rng, tips) -> None:
    """Joints with friction, where their reactions are determinate."""
    if b.facts.is_redundant or rng.random() < 0.6:
        return
    for _, joint, *_ in tips:
        if joint and joint.type in ("pin", "slider") and rng.random() < 0.5 and not _is_driven(b, joint):
            friction = {"coulomb": float(rng.uniform(0.05, 0.3)), "static": float(rng.uniform(0.3, 0.4))}
            if joint.type == "pin":
                friction["radius"] = float(b.number(rng.uniform(0.01, 0.05), 0, 1))
            b.keys["joints"][joint.name]["friction"] = friction
            b.facts.has_friction = True
            b.facts.is_conservative = False


def _is_driven(b: Builder, joint) -> bool:
    return any(motion.get("joint") == joint.name for motion in b.keys["motions"].values())


def _add_states(b: Builder, rng) -> None:
    """States that observe quantities or count."""
    if rng.random() < 0.5:
        period = float(rng.choice([0.007, 0.01, 0.013]))
        counter = b.names.take()
        b.keys["states"][counter] = {"sample_and_hold": {"input": f"{counter} + 1", "period": period}}
        b.probe("counted", {"state": counter}, "discrete")
        b.facts.counters.append(("counted", period))
        b.facts.whole.append("counted")
    if rng.random() < 0.4:
        b.keys["states"]["wave"] = {"hysteresis": {"input": f"sin({float(rng.uniform(20, 60))!r}*t)", "lower": -0.5, "upper": 0.5}}
        b.probe("waved", {"state": "wave"}, "discrete")
        b.facts.whole.append("waved")
    _add_states_without_samples(b, rng)


def _add_states_without_samples(b: Builder, rng) -> None:
    if rng.random() < 0.4:
        name = b.names.take()
        joint = next((joint for joint in b.joints if joint.probes), None)
        watched = joint.probes[1] if joint else None
        length = b.quantities[watched].length if watched else 0
        b.keys["states"][name] = {"rate": f"{watched or 1}/{b.view.length**length!r} - 3*{name}", "initial": 0.1}
        b.probe("filtered", {"state": name}, "position")
        b.filter, b.filtered_joint = name, joint


def _add_events(b: Builder, rng, joints) -> None:
    """Timed events with every kind of action, and one that counts."""
    if rng.random() < 0.4:
        count = b.names.take()
        b.keys["events"][count] = {"when": f"sin({float(rng.uniform(20, 80))!r}*t) > 0.1"}
        b.probe("happened", {"expression": count}, "discrete")
        b.facts.whole.append("happened")
        b.facts.actions[count] = []
    joints = [joint for joint in joints if joint.type in ("pin", "slider", "screw", "cylinder", "universal")]
    actions = ["lock", "lock", "lock", "release", "set", "engage"]
    if joints and rng.random() < 0.7:
        joint = joints[rng.integers(len(joints))]
        action = str(rng.choice(actions))
        at, until = float(rng.uniform(0.05, 0.2)), float(rng.uniform(0.25, 0.38))
        if action == "lock" and not _is_driven(b, joint) and "coupled" not in b.keys["joints"]:
            _add_event(b, f"t > {at!r}", [{"lock": joint.name}])
            if rng.random() < 0.6:
                _add_event(b, f"t > {until!r}", [{"unlock": joint.name}])
        elif action == "release" and not _is_driven(b, joint) and "coupled" not in b.keys["joints"] and b.title in ("tree", "isolated"):
            if joint.name not in b.facts.sprung and not any(
                    connector.get("joint") == joint.name for connector in b.keys["connectors"].values()):
                _add_event(b, f"t > {at!r}", [{"release": joint.name}])
        elif action == "engage" and _is_driven(b, joint):
            _add_event(b, f"t > {at!r}", [{"release": "drive"}])
            b.facts.driven = []
        elif action == "set" and hasattr(b, "filter"):
            _add_event(b, f"t > {at!r}", [{"set": b.filter, "to": f"{b.filter} + 1"}])


def _add_event(b: Builder, when: str, actions: list) -> None:
    name = b.names.take()
    b.keys["events"][name] = {"when": when, "once": True, "do": actions}
    b.facts.actions[name] = actions
    b.facts.jumps.append(float(when.split()[-1]))


def _add_rates(b: Builder, rng) -> None:
    """Initial rates of joints without a motion."""
    if rng.random() < 0.3:
        return
    for joint in b.joints:
        if joint.probes and joint.type != "screw" and not _is_driven(b, joint) and "coupled" not in b.keys["joints"]:
            fast = rng.random() < 0.2 and joint.type == "pin"
            rate = rng.uniform(-3, 3) if not fast else rng.choice([-1, 1]) * rng.uniform(20, 60)
            b.keys["initial"]["rates"][joint.name] = float(rate) * (b.view.length if joint.type == "slider" else 1)


def _are_rates_known(b: Builder) -> bool:
    """Whether initial rates determine all speeds, so that projection, whose weights depend on units, changes none."""
    rated = b.keys["initial"]["rates"]
    has_mobilizers = any("mobilizer" in body for body in b.keys["bodies"].values())
    return not (rated or b.facts.moves_by_time) or not has_mobilizers and all(
        joint.name in rated or joint.type == "weld" or _is_driven(b, joint) for joint in b.joints)


def _drop_released(b: Builder) -> None:
    """Coordinates of released joints are undefined after the release: they and their dependents are not compared."""
    released = {action["release"] for actions in b.facts.actions.values() for action in actions if "release" in action}
    for joint in b.joints:
        if joint.name in released:
            for probe in joint.probes:
                b.quantities.pop(probe, None)
            if getattr(b, "filtered_joint", None) is joint:
                b.quantities.pop("filtered")


# ---- probes and settings


def _add_probes(b: Builder) -> None:
    """States of all bodies, energies, momenta, reactions."""
    for body in b.bodies:
        name = body.name
        if body.bar is None:
            b.probe(f"{name}_x", {"position": name}, "position", 0, 1, False)
            b.probe(f"{name}_v", {"velocity": name}, "velocity", 0, 1, False)
            b.probe(f"{name}_o", {"orientation": name}, "angle", 0, 0, False)
            b.probe(f"{name}_w", {"angular_velocity": name}, "velocity", 0, 0, False)
            b.probe(f"{name}_a", {"acceleration": name, "component": "norm"}, "acceleration", 0, 1)
        b.probe(f"{name}_T", {"energy": "kinetic", "body": name}, "energy", 1, 2)
    for joint in b.joints:
        if not b.facts.is_redundant:
            b.probe(f"{joint.name}_f", {"reaction": joint.name, "component": "norm"}, "force", 1, 1)
            if joint.type not in ("ball", "rod", "point_in_plane"):
                b.probe(f"{joint.name}_t", {"reaction": joint.name, "part": "torque", "component": "norm"}, "force", 1, 2)
    for joint in b.joints:
        if joint.probes:   # a probe that has a name used in laws but is referred to by none
            b.keys["probes"][b.names.take()] = {"coordinate": joint.name}
            break
    for kind in ("kinetic", "potential", "work", "balance"):
        b.probe(kind[0].upper(), {"energy": kind}, "energy", 1, 2, kind == "kinetic")
    b.probe("linear", {"momentum": "linear"}, "momentum", 1, 1, False)
    b.probe("angular", {"momentum": "angular"}, "momentum", 1, 2, False)


def _add_solver(b: Builder, rng) -> None:
    b.keys["solver"] = {"accuracy": 1e-6 * b.view.length, "maximum_step": DURATION / ROWS, "threads": 1}
    b.keys["analyses"] = {"run": {"type": "transient", "duration": DURATION, "interval": DURATION / ROWS},
                          "on": {"type": "transient", "from": "run", "duration": DURATION / 4, "interval": DURATION / ROWS}}
    if b.facts.has_statics:
        on = b.keys["analyses"].pop("on")
        b.keys["analyses"].update(rest={"type": "static", "from": "run"}, on={**on, "from": "rest"})
