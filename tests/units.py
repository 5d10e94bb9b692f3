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


class Second:
    """An instance of FMI 2.0; what it says is kept."""

    def __init__(self, archive: Archive, name: str = "unit", token: str | None = None) -> None:
        self.archive, self.said = archive, list[tuple[int, str]]()
        self.library = archive.library
        self.logger = LOGGER(
            lambda _e, _n, status, _c, text: self.said.append((status, text.decode()))
        )
        self.callbacks = Callbacks(self.logger, None, None, None, None)
        self.library.fmi2Instantiate.restype = c.c_void_p
        token = archive.token if token is None else token
        self.handle = self.library.fmi2Instantiate(
            name.encode(), 1, token.encode(), b"", c.byref(self.callbacks), 0, 1
        )
        self.self = c.c_void_p(self.handle)

    def call(self, name: str, *arguments) -> int:
        return getattr(self.library, f"fmi2{name}")(self.self, *arguments)

    def set(self, **values: float) -> int:
        references = (c.c_uint * len(values))(*(self.archive.reference[n] for n in values))
        numbers = (c.c_double * len(values))(*values.values())
        return self.call("SetReal", references, c.c_size_t(len(values)), numbers)

    def get(self, *names: str) -> np.ndarray:
        references = (c.c_uint * len(names))(*(self.archive.reference[n] for n in names))
        numbers = (c.c_double * len(names))()
        status = self.call("GetReal", references, c.c_size_t(len(names)), numbers)
        assert status == OK, self.said
        return np.array(numbers[:])

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

    def free(self) -> None:
        self.library.fmi2FreeInstance(self.self)


def over(unit, times, names, inputs=None):
    """Signals `names` (times, names) at communication points; inputs(t) by name before each."""
    rows = [unit.get(*names)]
    for t, after in pairwise(times):
        if inputs is not None:
            assert unit.set(**inputs(t)) == OK, unit.said
        assert unit.step(t, after - t) == OK, unit.said
        rows.append(unit.get(*names))
    return np.array(rows)


class Third:
    """An instance of FMI 3.0 for co-simulation; what it says is kept."""

    def __init__(self, archive: Archive) -> None:
        self.archive, self.said = archive, list[str]()
        log = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)
        self.log = log(lambda _e, _s, _c, text: self.said.append(text.decode()))
        self.library = archive.library
        self.library.fmi3InstantiateCoSimulation.restype = c.c_void_p
        self.self = c.c_void_p(
            self.library.fmi3InstantiateCoSimulation(
                b"unit", archive.token.encode(), None, False, False, False, False, None,
                c.c_size_t(0), None, self.log, None,
            )
        )  # fmt: skip

    def call(self, name: str, *arguments) -> int:
        return getattr(self.library, f"fmi3{name}")(self.self, *arguments)

    def set(self, **values: float) -> int:
        references = (c.c_uint32 * len(values))(*(self.archive.reference[n] for n in values))
        numbers, count = (c.c_double * len(values))(*values.values()), c.c_size_t(len(values))
        return self.call("SetFloat64", references, count, numbers, count)

    def get(self, *names: str) -> np.ndarray:
        references = (c.c_uint32 * len(names))(*(self.archive.reference[n] for n in names))
        numbers, count = (c.c_double * len(names))(), c.c_size_t(len(names))
        assert self.call("GetFloat64", references, count, numbers, count) == OK, self.said
        return np.array(numbers[:])

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

    def free(self) -> None:
        self.library.fmi3FreeInstance(self.self)


class Rates(Third):
    """An instance of FMI 3.0 for model exchange."""

    def __init__(self, archive: Archive) -> None:
        self.archive, self.said = archive, list[str]()
        log = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)
        self.log = log(lambda _e, _s, _c, text: self.said.append(text.decode()))
        self.library = archive.library
        self.library.fmi3InstantiateModelExchange.restype = c.c_void_p
        token = archive.token.encode()
        self.self = c.c_void_p(
            self.library.fmi3InstantiateModelExchange(
                b"unit", token, None, False, False, None, self.log
            )
        )
        count = c.c_size_t()
        assert self.call("GetNumberOfContinuousStates", c.byref(count)) == OK
        self.n = count.value
        assert self.call("GetNumberOfEventIndicators", c.byref(count)) == OK
        self.events = count.value

    def column(self, name: str, n: int) -> np.ndarray:
        values = np.zeros(n)
        assert self.call(name, c.c_void_p(values.ctypes.data), c.c_size_t(n)) == OK, self.said
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
        of = (c.c_uint32 * len(unknowns))(*(self.archive.reference[n] for n in unknowns))
        by = (c.c_uint32 * len(seeds))(*(self.archive.reference[n] for n in seeds))
        given, values = (c.c_double * len(seeds))(*seeds.values()), np.zeros(len(unknowns))
        n, k = c.c_size_t(len(unknowns)), c.c_size_t(len(seeds))
        place = c.c_void_p(values.ctypes.data)
        status = self.call("GetDirectionalDerivative", of, n, by, k, given, k, place, n)
        assert status == OK, self.said
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
