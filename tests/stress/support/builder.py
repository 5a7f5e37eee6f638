"""Builds a model file's keys: with another origin, rotated axes, other units of length and mass, or other names.

Everything is given in the units and axes of one nominal mechanism; a View says how the model file shows it. Two models
of one mechanism with different Views have the same motion, and a Quantity says how the values of a probe compare.
"""

import copy
import dataclasses
import math

import numpy as np

# Names that laws, constants or the program itself also use elsewhere.
OWN_QUANTITIES = ["speed", "length", "angle", "rate"]
OTHER_NAMES = ["force", "torque", "position", "velocity", "energy", "work", "gap", "damping", "stiffness", "time", "state", "load",
               "x", "y", "z", "e", "q", "u", "mass", "axis", "norm", "run", "initial"]


@dataclasses.dataclass(frozen=True)
class View:
    """How a mechanism is written down: x_shown = length (rotation x + shift)."""

    rotation: tuple = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    shift: tuple = (0.0, 0.0, 0.0)
    length: float = 1.0
    mass: float = 1.0
    plain_names: bool = False

    @property
    def R(self) -> np.ndarray:
        return np.array(self.rotation)

    def point(self, x) -> list:
        """A point of Ground."""
        return _numbers(self.length * (self.R @ np.asarray(x, float) + np.array(self.shift)))

    def direction(self, x) -> list:
        """A direction, angular velocity … in Ground's axes."""
        return _numbers(self.R @ np.asarray(x, float))

    def local(self, x) -> list:
        """A position in a body's own axes."""
        return _numbers(self.length * np.asarray(x, float))

    def unit(self, mass: int, length: int) -> float:
        """The factor of a quantity in kg^mass m^length s^n: (1, 1) for a force, (1, 2) for an energy."""
        return self.mass**mass * self.length**length


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A probe's kind, its powers of mass and length, and whether it is independent of axes and origin."""

    kind: str  # position, velocity, acceleration, force, energy, discrete, momentum
    mass: int = 0
    length: int = 0
    is_invariant: bool = True


@dataclasses.dataclass
class Body:
    name: str
    R: np.ndarray  # 3×3, axes of the body in Ground, as placed
    x: np.ndarray  # origin
    bar: object = None  # parts.Bar of a flexible body
    mass: float = 0
    center: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))  # of mass, in the body's axes
    inertia: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((3, 3)))  # about it

    def to_local(self, point) -> np.ndarray:
        return self.R.T @ (np.asarray(point) - self.x)


@dataclasses.dataclass
class Joint:
    name: str
    type: str
    bodies: tuple  # of Body or None (Ground)
    point: np.ndarray
    axis: np.ndarray
    probes: list = dataclasses.field(default_factory=list)  # names of (coordinate, rate), for one degree of freedom

    @property
    def freedom(self) -> int:
        return {"weld": 0, "pin": 1, "slider": 1, "screw": 1, "cylinder": 2, "universal": 2, "ball": 3, "planar": 3, "free": 6}[self.type]


@dataclasses.dataclass
class Conserved:
    """A conserved momentum: linear along `axis`, or angular about the axis through `point`."""

    kind: str
    axis: np.ndarray
    point: np.ndarray


@dataclasses.dataclass
class Facts:
    """Properties of a mechanism that checks rely on."""

    conserved: list = dataclasses.field(default_factory=list)
    is_conservative: bool = True  # no loads and no dissipation: T + V is constant
    is_redundant: bool = False  # reactions are not determined
    has_friction: bool = False
    has_impact: bool = False  # stops
    moves_by_time: bool = False  # a prescribed motion that moves
    has_formula_potential: bool = True  # V is known by formulas
    jumps: list = dataclasses.field(default_factory=list)  # times at which loads or samples jump
    whole: list = dataclasses.field(default_factory=list)  # probes whose values are whole numbers
    driven: list = dataclasses.field(default_factory=list)  # (probe, formula of t in Python): a prescribed coordinate
    counters: list = dataclasses.field(default_factory=list)  # (probe, period): grows by 1 each period
    potentials: list = dataclasses.field(default_factory=list)  # functions of the probes: potential energy of connectors
    bushings: list = dataclasses.field(default_factory=list)  # probes of their angles
    springs: list = dataclasses.field(default_factory=list)  # probes of the positions of their two ends
    sprung: set = dataclasses.field(default_factory=set)  # joints about whose axes torsion springs act
    actions: dict = dataclasses.field(default_factory=dict)  # event → list of its actions
    has_known_rates: bool = True  # initial speeds are determined by initial rates
    has_statics: bool = False  # a static analysis follows the motion
    axis_of_rotation: tuple = (0.0, 1.0, 0.0)  # the model may be turned about it


