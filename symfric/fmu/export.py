"""Export of a model as a Functional Mock-up Unit for tools without Python and CasADi.

`running` loads a unit of FMI 3.0 through its C interface, as another tool does.
"""

import ctypes as c
import tempfile
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, final
from xml.etree import ElementTree as Xml
from zipfile import ZipFile

import numpy as np

from symfric.codegen.blocks.from_model import fixed_method
from symfric.emitter.c99 import filled
from symfric.fmu.equations import equations, fingerprint, header, source
from symfric.fmu.package import (
    SOURCES,
    compiled,
    described,
    fixed_text,
    packed,
    platform_name,
    shared_name,
    sources,
)
from symfric.fmu.variables import LARGEST_RTOL, LEAST_RTOL, Entry, entries
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import parameters
from symfric.integrator.methods.tableaux import ADAPTIVE
from symfric.model import Model, check_model
from symfric.scenes.base import Scene

KINDS = ("co-simulation", "model-exchange")
VERSIONS = (2, 3)


@final
@dataclass(frozen=True, eq=False)
class Exported:
    """Description of an exported unit.

    Attributes:
        path: path of the archive.
        size: size of the archive in bytes.
        fmi, kind: version of FMI and kind of the unit.
        identifier: name of the binary.
        variables: all variables.
        binary: name of the binary in the archive; empty without a compiler.
        missing: reason of a missing binary.
        method: formula of the steps.
        times: times [s] to write and to compile the C.
    """

    path: Path
    size: int
    fmi: int
    kind: str
    identifier: str
    variables: tuple[Entry, ...]
    binary: str
    missing: str
    method: str
    times: tuple[float, float]

    def count(self, causality: str) -> int:
        """Return the number of variables of a causality."""
        return sum(entry.causality == causality for entry in self.variables)

    def __str__(self) -> str:
        held = self.binary or f"sources only: {self.missing}"
        return (
            f"{self.path}: FMI {self.fmi}.0 {self.kind}, {self.size / 1024:.0f} kB, {held}\n"
            f"{self.count('input')} inputs, {self.count('output')} outputs, "
            f"{self.count('parameter')} parameters; {self.method}; C written in "
            f"{self.times[0]:.1f} s, compiled in {self.times[1]:.1f} s"
        )


