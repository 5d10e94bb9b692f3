"""Functional Mock-up Units driven through their C interface, without a library for it."""

import ctypes as c
import zipfile
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np

LOGGER = c.CFUNCTYPE(None, c.c_void_p, c.c_char_p, c.c_int, c.c_char_p, c.c_char_p)
OK, WARNING, DISCARD, ERROR = range(4)


class Callbacks(c.Structure):
    """`fmi2CallbackFunctions`."""

    _fields_ = (("logger", LOGGER), *((n, c.c_void_p) for n in ("new", "free", "done", "env")))


class Archive:
    """An unpacked unit: description, variables by name, binary."""

    def __init__(self, path: Path, folder: Path) -> None:
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
            self.names = archive.namelist()
        self.root = Xml.parse(folder / "modelDescription.xml").getroot()
        listed = self.root.find("ModelVariables")
        self.variables = {v.get("name"): v for v in listed}
        self.reference = {n: int(v.get("valueReference")) for n, v in self.variables.items()}
        self.token = self.root.get("guid") or self.root.get("instantiationToken")
        (binary,) = [n for n in self.names if n.startswith("binaries/")]
        self.library = c.CDLL(str(folder / binary))


class Unit:
    """An instance of a unit; `messages` keeps its messages."""

    prefix, real, counts = "fmi3", "Float64", 2

    def instantiate(self, archive: Archive, name: str, *arguments) -> None:
        function = getattr(archive.library, f"{self.prefix}{name}")
        function.restype = c.c_void_p
        self.archive, self.library = archive, archive.library
        self.handle = function(*arguments)
        self.self = c.c_void_p(self.handle)

    def call(self, name: str, *arguments) -> int:
        return getattr(self.library, f"{self.prefix}{name}")(self.self, *arguments)

    def references(self, names) -> c.Array:
        return (c.c_uint32 * len(names))(*(self.archive.reference[n] for n in names))

    def exchange(self, name: str, names, numbers: c.Array) -> int:
        count = c.c_size_t(len(names))
        last = [count] * (self.counts - 1)
        return self.call(f"{name}{self.real}", self.references(names), count, numbers, *last)

    def set(self, **values: float) -> int:
        return self.exchange("Set", values, (c.c_double * len(values))(*values.values()))

    def get(self, *names: str) -> np.ndarray:
        numbers = (c.c_double * len(names))()
        assert self.exchange("Get", names, numbers) == OK, self.messages
        return np.array(numbers[:])

    def free(self) -> None:
        self.call("FreeInstance")


class Second(Unit):
    """An instance of FMI 2.0; `messages` keeps status and text of each message."""

    prefix, real, counts = "fmi2", "Real", 1

    def __init__(self, archive: Archive, name: str = "unit", token: str | None = None) -> None:
        self.messages = list[tuple[int, str]]()
        self.logger = LOGGER(
            lambda _e, _n, status, _c, text: self.messages.append((status, text.decode()))
        )
        self.callbacks = Callbacks(self.logger, None, None, None, None)
        token = archive.token if token is None else token
        self.instantiate(
            archive, "Instantiate", name.encode(), 1, token.encode(), b"", c.byref(self.callbacks),
            0, 1,
        )  # fmt: skip

    def setup(
        self, begin: float = 0.0, stop: float | None = None, rtol: float | None = None
    ) -> int:
        return self.call(
            "SetupExperiment", int(rtol is not None), c.c_double(rtol or 0.0), c.c_double(begin),
            int(stop is not None), c.c_double(stop or 0.0),
        )  # fmt: skip

    def begin(self, begin: float = 0.0, stop: float | None = None, **start: float) -> int:
        worst = max(self.setup(begin, stop), self.set(**start) if start else OK)
        return max(worst, self.call("EnterInitializationMode"), self.call("ExitInitializationMode"))

    def step(self, t: float, size: float) -> int:
        return self.call("DoStep", c.c_double(t), c.c_double(size), 1)