class Names:
    """Names of quantities in formulas: dangerous ones, or plain ones."""

    def __init__(self, rng: np.random.Generator, plain: bool):
        self._plain = plain
        self._own = list(rng.permutation(OWN_QUANTITIES))
        self._other = list(rng.permutation(OTHER_NAMES))
        self._rng = rng
        self._count = 0

    def take(self, stands_in_law: bool = False) -> str:
        """A new name. In a connector's law it is not one of the law's own quantities, which take precedence there."""
        self._count += 1
        source = self._own if not stands_in_law and self._rng.random() < 0.6 else self._other
        danger = source.pop() if source and self._rng.random() < 0.7 else None
        return f"name{self._count}" if self._plain or danger is None else str(danger)


class Builder:
    """A model under construction: its keys, bodies and joints, the quantities of its probes, and its facts."""

    def __init__(self, view: View, rng_of_names: np.random.Generator):
        self.view = view
        self.names = Names(rng_of_names, view.plain_names)
        self.keys = {"simflex": 1, "parameters": {}, "bodies": {}, "joints": {}, "motions": {}, "loads": {}, "connectors": {},
                     "inputs": {}, "states": {}, "events": {}, "initial": {"rates": {}, "bodies": {}}, "probes": {},
                     "solver": {}, "analyses": {}}
        self.bodies: list[Body] = []
        self.joints: list[Joint] = []
        self.quantities: dict[str, Quantity] = {}
        self.facts = Facts()
        self.gravity = np.zeros(3)

    # ---- values

    def number(self, value: float, mass: int = 0, length: int = 0) -> str:
        """A number as text for a formula."""
        return repr(float(value) * self.view.unit(mass, length))

    def parameter(self, value: float, mass: int = 0, length: int = 0) -> str:
        """Adds a value to `parameters`; returns the formula that names it."""
        name = self.names.take()
        self.keys["parameters"][name] = float(value) * self.view.unit(mass, length)
        return name

    # ---- bodies and frames

    def set_gravity(self, gravity) -> None:
        self.gravity = np.asarray(gravity, float)
        self.keys["gravity"] = _numbers(self.view.length * (self.view.R @ self.gravity))

    def _place(self, R, x) -> dict:
        return {"position": self.view.point(x), "rotation": {"quaternion": to_quaternion(self.view.R @ R)}}

    def add_rigid(self, mass: float, R, x, center, inertia, mobilizer: dict = None) -> Body:
        """@param inertia  3×3 about the centre of mass, in the body's axes"""
        body = Body(f"b{len(self.bodies)}", np.asarray(R), np.asarray(x), None, mass, np.asarray(center), np.asarray(inertia))
        unit = self.view.unit(1, 2)
        six = [inertia[0][0], inertia[1][1], inertia[2][2], inertia[0][1], inertia[0][2], inertia[1][2]]
        self.keys["bodies"][body.name] = {
            "mass": float(mass) * self.view.mass, "center_of_mass": self.view.local(center),
            "inertia": [float(value) * unit for value in six], "place": self._place(R, x)}
        if mobilizer:
            self.keys["bodies"][body.name]["mobilizer"] = mobilizer
        self.bodies.append(body)
        return body

    def add_flexible(self, bar, R, x, damping: float) -> Body:
        body = Body(f"b{len(self.bodies)}", np.asarray(R), np.asarray(x), bar, bar.mass)
        self.keys.setdefault("parts", {})[bar.name] = {"file": f"../parts/{bar.name}.h5"}
        self.keys["bodies"][body.name] = {"part": bar.name, "damping": damping, "place": self._place(R, x)}
        self.bodies.append(body)
        return body

    def frame(self, body: Body, point, R=None):
        """A frame at a point of Ground, as placed; on a flexible body it is fixed to the nearest interface."""
        turned = {} if R is None else {"rotation": {"quaternion": to_quaternion((self.view.R if body is None else body.R.T) @ R)}}
        if body is None:
            return {"on": "ground", "position": self.view.point(point), **turned}
        local = body.to_local(point)
        if body.bar is None:
            return {"on": body.name, "position": self.view.local(local), **turned}
        end = 0 if local[0] < body.bar.length / 2 else body.bar.length
        interface = f"{body.name}.{'near' if end == 0 else 'far'}"
        return {"on": interface, "position": self.view.local(local - [end, 0, 0]), **turned}

    # ---- joints

    def add_joint(self, type: str, first: Body, second: Body, point, axis, apart: float = 0, **more) -> Joint:
        """@param apart  distance of F from M along the axis, as placed"""
        joint = Joint(f"j{len(self.joints)}", type, (first, second), np.asarray(point), np.asarray(axis))
        entry = {"type": type, "between": [self.frame(first, joint.point - apart * joint.axis), self.frame(second, point)], **more}
        if type == "universal":   # its two axes are those of the frames
            R = frame_along(axis, 2)
            entry["between"] = [self.frame(first, point, R), self.frame(second, point, R)]
        elif type in ("pin", "slider", "cylinder", "planar", "screw"):
            entry["axis"] = self.view.direction(axis)
        elif type != "rod":
            entry["as_placed"] = True
        self.keys["joints"][joint.name] = entry
        self.joints.append(joint)
        if type in ("pin", "slider", "screw"):
            joint.probes = self._probe_coordinate(joint.name, joint.name, type)
        return joint

    def mobilize(self, type: str, parent: Body, R, x, point, axis) -> dict:
        """The key `mobilizer` of a rigid body that will be placed at R, x."""
        frame = frame_along(axis, 0 if type == "slider" else 2)
        inboard, outboard = np.eye(3) if parent is None else parent.R, np.asarray(R)
        at = self.view.point(point) if parent is None else self.view.local(parent.to_local(point))
        turn = self.view.R @ frame if parent is None else inboard.T @ frame
        return {"type": type, "parent": "ground" if parent is None else parent.name,
                "inboard": {"position": at, "rotation": {"quaternion": to_quaternion(turn)}},
                "outboard": {"position": self.view.local(outboard.T @ (np.asarray(point) - x)),
                             "rotation": {"quaternion": to_quaternion(outboard.T @ frame)}}}

    def _probe_coordinate(self, name: str, of, type: str) -> list:
        length = 1 if type == "slider" else 0
        return [self.probe(f"{name}_q", {"coordinate": of}, "position", length=length),
                self.probe(f"{name}_u", {"rate": of}, "velocity", length=length)]

    def probe_mobilizer(self, body: Body, type: str) -> None:
        if type in ("pin", "slider"):
            self._probe_coordinate(body.name, {"body": body.name}, type)

    # ---- probes

    def probe(self, name: str, keys: dict, kind: str, mass: int = 0, length: int = 0, is_invariant: bool = True) -> str:
        self.keys["probes"][name] = keys
        self.quantities[name] = Quantity(kind, mass, length, is_invariant)
        return name

    def has_flexible(self) -> bool:
        return any(body.bar for body in self.bodies)

    def to_dict(self) -> dict:
        """A copy of the model file's keys, without empty ones."""
        keys = copy.deepcopy({name: value for name, value in self.keys.items() if value != {}})
        initial = {name: value for name, value in keys.pop("initial").items() if value}
        return {**keys, "initial": initial} if initial else keys


def _numbers(vector) -> list:
    return [float(x) for x in vector]


def to_quaternion(R) -> list:
    """[w, x, y, z] of a rotation matrix."""
    R = np.asarray(R)
    four = np.array([[R[0, 0] + R[1, 1] + R[2, 2], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
                     [0, R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]],
                     [0, 0, R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1]],
                     [0, 0, 0, R[2, 2] - R[0, 0] - R[1, 1]]])
    vector = np.linalg.eigh(four + np.triu(four, 1).T)[1][:, -1]
    return _numbers(vector if vector[0] >= 0 else -vector)


def to_rotation(axis, angle: float) -> np.ndarray:
    """The rotation about an axis (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


def frame_along(axis, number: int) -> np.ndarray:
    """Some rotation whose axis of this number points along `axis`."""
    along = np.asarray(axis, float) / np.linalg.norm(axis)
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    across /= np.linalg.norm(across)
    columns = [along, across, np.cross(along, across)]
    return np.array([columns[(k - number) % 3] for k in range(3)]).T
