"""Which form an attempt has, and that a large one is not written out to find that out."""

from typing import Any

import casadi as ca
import pytest

import symfric.integrator.step.attempt as module
from symfric import BrownMcPhee, rabinowicz
from symfric.bench.multibody import chain
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.step.attempt import build_step, instructions, least, written
from symfric.model import Model

METHOD = METHODS["rodas5p"]


def of(model: Model) -> System:
    return system(model, input_data(model, None, 0.0, 1.0))


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The kinds in which attempts are built."""
    kinds: list[object] = []

    def counted(whole: System, method: Any, kind: Any = ca.SX) -> ca.Function:
        kinds.append(kind)
        return build_step(whole, method, kind)

    monkeypatch.setattr(module, "build_step", counted)
    return kinds


def test_a_small_one_is_written_out_and_a_large_one_never(built: list[object]) -> None:
    belt, links = of(rabinowicz(BrownMcPhee())), of(chain(4, BrownMcPhee()))
    step, count = written(belt, METHOD, 7000)
    assert (step.class_name(), count) == ("SXFunction", step.n_instructions())
    step, count = written(links, METHOD, 2000)
    assert step.class_name() == "MXFunction"
    assert built == [ca.SX, ca.MX]
    assert least(links, METHOD) < count == instructions(step)
    assert least(belt, METHODS["dopri5"]) == 0


def test_one_in_between_is_counted(built: list[object]) -> None:
    belt = of(rabinowicz(BrownMcPhee()))
    least_count, count = least(belt, METHOD), build_step(belt, METHOD).n_instructions()
    assert least_count < count - 1
    assert written(belt, METHOD, count - 1)[0].class_name() == "MXFunction"
    assert written(belt, METHOD, count)[0].class_name() == "SXFunction"
    assert built == [ca.SX, ca.MX, ca.SX]
