"""A unit of FMI 3.0 run through its C interface, to see here what another tool will see."""

import ctypes as c
import tempfile
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, final
from xml.etree import ElementTree as Xml
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from symfric.fmu.package import platform_name

Array = NDArray[np.float64]
LOG = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)


@final
class Running:
    """An instance for co-simulation, initialised; made by `running`.

    Attributes:
        said: messages of the unit.
        t: communication point [s].
    """

    def __init__(self, library: Any, token: str, references: Mapping[str, int]) -> None:
        self.said: list[str] = []
        self.t = 0.0
        self._library, self._references = library, references
        self._log = LOG(self._hear)
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

    def _hear(self, _environment: Any, _status: int, _category: bytes, text: bytes) -> None:
        self.said.append(text.decode())

    def initialise(self, start: Mapping[str, float]) -> None:
        """Set start values, inputs and parameters by name, and initialise at t = 0.

        Raises:
            RuntimeError: the unit refuses; with what it says.
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
        """Values of variables by name, shape (names,)."""
        references, count = self._named(names)
        numbers = np.empty(len(names))
        self._call("GetFloat64", references, count, c.c_void_p(numbers.ctypes.data), count)
        return numbers

    def step(self, size: float) -> None:
        """One communication step of `size` [s]."""
        self._call("DoStep", c.c_double(self.t), c.c_double(size), True, *self._out)
        self.t = self._reached.value

    def free(self) -> None:
        """Give its memory back."""
        self._library.fmi3FreeInstance(self._self)
        self._self = c.c_void_p(None)


@contextmanager
def running(path: str | Path, **start: float) -> Generator[Running]:
    """An instance of the unit in `path`, initialised with `start` values by name.

    Raises:
        ValueError: an archive without a binary for this platform.
        RuntimeError: the unit refuses the start values.
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
