"""Instructions and bytes of generated C on a Cortex-M4F, beside CasADi's own C of the same step."""

from math import nan

from symfric.bench.codegen_blocks import Case, cases
from symfric.bench.codegen_section import Cell, Goal, Section
from symfric.embedded import BY, Absent, Measured, find_tools
from symfric.embedded import measure as measured

TITLE = (
    "Cortex-M4F, float, gcc -O2: instructions of a step (average, maximum), bytes of code and "
    "stack; casadi: average of raw CasADi C; f: of the same with calls of float functions; goals "
    "of average, text, stack"
)
HEAD = ("block", "average", "max", "text", "stack", "casadi", "f", "goals", "met")


def measure(quick: bool) -> Section:
    """A row for every block; `quick` leaves CasADi's C out."""
    tools = find_tools()
    if isinstance(tools, Absent):
        return Section(TITLE, HEAD, (), notes=(tools.advice,))
    rows: list[list[Cell]] = []
    goals: list[Goal] = []
    for case in cases():
        block = case.make()
        found = measured(block, options=case.options, tools=tools)
        others = [nan if quick else measured(block, by=by, tools=tools).average for by in BY[1:]]
        own = _goals(case, found)
        goals += own
        limits = ", ".join(f"{limit:g}" for limit in case.goals.values())
        met = ", ".join("yes" if goal.met else "no" for goal in own)
        rows.append(
            [case.name, round(found.average, 1), round(found.maximum), round(found.text),
             round(found.stack), *map(_whole, others), limits, met]
        )  # fmt: skip
    return Section(TITLE, HEAD, rows, goals)


def _goals(case: Case, found: Measured) -> list[Goal]:
    return [
        Goal(f"{case.name}: {name}", getattr(found, name), limit)
        for name, limit in case.goals.items()
    ]


def _whole(value: float) -> float:
    return value if value != value else float(round(value))