def export_fmu(
    model: Model | Scene,
    path: str | Path,
    *,
    fmi: int = 3,
    kind: str = "co-simulation",
    rtol: float = 1e-6,
    step: float | None = None,
    method: str = "auto",
    free: Iterable[str] | None = None,
    t_end: float | None = None,
    name: str | None = None,
) -> Exported:
    """Write `model` as a Functional Mock-up Unit: sources and the binary of this platform.

    The unit contains the adaptive step of `simulate` as C, with the same bits. Inputs are held over
    a communication step, which may have any length: while no input jumps, steps pass communication
    points, and the polynomial of the step defines the values there. After a jump of an input or of
    a tunable parameter, the unit repeats the last step up to the point of the jump and solves the
    algebraic equations again. It locates events of the model and applies their resets. In FMI 3.0 a
    communication step ends at an event if the importer allows early returns.

    All unknowns may be set before the end of the initialisation. The others follow from them as in
    `simulate(x0=...)`: bristles start in steady sliding, algebraic variables solve their equations.

    Directional derivatives are exact; units of mechanisms with loops do not provide them.

    Limits: absolute tolerances are 0.1 rtol times the nominal values, also for much smaller motions
    (which `simulate` repeats); pivots are chosen at the start values; for events that depend on
    time only, the default experiment determines the longest step.

    Args:
        model: a model, or a scene, whose parameters become tunable.
        path: path of the archive, such as "drive.fmu".
        fmi: version of FMI, 2 or 3.
        kind: "co-simulation", which includes the integrator, or "model-exchange", which provides
            rates of the states and event indicators to the integrator of the importer and solves
            the algebraic equations. Rates of a mechanism with loops are those at the nearest closed
            state and lead to it within 20 ms; all coordinates of the mechanism remain states.
        rtol: relative tolerance; the importer can change it by the parameter `rtol` or by the
            tolerance of the experiment.
        step: length [s] of fixed steps without error control, as of `plant_block`. A communication
            step is divided into equal steps of at most this length.
        method: formula of the steps, as in `simulate`; with `step`, as in `plant_block`.
        free: parameters of a scene that become tunable; by default all except those with the value
            0, which omits a term. The tunable parameters of a model are `Model.p`.
        t_end: stop time [s] of the default experiment; default that of the scene, or 1 s.
        name: model identifier; default the name of the model.

    Returns:
        Description of the unit; `print` shows a summary.

    Raises:
        ValueError: bad input, or start values without consistent algebraic variables.
        CompileError: the compiler rejects the C.
    """
    where = "export_fmu"
    made, span = _model(where, model, free, t_end)
    target = checks.path(f"{where}: path", path)
    if target.suffix != ".fmu":
        raise ValueError(f"{where}: expected a path that ends in .fmu, got '{target}'")
    if fmi not in VERSIONS:
        raise ValueError(f"{where}: fmi: expected 2 or 3, got {fmi!r}")
    checks.choice(f"{where}: kind", kind, KINDS)
    rtol = checks.number(f"{where}: rtol", rtol, lower=LEAST_RTOL, upper=LARGEST_RTOL)
    identifier = checks.as_identifier(made.name)
    if name is not None:
        identifier = checks.identifier(f"{where}: name", name)
    exchange = kind == "model-exchange"
    if exchange and (step is not None or method != "auto"):
        raise ValueError(
            f"{where}: expected no step and no method for model exchange, where the importer "
            "integrates"
        )
    if step is None:
        checks.choice(f"{where}: method", method, ["auto", *ADAPTIVE])
    else:
        checks.number(f"{where}: step", step, unit="s", above=0.0)
        if made.events:
            raise ValueError(
                f"{where}: step: expected a model without events, got {len(made.events)}; leave "
                "the step adaptive, or use a smooth or bristle law"
            )
        method = fixed_method(where, made, method)
    begin = perf_counter()
    own = equations(made, rtol, step, method, span, exchange)
    model_c = source(own)
    shared = {f"fmi{fmi}.c": fixed_text(f"fmi{fmi}.c"), "model.c": model_c, "kind": kind}
    token = fingerprint(shared | {"sizes": header(own, ""), "unit": fixed_text("unit.c")})
    texts = sources(own, header(own, token), model_c, fmi)
    written, library = perf_counter(), shared_name(identifier)
    binary, missing = compiled(texts, library)
    times = written - begin, perf_counter() - written
    listed = entries(made, own.start, 0.0 if step else own.rtol, not own.has_loops, exchange)
    files: dict[str, str | bytes] = {
        "modelDescription.xml": described(own, identifier, token, listed, fmi),
        **{f"sources/{name}": text for name, text in texts.items()},
    }
    if fmi == 3:
        build = filled(SOURCES / "buildDescription.xml", identifier=identifier)
        files["sources/buildDescription.xml"] = build
    place = f"binaries/{platform_name(fmi)}/{library}" if binary else ""
    if binary:
        files[place] = binary
    size = packed(target, files)
    return Exported(target, size, fmi, kind, identifier, listed, place, missing, own.formula, times)


def _model(
    where: str, given: Model | Scene, free: Iterable[str] | None, t_end: float | None
) -> tuple[Model, tuple[float, float]]:
    """Return the model and the first and last time of its default experiment."""
    until = 1.0
    if isinstance(given, Scene):
        until = given.t_end
        known = parameters(given)
        numbers = {n: checks.as_number(p.value) for n, p in known.items()}
        names = [n for n, value in numbers.items() if value] if free is None else free
        given = given.model(names)
    elif free is not None:
        raise ValueError(
            f"{where}: free: expected with a scene only, got a model, whose parameters are in "
            "Model.p already"
        )
    check_model(where, given)
    if not given.x:
        raise ValueError(f"{where} '{given.name}': expected a model with states, got none")
    if t_end is not None:
        until = checks.number(f"{where}: t_end", t_end, unit="s", above=0.0)
    return given, (0.0, until)


