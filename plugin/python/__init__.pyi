"""Types of the module simflex: written by write_types.py."""

from os import PathLike
from typing import Any, Dict, Iterator, List, Optional, Tuple, Union, overload

import numpy
from numpy.typing import NDArray

__version__: str


class ModelError(ValueError):
    """A model that cannot be read or built: names file, line, key and cure."""


class Cancelled(RuntimeError):
    """A run that its `progress` has ended; what was done is kept."""


class SimflexWarning(UserWarning):
    """What may change the meaning of results."""


class Analysis:
    """Results of one analysis; analysis['tip'] is a probe."""

    @property
    def name(self) -> str:
        ...

    @property
    def type(self) -> str:
        """transient, static, eigen, campbell …"""

    @property
    def is_complete(self) -> bool:
        ...

    @property
    def statistics(self) -> Dict[str, float]:
        ...

    @property
    def warnings(self) -> List[str]:
        ...

    @property
    def time(self) -> NDArray[numpy.float64]:
        """The n times of rows [s], of transient analyses."""

    @property
    def probes(self) -> List[str]:
        ...

    def __iter__(self) -> Iterator[str]:
        ...

    def __contains__(self, probe: str) -> bool:
        ...

    def __getitem__(self, probe: str) -> NDArray[numpy.float64]:
        """n numbers of a probe, or n×k of one with columns; SI units, see unit()."""

    def unit(self, probe: str) -> str:
        """Unit of a probe: m, rad/s …"""

    def columns(self, probe: str) -> List[str]:
        """Names of a probe's columns: x, y, z; one without name if it has one."""

    @property
    def q(self) -> NDArray[numpy.float64]:
        """Coordinates, n×nq."""

    @property
    def u(self) -> NDArray[numpy.float64]:
        """Speeds, n×nu."""

    @property
    def speeds(self) -> NDArray[numpy.float64]:
        """Speeds of a Campbell diagram [rad/s]."""

    @property
    def frequency(self) -> NDArray[numpy.float64]:
        """Frequencies [Hz]: modes of eigen, speeds × modes of campbell."""

    @property
    def damping_ratio(self) -> NDArray[numpy.float64]:
        ...

    @property
    def inputs(self) -> List[str]:
        """Of linear and frequency_response."""

    @property
    def outputs(self) -> List[str]:
        """Likewise."""

    @property
    def input_units(self) -> List[str]:
        ...

    @property
    def output_units(self) -> List[str]:
        ...

    @property
    def matrices(self) -> Dict[str, Any]:
        """A, B, C, D of linear, shapes of eigen; path of static: the loads' factor, unstable
        motions, 1 at a limit point and 2 at a bifurcation."""

    @property
    def response(self) -> NDArray[numpy.complex128]:
        """Of frequency_response: complex, frequencies×outputs×inputs."""

    @property
    def events(self) -> List[Tuple[str, float]]:
        """What has happened: (name, time [s]), in its order."""

    def plot(self, *args, axes: Any = None) -> Any:
        """Draws probes over the time, all or those named, into matplotlib's axes (the current
        ones); returns the axes. Needs matplotlib."""

    def to_pandas(self) -> Any:
        """All probes as columns of a pandas.DataFrame."""

    def __repr__(self) -> str:
        ...


class Results:
    """What a run leaves; results['run'] is an analysis."""

    @property
    def title(self) -> str:
        ...

    @property
    def warnings(self) -> List[str]:
        ...

    @property
    def analyses(self) -> List[str]:
        ...

    def __getitem__(self, analysis: str) -> Analysis:
        ...

    def __iter__(self) -> Iterator[str]:
        ...

    def __contains__(self, analysis: str) -> bool:
        ...

    def __len__(self) -> int:
        ...

    def __repr__(self) -> str:
        ...


