"""The blocks that generated code is measured on."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import final

from symfric.codegen import Block, inverse_dynamics_block, law_block, plant_block
from symfric.laws import GMS, BrownMcPhee, LuGre, MaxwellSlip, VelocityBased
from symfric.laws.dynamic.maxwell_slip import Element
from symfric.scenes import Arm, rabinowicz

TEN = tuple(Element(5e4 * 2.0**-i, 0.1) for i in range(10))
"""Elements of a tenth of the friction each, of stiffnesses over three decades."""


@final
@dataclass(frozen=True, eq=False)
class Case:
    """A block with its goals on a Cortex-M4F in float.

    Attributes:
        make: makes the block.
        goals: field of `Measured` -> at most, without guards; "guarded": average with them.
    """

    name: str
    make: Callable[[], Block]
    goals: Mapping[str, float]


def _gms() -> Block:
    return law_block(GMS(elements=TEN, form="event"), name="gms10")


def _maxwell() -> Block:
    return law_block(MaxwellSlip(form="event"), name="maxwell4")


def _rabinowicz(method: str, name: str) -> Callable[[], Block]:
    return lambda: plant_block(rabinowicz(BrownMcPhee()), h=1e-4, method=method, name=name)


def _arm() -> Block:
    return inverse_dynamics_block(Arm(BrownMcPhee()).mechanism())


def cases() -> Iterator[Case]:
    """Laws; Rabinowicz's stick-slip test as a plant; an arm with friction from reactions."""
    yield Case("Brown-McPhee", lambda: law_block(BrownMcPhee()), {"average": 75})
    yield Case("LuGre", lambda: law_block(LuGre()), {"average": 165, "guarded": 210})
    yield Case("GMS(10)", _gms, {"average": 550, "text": 800, "stack": 100})
    yield Case("Maxwell(4)", _maxwell, {"average": 180})
    yield Case("velocity based", lambda: law_block(VelocityBased()), {"average": 50})
    yield Case("belt, Euler", _rabinowicz("backward_euler", "belt_euler"), {"average": 325})
    yield Case("belt, rodas3", _rabinowicz("rodas3", "belt_rodas3"), {})
    yield Case("arm, 6 axes", _arm, {"average": 1850})
