"""Instructions and memory of generated C on Cortex-M cores under QEMU."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite, nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

from symfric.bench.report import Found, Progress, Report
from symfric.codegen import Block, generate, inverse_dynamics_block, law_block, plant_block
from symfric.embedded import CORES, Absent, Tools, find_tools, measure, wrong_on_target
from symfric.embedded.measure import REGIMES
from symfric.laws import GMS, BrownMcPhee, Element, LuGre, MaxwellSlip, VelocityBased
from symfric.scenes import Arm, rabinowicz

TEN = tuple(Element(5e4 * 2.0**-i, 0.1) for i in range(10))
"""Ten elements, each with a tenth of the friction, and stiffnesses over three decades."""
TARGETS = (*((core, "float") for core in CORES), ("m7", "double"))
"""Cores and floating point types; double is used only on a core with an FPU for it."""
TITLE = (
    "gcc -O2 under QEMU, float: instructions per step, memory, and largest difference from "
    "CasADi relative to the peak"
)


@final
@dataclass(frozen=True, eq=False)
class EmbeddedCase:
    """Block with its goals on a Cortex-M4F in single precision.

    Attributes:
        name: name in the table.
        make: function that builds the block.
        goals: field of `Measured` -> largest value without guards; "guarded": largest average
            with guards.
    """

    name: str
    make: Callable[[], Block]
    goals: Mapping[str, float]


def _belt(method: str, name: str) -> Block:
    return plant_block(rabinowicz(BrownMcPhee()), h=1e-4, method=method, name=name)


CASES = (
    EmbeddedCase("Brown-McPhee", lambda: law_block(BrownMcPhee()), {"average": 75}),
    EmbeddedCase("LuGre", lambda: law_block(LuGre()), {"average": 165, "guarded": 210}),
    EmbeddedCase("GMS(10)", lambda: law_block(GMS(elements=TEN, form="event"), name="gms10"),
         {"average": 550, "text": 800, "stack": 100}),
    EmbeddedCase("Maxwell(4)", lambda: law_block(MaxwellSlip(form="event"), name="maxwell4"),
         {"average": 180}),
    EmbeddedCase("velocity based", lambda: law_block(VelocityBased()), {"average": 50}),
    EmbeddedCase("belt, Euler", lambda: _belt("backward_euler", "belt_euler"), {"average": 325}),
    EmbeddedCase("belt, rodas3", lambda: _belt("rodas3", "belt_rodas3"), {}),
    EmbeddedCase("arm, 6 axes", lambda: inverse_dynamics_block(Arm(BrownMcPhee()).mechanism()),
         {"average": 1850}),
)  # fmt: skip
"""Laws, Rabinowicz's stick-slip test as a plant, and an arm with joint friction."""


CYCLES = 1000
"""Cycles of a predictive controller; a tenth with `quick`."""
CONTROLLERS = (
    "Predictive controller of a drive with friction, 20 intervals: instructions per cycle in a "
    "loop with disturbances"
)


def controllers(quick: bool, tools: Tools) -> Iterator[Found]:
    """Measure a controller with one and with up to 20 quadratic programs in a cycle."""
    from ocp.mpc.target import measure_controller  # noqa: PLC0415  (slow to import)
    from symfric.bench.ocp import STEP, receding  # noqa: PLC0415  (slow to import)

    problem = receding(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-2))
    for core, real in (("m4f", "float"), ("m7", "double")):
        for programs in (1, 20):
            with TemporaryDirectory(prefix="symfric-") as folder:
                made = problem.to_mpc(STEP, iterations=programs).to_c(folder, real)
                cycles = CYCLES // 10 if quick else CYCLES
                m = measure_controller(made, core, cycles=cycles, tools=tools)
            yield CONTROLLERS, {
                "core": core, "type": real, "quadratic programs at most": programs,
                "cycles": cycles,
                "average instructions": whole(m.average), "most instructions": whole(m.maximum),
                "code [B]": whole(m.text), "library [B]": whole(m.library),
                "data [B]": whole(m.data), "stack [B]": whole(m.stack),
            }  # fmt: skip


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Measure and test every block on every core; with `quick`, only on the M4F."""
    tools = find_tools()
    if isinstance(tools, Absent):
        return Report(notes=[f"embedded: skipped, {tools.advice}"])
    targets = [("m4f", "float")] if quick else TARGETS
    tasks = {case.name: partial(_rows, case, targets, tools) for case in CASES}
    tasks["predictive controller"] = partial(controllers, quick, tools)
    return Report().collect(tasks, progress)


def _rows(case: EmbeddedCase, targets: Sequence[tuple[str, str]], tools: Tools) -> Iterator[Found]:
    block = case.make()
    with TemporaryDirectory(prefix="symfric-") as folder:
        kit = generate(block, Path(folder), real=tuple(dict.fromkeys(real for _, real in targets)))
        for core, real in targets:
            wrong = wrong_on_target(kit, real, core, tools=tools)
            m = measure(block, real, core, tools=tools)
            yield TITLE, {
                "block": m.block, "core": core.replace("plus", "+") + " f64" * (real == "double"),
                "average instructions": whole(m.average),
                **{f"{name}, instructions": whole(m.regimes.get(name, nan)) for name in REGIMES},
                "most instructions": whole(m.maximum),
                "code [B]": whole(m.text), "library [B]": whole(m.library),
                "data [B]": whole(m.data), "stack [B]": whole(m.stack), "relative error": m.error,
                "numbers equal to those on the host [%]": 100 * m.equal,
                "unit test": "ok" if wrong == 0 else f"{wrong} wrong",
                "status": m.status if m.finite else "not finite",
            }  # fmt: skip


def whole(value: float) -> float:
    """Return a value rounded to an integer; NaN is unchanged."""
    return round(value) if isfinite(value) else value
