"""Cost of a step against the number of links of a chain, and its exponent."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any, cast, final

import numpy as np
from numpy.typing import NDArray

from symfric.bench.counts import integrator
from symfric.bench.timing import best_time
from symfric.foundation.numeric import flat_view
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.step.layout import Given, State
from symfric.laws import Law
from symfric.model import Model
from symfric.multibody import JointFriction, Mechanism, Revolute

Array = NDArray[np.float64]
SIZES = (2, 4, 8, 16, 32, 64)
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
BUDGET = 120.0
"""A chain that took longer to build [s] is the last one."""


@final
@dataclass(frozen=True)
class ChainRow:
    """One size.

    Attributes:
        links: how many.
        build_s: time [s] from nothing to the step.
        instructions: of the step.
        step_s: time [s] of an attempt in the virtual machine.
    """

    links: int
    build_s: float
    instructions: int
    step_s: float


def chain(links: int, law: Law | None = None) -> Model:
    """A hanging chain of equal rods, its hinges about x and y by turns; friction from reactions."""
    m, length = Mechanism("chain"), 1.0
    m.frame("ground.end", z=Y)
    last = "ground"
    for i in range(links):
        body, axis = f"rod_{i + 1}", X if i % 2 else Y
        m.body(body, 1.0, (length**2 / 12, length**2 / 12, 1e-3))
        m.frame(f"{body}.top", at=(0.0, 0.0, length / 2), z=axis)
        m.frame(f"{body}.end", at=(0.0, 0.0, -length / 2), z=Y if i % 2 else X)
        friction = None if law is None else JointFriction(law, radius=0.02)
        m.joint(Revolute(f"q{i + 1}", f"{last}.end", f"{body}.top", start=0.3, friction=friction))
        last = body
    return m.build()


def scaling(
    make: Callable[[int], Model],
    sizes: Sequence[int] = SIZES,
    budget: float = BUDGET,
) -> list[ChainRow]:
    """Measure the step of `make(n)` for every n of `sizes`, until one takes longer than `budget`.

    Args:
        make: number of links -> model.
        sizes: increasing.
        budget: time for building [s].
    """
    rows: list[ChainRow] = []
    for n in sizes:
        begin = perf_counter()
        made = integrator(make(n))
        build_s = perf_counter() - begin
        rows.append(ChainRow(n, build_s, made.instructions, step_time(made)))
        if build_s > budget:
            break
    return rows


def exponent(rows: Sequence[ChainRow], column: str, smallest: int = 8) -> float:
    """Slope of the logarithm of a column over that of the links, from `smallest` links on."""
    used = [row for row in rows if row.links >= smallest]
    if len(used) < 2:
        used = list(rows[-2:])
    links = np.log([row.links for row in used])
    values = np.log([float(getattr(row, column)) for row in used])
    return float(np.polyfit(links, values, 1)[0])


def step_time(made: Integrator) -> float:
    """Time [s] of an attempt from the start, in the virtual machine."""
    whole, model = made.system, made.model
    y = first_guess(whole, model, model.initial_state())
    d = np.zeros(whole.d.numel())
    y = consistent(whole, "bench", y, d)
    S = State.at(0.0, 1e-4, y)
    R = Given.of(1.0, 1e-6, 1.0, 1e-7 * whole.nominal, d)
    S_out, D = np.zeros(S.size), np.zeros(made.step.numel_out(1))
    buffer, evaluate = cast(tuple[Any, Any], made.step.buffer())
    for i, column in enumerate((S, R)):
        buffer.set_arg(i, flat_view(column))
    for i, column in enumerate((S_out, D)):
        buffer.set_res(i, flat_view(column))
    return best_time(partial(evaluate), budget=0.1, most=1000)[0]
