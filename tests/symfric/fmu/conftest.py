"""Units of these tests, each exported once and compiled without optimisation: the same bits."""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import casadi as ca
import pytest
from device_cases import wedge
from units import OK, Archive, Rates, Second
from wires import wire

from symfric import BrownMcPhee, ExactCoulomb, LuGre
from symfric.fmu import export_fmu, package
from symfric.foundation.parameters import Variable
from symfric.model import Event, Model
from symfric.scenes import Drive, Pendulum, SliderCrank

RTOL = 1e-9


@pytest.fixture(scope="session", autouse=True)
def quickly_compiled() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        flags = tuple("-O0" if flag == "-O2" else flag for flag in package.FLAGS)
        patch.setattr(package, "FLAGS", flags)
        yield


def gate() -> Model:
    """A point at 1 m/s that passes gates: which and where. The last one ends it."""
    x, u = Variable("x", "m"), Variable("u", "m", start=9.0)
    begun, at, falls, caught = (Variable(n, "m") for n in ("begun", "at", "falls", "caught"))
    return Model(
        "gate",
        x=(x, begun, at, falls, caught),
        u=(u,),
        ode=ca.vertcat(1.0, 0.0, 0.0, 0.0, 0.0),
        events=(
            Event("begin", x.symbol + 1.0, 1, reset={"begun": begun.symbol + 1}, at_start=True),
            Event("moved", x.symbol - u.symbol, 1, reset={"at": x.symbol}, rtol=1e-5),
            Event("fall", x.symbol - 0.6, -1, reset={"falls": falls.symbol + 1}),
            Event("catch", u.symbol - x.symbol, 1, reset={"caught": caught.symbol + 1}),
            Event("end", x.symbol - 1.0, 1, terminal=True),
        ),
    )


def root() -> Model:
    """An algebraic variable that an input takes away."""
    x, z, u = Variable("x", "m"), Variable("z", "1", start=1.0), Variable("u", "1")
    equation = z.symbol**2 + u.symbol - 1.0
    return Model("root", x=(x,), z=(z,), u=(u,), ode=-x.symbol, alg=equation)


MACHINES = {
    "wire": wire, "gate": gate, "root": root, "wedge": wedge,
    "drive": lambda: Drive(LuGre()), "smooth drive": lambda: Drive(BrownMcPhee()),
    "sticking drive": lambda: Drive(ExactCoulomb()), "pendulum": lambda: Pendulum(BrownMcPhee()),
    "loop": lambda: SliderCrank(BrownMcPhee()),
}  # fmt: skip


@pytest.fixture(scope="session")
def exported(tmp_path_factory) -> Callable[..., tuple[Archive, Model]]:
    """Function of a name, the version and options of `export_fmu`: archive, and the model in it."""

    @cache
    def make(name: str, fmi: int, **options) -> tuple[Archive, Model]:
        folder, what = tmp_path_factory.mktemp("unit"), MACHINES[name]()
        options = {"t_end": 2.0, "rtol": RTOL} | options
        unit = export_fmu(what, folder / "unit.fmu", fmi=fmi, **options)
        tuned = [e.name for e in unit.variables if e.causality == "parameter" and e.name != "rtol"]
        model = what if isinstance(what, Model) else what.model(tuned)
        return Archive(unit.path, folder / "open"), model

    return make


@pytest.fixture
def opened(exported) -> Iterator[Callable[..., tuple[Any, Model]]]:
    """Function that returns an instance, initialised if `start` is given, and its model."""
    units: list[Any] = []

    def make(kind, name, start=None, stop=None, **options):
        if kind is Rates:
            options["kind"] = "model-exchange"
        archive, model = exported(name, 2 if kind is Second else 3, **options)
        units.append(kind(archive))
        assert start is None or units[-1].begin(stop=stop, **start) == OK, units[-1].messages
        return units[-1], model

    yield make
    for unit in units:
        unit.free()