class Model:
    """What a model file says; see the guide's reference of keys.

    Values are numbers, texts, lists, dicts, arrays and functions. Its attributes
    are the file's keys: model.gravity = [0, -9.81, 0]. Nothing is read or built
    before a Session or run() asks for it."""

    @overload
    def __init__(self) -> None:
        """An empty model."""
    @overload
    def __init__(self, path: Union[PathLike[str], str], settings: Dict[str, Any] = {}, **kwargs) -> None:
        """Model('ruler.yaml', {'solver.accuracy': 1e-7}, load=0.1): a file, with other values
        of keys, and of parameters by their names."""

    @staticmethod
    def from_dict(keys: Dict[str, Any], folder: Union[PathLike[str], str] = '.') -> Model:
        """From the keys of a model file. Relative paths begin in `folder`."""

    @staticmethod
    def from_text(text: str, folder: Union[PathLike[str], str] = '.') -> Model:
        """From the text of a model file."""

    def function(self, function: Any, name: str = '') -> Any:
        """Makes a function of numbers known to the model's formulas: '@model.function' before
        'def torque(angle, speed)', then model.set('loads.motor.torque', [0, 0, 'torque(angle,
        speed)']). As the value of a key it is called with what its parameters are named
        after. Each evaluation waits for Python (about 1 µs), and a Newton matrix takes two
        for each argument; with `sample_and_hold` one for each sample. Equal arguments are to
        give equal values."""

    def set(self, key: str, value: Any) -> None:
        """Sets the value of a key ('joints.bearing.axis')."""

    @property
    def path(self) -> str:
        ...

    @property
    def text(self) -> str:
        ...

    @property
    def settings(self) -> List[str]:
        ...

    def run(self, output: Optional[Union[PathLike[str], str]] = None, analyses: List[str] = [], threads: int = 0, resume: bool = False, pictures: bool = False, progress: Any = None, error_bar: bool = False, allow_fmus: bool = False, fmus_in_process: bool = False, fmu_timeout: float = 60.0) -> Results:
        """Runs the analyses (all, or those named) as `simflex run` does, and writes the file
        of results: beside the model unless `output` says where. Ctrl-C keeps what is done, and so
        does progress(what, fraction), told now and then, by returning False: Cancelled.
        With `error_bar` each probe has its error, 'tip error', by what parts have left out.
        FMUs of controllers are programs: they run if `allow_fmus` says so, each in a process
        of its own, which may take `fmu_timeout` seconds for an answer; with
        `fmus_in_process` in this one."""

    def analyse(self, type: str, allow_fmus: bool = False, **kwargs) -> Analysis:
        """Runs one analysis that the file need not have, with the keys of `analyses`, and
        returns its Analysis: analyse('campbell', parameter='speed', speeds=[0, 50, 100])."""

    def __copy__(self) -> Model:
        ...

    def __deepcopy__(self, arg0: Dict[str, Any]) -> Model:
        ...

    def __repr__(self) -> str:
        ...

    def __getattr__(self, arg0: str) -> Any:
        ...

    def __setattr__(self, arg0: str, arg1: Any) -> None:
        ...

    def __delattr__(self, arg0: str) -> None:
        ...

    def __dir__(self) -> List[Any]:
        ...

    def to_dict(self) -> Dict[str, Any]:
        """All that the file and later settings say; from_dict() takes it."""


class Keys:
    """What stands below a key of a model: model.bodies.rod.mass, with the keys of a model file.

    What is set is checked when the model is built, its keys at once; None stands for what
    is left to its default. Names that are no words of Python stand in brackets:
    model.analyses.run['from'].

    >>> import simflex
    >>> model = simflex.Model()
    >>> bob = model.bodies.add('bob', mass=1, inertia=[0.01, 0.01, 0.01])
    >>> bob.mass = 2
    >>> bob.place.position = [0, -1, 0]
    >>> model.bodies.bob
    <simflex.Keys bodies.bob: {'mass': 2, 'inertia': [0.01, 0.01, 0.01], 'place': {'position': [0, -1, 0]}}>"""

    def __getattr__(self, arg0: str) -> Any:
        ...

    def __getitem__(self, name: str) -> Any:
        ...

    def __setattr__(self, arg0: str, arg1: Any) -> None:
        ...

    def __setitem__(self, name: str, value: Any) -> None:
        ...

    def __delattr__(self, arg0: str) -> None:
        ...

    def __delitem__(self, name: str) -> None:
        ...

    def __contains__(self, arg0: str) -> bool:
        ...

    def __len__(self) -> int:
        ...

    def __iter__(self) -> Iterator[str]:
        ...

    def __dir__(self) -> List[Any]:
        ...

    def add(self, name: str, **kwargs) -> Keys:
        """Adds an entry to bodies, joints, loads …, with these keys, and returns it."""

    def to_dict(self) -> Dict[str, Any]:
        """A copy of what the file and later settings say; nothing of defaults."""

    def __repr__(self) -> str:
        ...


