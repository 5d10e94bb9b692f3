"""Numbers of a problem that are far from what its models call usual: a unit taken for another."""

from collections.abc import Iterator
from math import isfinite
from typing import TYPE_CHECKING

from ocp.formulation.bounds import as_box
from ocp.formulation.settings import settings_of
from symfric.foundation.variable import Variable

if TYPE_CHECKING:
    from ocp.formulation.problem import Problem

FAR = 300.0
"""Factor between a number and the usual size of its variable from which on it is doubted."""


def doubts(problem: "Problem") -> str:
    """What is odd about ends and bounds, in sentences; empty where nothing is.

    A value to meet that is `FAR` times the `nominal` of its variable, and an input that may have no
    more than a `FAR`th of it.
    """
    return " ".join(dict.fromkeys(_told(problem)))


def _told(problem: "Problem") -> Iterator[str]:
    for one in settings_of(problem):
        inputs = {v.name: v for v in one.model.u}
        known = {v.name: v for v in (*one.model.x, *one.model.z)} | inputs
        for place, ranges in (("start", one.phase.start), ("end", one.phase.end)):
            for name, wanted in ranges.items():
                least = min(map(abs, as_box(wanted)))
                if name in known and isfinite(least) and least >= FAR * known[name].nominal:
                    yield _sentence(f"{one.where}{place}", known[name], least)
        for name, wanted in one.bounds.items():
            most = max(map(abs, as_box(wanted)))
            if name in inputs and 0 < most <= inputs[name].nominal / FAR:
                yield _sentence(f"{one.where}bounds", inputs[name], most)


def _sentence(where: str, of: Variable, size: float) -> str:
    times = size / of.nominal
    told = f"{times:.0f} times" if times > 1 else f"{1 / times:.0f} times less than"
    return (
        f"{where}: {of.name} = {size:g} {of.unit} is {told} its nominal {of.nominal:g} {of.unit}: "
        "check the unit."
    )