def over(unit, times, names, inputs=None):
    """Signals `names` (times, names) at communication points; inputs(t) by name before each."""
    rows = [unit.get(*names)]
    for t, after in pairwise(times):
        if inputs is not None:
            assert unit.set(**inputs(t)) == OK, unit.messages
        assert unit.step(t, after - t) == OK, unit.messages
        rows.append(unit.get(*names))
    return np.array(rows)


class Third(Unit):
    """An instance of FMI 3.0 for co-simulation."""

    def __init__(self, archive: Archive, early: bool = False) -> None:
        self.start(archive, "CoSimulation", False, False, False, early, None, c.c_size_t(0), None)

    def start(self, archive: Archive, kind: str, *between) -> None:
        self.messages = list[str]()
        log = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)
        self.log = log(lambda _e, _s, _c, text: self.messages.append(text.decode()))
        token, environment = archive.token.encode(), [None] * (kind == "CoSimulation")
        self.instantiate(
            archive, f"Instantiate{kind}", b"unit", token, None, *between, self.log, *environment
        )

    def begin(self, begin: float = 0.0, stop: float | None = None, **start: float) -> int:
        worst = self.set(**start) if start else OK
        entered = self.call(
            "EnterInitializationMode", False, c.c_double(0.0), c.c_double(begin),
            stop is not None, c.c_double(stop or 0.0),
        )  # fmt: skip
        return max(worst, entered, self.call("ExitInitializationMode"))

    def step(self, t: float, size: float) -> int:
        self.flags = [c.c_bool() for _ in range(3)]
        self.reached = c.c_double()
        places = [c.byref(flag) for flag in self.flags]
        return self.call(
            "DoStep", c.c_double(t), c.c_double(size), True, *places, c.byref(self.reached)
        )


class Rates(Third):
    """An instance of FMI 3.0 for model exchange."""

    def __init__(self, archive: Archive) -> None:
        self.start(archive, "ModelExchange", False, False, None)
        count = c.c_size_t()
        assert self.call("GetNumberOfContinuousStates", c.byref(count)) == OK
        self.n = count.value
        assert self.call("GetNumberOfEventIndicators", c.byref(count)) == OK
        self.events = count.value

    def column(self, name: str, n: int) -> np.ndarray:
        values = np.zeros(n)
        assert self.call(name, c.c_void_p(values.ctypes.data), c.c_size_t(n)) == OK, self.messages
        return values

    def at(self, t: float, x: np.ndarray) -> None:
        assert self.call("SetTime", c.c_double(t)) == OK
        x = np.ascontiguousarray(x)
        assert self.call("SetContinuousStates", c.c_void_p(x.ctypes.data), c.c_size_t(x.size)) == OK

    def rates(self, t: float, x: np.ndarray) -> np.ndarray:
        self.at(t, x)
        return self.column("GetContinuousStateDerivatives", self.n)

    def along(self, unknowns: list[str], seeds: dict[str, float]) -> np.ndarray:
        """Directional derivatives."""
        of, by = self.references(unknowns), self.references(seeds)
        given, values = (c.c_double * len(seeds))(*seeds.values()), np.zeros(len(unknowns))
        n, k = c.c_size_t(len(unknowns)), c.c_size_t(len(seeds))
        place = c.c_void_p(values.ctypes.data)
        status = self.call("GetDirectionalDerivative", of, n, by, k, given, k, place, n)
        assert status == OK, self.messages
        return values

    @property
    def x(self) -> np.ndarray:
        return self.column("GetContinuousStates", self.n)

    def update(self) -> tuple[bool, bool, bool]:
        """Carry out events; whether once more, whether it is over, whether states jumped."""
        flags, after = [c.c_bool() for _ in range(5)], c.c_double()
        assert self.call("EnterEventMode") == OK
        assert self.call("UpdateDiscreteStates", *map(c.byref, flags), c.byref(after)) == OK
        return flags[0].value, flags[1].value, flags[3].value

    def completed(self) -> bool:
        event, over = c.c_bool(), c.c_bool()
        assert self.call("CompletedIntegratorStep", True, c.byref(event), c.byref(over)) == OK
        return event.value