class Part:
    """A reduced part: modes in the mean-axis frame, origin at the centre of mass.

    Arrays are views that keep the part's memory; they cannot be written to."""

    def __init__(self, path: Union[PathLike[str], str]) -> None:
        """Reads a file that `simflex reduce` has written."""

    def write(self, path: Union[PathLike[str], str]) -> None:
        """Writes a file that models take as a part."""

    @property
    def name(self) -> str:
        ...

    @property
    def mass(self) -> float:
        """[kg]"""

    @property
    def center_of_mass(self) -> NDArray[numpy.float64]:
        """In coordinates of the deck [m]."""

    @property
    def inertia(self) -> NDArray[numpy.float64]:
        """3×3, about the centre of mass [kg m²]."""

    @property
    def num_modes(self) -> int:
        ...

    @property
    def frequencies(self) -> NDArray[numpy.float64]:
        """Frequencies of the modes [Hz]."""

    @property
    def shapes(self) -> NDArray[Any]:
        """3×nodes×modes: translations of the mesh's nodes for ξ = 1."""

    @property
    def interfaces(self) -> Dict[str, Any]:
        """By name: position [m], translation and rotation (3×modes), nodes."""

    @property
    def omega_squared(self) -> NDArray[Any]:
        """Stiffness of the modes, whose mass is 1 [1/s²]."""

    @property
    def I1(self) -> NDArray[Any]:
        """6×modes: first change of inertia, components xx yy zz xy xz yz."""

    @property
    def I2(self) -> Tuple[Any, ...]:
        """Second change of inertia: modes×modes for each of xx yy zz xy xz yz."""

    @property
    def N(self) -> Tuple[Any, ...]:
        """Σm(φᵢ × φⱼ): modes×modes for each of x, y, z."""

    @property
    def positions(self) -> NDArray[Any]:
        """3×nodes: of the mesh, from the centre of mass [m]."""

    @property
    def node_numbers(self) -> NDArray[Any]:
        """Of the deck."""

    @property
    def node_sets(self) -> Dict[str, Any]:
        """By name: indices of nodes, from 0."""

    @property
    def elements(self) -> Dict[str, Any]:
        """By type (tet4, hex20 …), in blocks: nodes of an element × elements, from 0."""

    @property
    def stress(self) -> Any:
        """None, or where the part knows it: nodes, stress [Pa] and strain of ξ = 1, both
        6×nodes×modes, components xx yy zz xy xz yz."""

    @property
    def stiffening(self) -> Any:
        """None, or geometric stiffness, modes×modes: `turning` by ω² of xx yy zz xy xz yz,
        `interfaces` by name for unit forces x, y, z and moments x, y, z."""

    @property
    def derivatives(self) -> Dict[str, Any]:
        """By parameter (thickness:SKIN), of the modes as they are: its value, unit, and K and M,
        modes×modes; dΩ²/dp = diag(K) − Ω² diag(M)."""

    def __repr__(self) -> str:
        ...


class Animation:
    """A video: notebooks show it."""

    @property
    def kind(self) -> str:
        """gif, webp or mp4"""

    @property
    def data(self) -> bytes:
        """Bytes of the file."""

    def _repr_html_(self) -> str:
        ...

    def __repr__(self) -> str:
        ...


class SavedState:
    """Where a Session was, to the last bit."""


