"""Generated code and its goals: instructions on a core, robustness, FMUs, compensators."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

from symfric.bench import table
from symfric.bench.codegen_runs import compensation, units
from symfric.bench.table import Cell, Goal, Section
from symfric.codegen import Block, generate, inverse_dynamics_block, law_block, plant_block
from symfric.codegen.fuzz import STEPS, Fuzzed, fuzz
from symfric.embedded import (
    BY,
    CORES,
    Absent,
    Measured,
    Tools,
    find_tools,
    measure,
    wrong_on_target,
)
from symfric.emitter.c99 import REALS
from symfric.foundation.parameters import check_names
from symfric.foundation.programs import CompileError, find_compiler
from symfric.laws import ALL_LAWS, GMS, BrownMcPhee, LuGre, MaxwellSlip, VelocityBased
from symfric.laws.dynamic.maxwell_slip import Element
from symfric.scenes import Arm, Drive, Rabinowicz, rabinowicz

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


CORES_TITLE = (
    "Cortex-M4F, float, gcc -O2: instructions of a step (average, maximum), bytes of code and "
    "stack, all without guards; guarded: average with them; casadi: average of raw CasADi C; f: of "
    "the same with calls of float functions"
)
CORES_HEAD = ("block", "avg", "max", "text", "stack", "guarded", "casadi", "f", "goals")


def cores(quick: bool) -> Section:
    """A row for every block; `quick` leaves CasADi's C out."""
    tools = find_tools()
    if isinstance(tools, Absent):
        return Section(CORES_TITLE, CORES_HEAD, (), notes=(tools.advice,))
    rows: list[list[Cell]] = []
    goals: list[Goal] = []
    for case in cases():
        block = case.make()
        bare = measure(block, guards=False, tools=tools)
        guarded = measure(block, tools=tools).average
        others = [nan if quick else measure(block, by=by, tools=tools).average for by in BY[1:]]
        own = _core_goals(case, bare, guarded)
        goals += own
        rows.append(
            [case.name, *map(_whole, (bare.average, bare.maximum, bare.text, bare.stack, guarded)),
             *map(_whole, others), ", ".join(_said(goal) for goal in own)]
        )  # fmt: skip
    return Section(CORES_TITLE, CORES_HEAD, rows, goals)


def _core_goals(case: Case, bare: Measured, guarded: float) -> list[Goal]:
    numbers = bare.to_dict() | {"guarded": guarded}
    return [Goal(f"{case.name}: {name}", numbers[name], g) for name, g in case.goals.items()]


def _said(goal: Goal) -> str:
    return f"{goal.goal:g} {'ok' if goal.met else 'no'}"


def _whole(value: float) -> float:
    """Without digits behind the point; NaN as it is."""
    return value if value != value else float(round(value))


FUZZ_TITLE = (
    "random steps under -fsanitize=undefined,address: valid ones, repaired ones, and what must not "
    "be: valid ones altered by guards, repairs without a flag, outputs that are not finite"
)
FUZZ_HEAD = ("block", "type", "valid", "repaired", "altered", "silent", "dead", "last")
FUZZED = ("brown_mcphee", "lugre", "maxwell_slip", "haessig_friedland", "velocity_based")


def fuzzing(quick: bool) -> Section:
    """A row for every law and type, and for two plants; `quick`: five laws, 20 000 steps."""
    compiler = find_compiler()
    if compiler is None:
        return Section(
            FUZZ_TITLE, FUZZ_HEAD, (), notes=("no C compiler found; install gcc or clang",)
        )
    rows: list[list[Cell]] = []
    failed, resorts, notes = 0, 0, list[str]()
    for block, steps in _blocks(quick):
        for real in ("double", "float"):
            try:
                found = fuzz(block, real, compiler, steps=steps)
            except CompileError as error:
                return Section(FUZZ_TITLE, FUZZ_HEAD, rows, notes=(str(error),))
            rows.append(_fuzz_row(found))
            failed, resorts = failed + (not found.ok), resorts + found.last_resort
            if found.report:
                notes.append(f"{found.name} in {real}: {found.report.splitlines()[0]}")
    if resorts:
        notes.append(
            f"last: {resorts} steps had no value, such as a stroke beyond the length of a damper; "
            "they gave 0 and said so"
        )
    goals = [Goal("blocks that die, are silent or altered", float(failed), 0.0)]
    return Section(FUZZ_TITLE, FUZZ_HEAD, rows, goals, notes=tuple(notes))


def _blocks(quick: bool) -> Iterator[tuple[Block, int]]:
    for name, kind in ALL_LAWS.items():
        if quick and name not in FUZZED:
            continue
        try:
            yield law_block(kind()), 20_000 if quick else STEPS
        except ValueError:  # a law that has no step, see `law_block`
            continue
    if not quick:
        yield plant_block(Rabinowicz(LuGre()).model(), name="rabinowicz"), STEPS // 10
        yield plant_block(Drive(LuGre()).model(), name="drive"), STEPS // 10