LOG = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)


@final
class Running:
    """Initialised instance of a unit for co-simulation, created by `running`.

    Attributes:
        said: messages of the unit, in their order.
        t: communication point [s].
    """

    def __init__(self, library: Any, token: str, references: Mapping[str, int]) -> None:
        self.said: list[str] = []
        self.t = 0.0
        self._library, self._references = library, references
        self._log = LOG(self._keep)
        library.fmi3InstantiateCoSimulation.restype = c.c_void_p
        none = c.c_size_t(0)
        handle = library.fmi3InstantiateCoSimulation(
            b"symfric", token.encode(), None, False, False, False, False, None, none, None,
            self._log, None,
        )  # fmt: skip
        self._self = c.c_void_p(handle)
        self._flags = [c.c_bool() for _ in range(3)]
        self._reached = c.c_double()
        self._out = [*map(c.byref, self._flags), c.byref(self._reached)]

    def _keep(self, _environment: Any, _status: int, _category: bytes, text: bytes) -> None:
        self.said.append(text.decode())

    def initialise(self, start: Mapping[str, float]) -> None:
        """Set start values, inputs and parameters by name, and initialise at t = 0.

        Raises:
            RuntimeError: the unit rejects a value; the text contains its message.
        """
        self.set(start)
        zero = c.c_double(0.0)
        self._call("EnterInitializationMode", False, zero, zero, False, zero)
        self._call("ExitInitializationMode")

    def _call(self, name: str, *arguments: object) -> None:
        if not self._self or getattr(self._library, f"fmi3{name}")(self._self, *arguments):
            said = self.said[-1] if self.said else "nothing"
            raise RuntimeError(f"unit: fmi3{name} failed; it says {said}")

    def _named(self, names: Sequence[str]) -> tuple[Any, c.c_size_t]:
        references = (c.c_uint32 * len(names))(*(self._references[n] for n in names))
        return references, c.c_size_t(len(names))

    def set(self, values: Mapping[str, float]) -> None:
        """Set variables by name."""
        references, count = self._named([*values])
        numbers = (c.c_double * len(values))(*values.values())
        self._call("SetFloat64", references, count, numbers, count)

    def get(self, names: Sequence[str]) -> Array:
        """Return the values of variables by name, shape (names,)."""
        references, count = self._named(names)
        numbers = np.empty(len(names))
        self._call("GetFloat64", references, count, c.c_void_p(numbers.ctypes.data), count)
        return numbers

    def step(self, size: float) -> None:
        """Make one communication step of `size` [s]."""
        self._call("DoStep", c.c_double(self.t), c.c_double(size), True, *self._out)
        self.t = self._reached.value

    def free(self) -> None:
        """Free the memory of the instance."""
        self._library.fmi3FreeInstance(self._self)
        self._self = c.c_void_p(None)


@contextmanager
def running(path: str | Path, **start: float) -> Generator[Running]:
    """Yield an instance of the unit in `path`, initialised with the values `start` by name.

    Raises:
        ValueError: an archive without a binary for this platform.
        RuntimeError: the unit rejects the start values.
    """
    with tempfile.TemporaryDirectory(prefix="symfric-fmu-") as folder, ZipFile(path) as archive:
        own = f"binaries/{platform_name(3)}/"
        binaries = [name for name in archive.namelist() if name.startswith(own)]
        if not binaries:
            raise ValueError(f"unit '{path}': expected a binary in {own}, got none")
        root = Xml.fromstring(archive.read("modelDescription.xml"))
        listed = root.find("ModelVariables")
        variables = [] if listed is None else list(listed)
        references = {v.get("name", ""): int(v.get("valueReference", 0)) for v in variables}
        library = c.CDLL(archive.extract(binaries[0], folder))
        unit = Running(library, root.get("instantiationToken", ""), references)
        try:
            unit.initialise(start)
            yield unit
        finally:
            unit.free()