class Session:
    """A model that moves: started, stepped, looked at, changed, kept, drawn.

    Quantities have names as at the prompt: session['joints.pin.angle'] is
    a number, session['tip'] a probe, and session['bodies.rod.position'] =
    [0, 1, 0] sets; joints stay closed. Other threads run while it moves."""

    def __init__(self, model: Model, rigid: bool = False, finer: bool = False, allow_fmus: bool = False, fmus_in_process: bool = False, fmu_timeout: float = 60.0) -> None:
        """Builds the model and goes to its start; `rigid` holds all flexible bodies rigid,
        `finer` gives them further modes: the error of one without is the difference of two
        that are moved alike. FMUs of controllers are programs: see Model.run()."""

    @property
    def time(self) -> float:
        """[s]"""

    @property
    def energy(self) -> float:
        """Kinetic and potential [J]."""

    @property
    def probes(self) -> List[str]:
        ...

    @property
    def quantities(self) -> List[str]:
        """Names of all that can be asked for beside probes and parameters."""

    def run(self, until: float, interval: Optional[float] = None, progress: Any = None) -> str:
        """Moves to a time [s] and records the probes at each interval [s]. Returns 'reached',
        or 'terminated' where an event has ended the motion. Ctrl-C stops where it is,
        and so does progress(fraction), told now and then, by returning False ('stopped')."""

    def step(self, duration: float) -> str:
        """Moves for a time [s]."""

    def take_steps(self, count: int = 1) -> str:
        """Takes steps of the integrator's own."""

    def reset(self) -> None:
        """Back to the start."""

    def settle(self) -> Any:
        """Goes to the nearest static equilibrium; returns iterations, and in words
        free_motions, which nothing holds, and unstable_motions, in which it falls away;
        by_damped_motion is true if Newton's iteration did not find it; branch warns if it had
        left for joints assembled in another way."""

    def get(self, path: str) -> Any:
        """A number, or an array."""

    def set(self, path: str, value: Any) -> None:
        """A number, or a sequence of as many as get() gives. The motion begins anew from there,
        with small steps."""

    def __getitem__(self, arg0: str) -> Any:
        ...

    def __setitem__(self, arg0: str, arg1: Any) -> None:
        ...

    def formula(self, formula: str) -> float:
        """Of probes, states, parameters and t as they are now."""

    def change(self, key: str, value: Any, go_on: bool = False) -> bool:
        """Gives a key of the model another value and builds it anew. It is back at its start
        then (returns True), unless nothing that moves has changed, or `go_on` is told: for
        inputs, such as the size of a load."""

    @property
    def record(self) -> Dict[str, Any]:
        """What run() has recorded, by name of probe, and 'time'."""

    def save(self) -> SavedState:
        """Where it is; what goes on from restore() has the same bits."""

    def restore(self, state: SavedState) -> None:
        """Back to where save() was; the record ends there."""

    def copy(self) -> Session:
        """Another Session at the same State."""

    def keep(self, path: Union[PathLike[str], str]) -> None:
        """Writes the State to a file."""

    def restore_kept(self, path: Union[PathLike[str], str]) -> None:
        """Goes to the State of a file."""

    def eigenmodes(self, count: Optional[int] = None) -> Any:
        """Natural modes about this State, an equilibrium or a steady motion: frequency [Hz],
        damping_ratio, eigenvalue [1/s], shape (speeds × modes); rigid-body modes first, of
        frequency 0. All of them, or rigid-body modes and the `count` slowest of the others, which
        is quick for many bodies."""

    def linearize(self, inputs: List[str], outputs: List[str] = [], form: str = 'full', modes: int = 0, up_to: float = 0.0) -> Any:
        """About this State, an equilibrium or a steady motion: ẋ = A x + B p, y = C x + D p.
        Inputs are numbers of the model ('loads.push.force.x'), outputs probes ('tip.y'; none:
        all). The form is full, modal (A block-diagonal) or minimal (what inputs reach and
        outputs see), of at most so many modes, or those up to a frequency [Hz]. Returns A, B,
        C, D, inputs, input_units, outputs, output_units."""

    @property
    def input_names(self) -> List[str]:
        """Of the model's `inputs`, in their order."""

    @property
    def inputs(self) -> NDArray[numpy.float64]:
        """Values of all inputs, in the order of input_names; what moves goes on with new ones."""

    @property
    def output_names(self) -> List[str]:
        """Columns of all probes: height, tip.x, tip.y …"""

    @property
    def outputs(self) -> NDArray[numpy.float64]:
        """Values of all probes now, in the order of output_names."""

    def drive(self, inputs: Any, interval: float, linear: bool = False) -> NDArray[numpy.float64]:
        """Moves on under n×inputs values, one row each interval [s]: held, or linear from one
        to the next. Returns outputs, n×columns, at the end of each interval; fewer where an
        event has ended the motion."""

    def picture(self) -> NDArray[numpy.uint8]:
        """As the model's `pictures` say: height×width×3 of 0…255."""

    def _repr_png_(self) -> bytes:
        ...

    def animation(self, path: Optional[Union[PathLike[str], str]] = None, rate: float = 25) -> Animation:
        """A video of the motion so far, which notebooks show: of at most 64 States, evenly
        chosen, at a rate [1/s]. With a path (.mp4, .gif, .webp) it is written there, too.
        Needs ffmpeg."""

    @property
    def events(self) -> List[Tuple[str, float]]:
        """What has happened in motions until now: (name, time [s]), in its order."""

    def to_pandas(self) -> Any:
        """What run() has recorded, as a pandas.DataFrame: columns as tip.x, by time [s]."""

    def analyse(self, type: str, **kwargs) -> Analysis:
        """As Model.analyse(), of the model as it is now, from its own start."""

    def __repr__(self) -> str:
        ...


def read_results(path: Union[PathLike[str], str], states: bool = True) -> Results:
    """Reads a file of results; without states q and u it takes less."""


def keys(path: str = '') -> str:
    """What may stand at and below a key of models: print(simflex.keys('joints'))."""


def schema() -> Any:
    """The JSON Schema of model files, as a dict."""


def reduce(name: str, folder: Union[PathLike[str], str] = '.', **kwargs) -> Part:
    """Reduces a finite element model; keys are those of `parts` in a model file:
    reduce('rod', deck='rod.inp', interfaces={'end': 'END'}, modes=30). What has been
    reduced before is taken from the cache. Relative paths begin in `folder`."""