def _fuzz_row(found: Fuzzed) -> list[Cell]:
    counts = (found.valid, found.repaired, found.altered, found.unflagged,
              found.unfinished, found.last_resort)  # fmt: skip
    return [found.name, REALS[found.real].suffix, *map(float, counts)]


TARGETS = (*((core, "float") for core in CORES), ("m7", "double"))
"""Core and floating point type; double on a core without an FPU for it is of no use."""


@final
@dataclass(frozen=True, eq=False)
class EmbeddedRow:
    """A block on a core: what it costs, and how many results of its kit's unit test are wrong."""

    measured: Measured
    wrong: int

    @property
    def ok(self) -> bool:
        """True if it was measured, all numbers are finite, and none is wrong."""
        return self.measured.ok and self.wrong == 0

    def to_dict(self) -> dict[str, Any]:
        """Everything by name."""
        return self.measured.to_dict() | {"wrong": self.wrong}


@final
@dataclass(frozen=True, eq=False)
class EmbeddedBenchmark(table.Report):
    """Measurements on cores; `advice` names the tools that are absent, and their sources."""

    rows: tuple[EmbeddedRow, ...]
    advice: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Rows as dictionaries."""
        return {"rows": [row.to_dict() for row in self.rows], "skipped": self.advice}

    def shown(self) -> Iterator[table.Table | str]:
        """Instructions and bytes, block by block and core by core."""
        if self.advice:
            yield f"embedded: skipped, {self.advice}"
            return
        yield table.Table(
            "gcc -O2 under QEMU, float: instructions of a step (average, maximum), bytes, largest "
            "difference from CasADi over the peak, unit test of the kit",
            ["block", "core", "avg", "max", "text", "data", "stack", "error", "test"],
            [
                [m.block, m.core.replace("plus", "+") + ("" if m.real == "float" else " f64"),
                 round(m.average), round(m.maximum), round(m.text), round(m.data), round(m.stack),
                 table.known(m.error, 2), "ok" if row.wrong == 0 else f"{row.wrong} wrong"]
                for row in self.rows for m in (row.measured,)
            ],
        )  # fmt: skip


def bench_embedded(*, quick: bool = False, progress: table.Progress = None) -> EmbeddedBenchmark:
    """Measure and test every block on every core; `quick` on the M4F alone.

    Ctrl-C returns the rows so far.
    """
    tools = find_tools()
    if isinstance(tools, Absent):
        return EmbeddedBenchmark((), tools.advice)
    targets = [("m4f", "float")] if quick else TARGETS
    blocks = table.each([*cases()], progress, lambda case: case.name)
    rows = (row for case in blocks for row in _on_cores(case, targets, tools))
    return EmbeddedBenchmark(table.until_stopped(rows))


def _on_cores(
    case: Case, targets: Sequence[tuple[str, str]], tools: Tools
) -> Iterator[EmbeddedRow]:
    block = case.make()
    with TemporaryDirectory(prefix="symfric-") as folder:
        reals = tuple(dict.fromkeys(real for _, real in targets))
        kit = generate(block, Path(folder), real=reals)
        for core, real in targets:
            wrong = wrong_on_target(kit, real, core, tools=tools)
            yield EmbeddedRow(measure(block, real, core, tools=tools), wrong)


# ---- sections of `symfric bench codegen` ----

SECTIONS: Mapping[str, Callable[[bool], Section]] = {
    "cores": cores,
    "fuzz": fuzzing,
    "fmu": units,
    "compensation": compensation,
}
"""Name -> what measures it; `True`: quickly. Where a tool is absent the section has no rows, and a
note that says which."""


@final
@dataclass(frozen=True, eq=False)
class CodegenBenchmark(table.Report):
    """Measurements by section."""

    sections: Mapping[str, Section] = field(default_factory=dict[str, Section])

    def to_dict(self) -> dict[str, Any]:
        """Tables, goals and notes of every section."""
        return {name: section.to_dict() for name, section in self.sections.items()}

    def shown(self) -> Iterator[table.Table | str]:
        """A table a section, and its notes."""
        for name, section in self.sections.items():
            if section.rows:
                rows = [
                    [c if isinstance(c, str) else table.known(c, 4) for c in r]
                    for r in section.rows
                ]
                yield table.Table(section.title, section.head, rows)
            yield from (f"{name}: {note}" for note in section.notes)

    def drawn(self) -> tuple[Any, ...]:
        """The distance of each number from its goal; right of the line it is worse."""
        return "goals", ((g.what, g) for s in self.sections.values() for g in s.goals)


def bench_codegen(
    *,
    quick: bool = False,
    sections: Sequence[str] = tuple(SECTIONS),
    progress: table.Progress = None,
) -> CodegenBenchmark:
    """Measure `sections`; `quick` leaves out the slow others. Ctrl-C returns what was measured.

    Raises:
        ValueError: an unknown section.
    """
    check_names("bench codegen: sections", sections, SECTIONS)
    found = ((name, SECTIONS[name](quick)) for name in table.each(sections, progress, str))
    return CodegenBenchmark(dict(table.until_stopped(found)))
