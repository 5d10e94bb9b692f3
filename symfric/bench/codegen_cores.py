"""Instructions and bytes of generated C on a Cortex-M4F, beside CasADi's own C of the same step."""

from math import nan

from symfric.bench.codegen_blocks import Case, cases
from symfric.bench.codegen_section import Cell, Goal, Section
from symfric.embedded import BY, Absent, Measured, find_tools
from symfric.embedded import measure as measured

TITLE = (
    "Cortex-M4F, float, gcc -O2: instructions of a step (average, maximum), bytes of code and "
    "stack, all without guards; guarded: average with them; casadi: average of raw CasADi C; f: of "
    "the same with calls of float functions"
)
HEAD = ("block", "avg", "max", "text", "stack", "guarded", "casadi", "f", "goals")


def measure(quick: bool) -> Section:
    """A row for every block; `quick` leaves CasADi's C out."""
    tools = find_tools()
    if isinstance(tools, Absent):
        return Section(TITLE, HEAD, (), notes=(tools.advice,))
    rows: list[list[Cell]] = []
    goals: list[Goal] = []
    for case in cases():
        block = case.make()
        bare = measured(block, guards=False, tools=tools)
        guarded = measured(block, tools=tools).average
        others = [nan if quick else measured(block, by=by, tools=tools).average for by in BY[1:]]
        own = _goals(case, bare, guarded)
        goals += own
        rows.append(
            [case.name, *map(_whole, (bare.average, bare.maximum, bare.text, bare.stack, guarded)),
             *map(_whole, others), ", ".join(_said(goal) for goal in own)]
        )  # fmt: skip
    return Section(TITLE, HEAD, rows, goals)


def _goals(case: Case, bare: Measured, guarded: float) -> list[Goal]:
    numbers = bare.to_dict() | {"guarded": guarded}
    return [Goal(f"{case.name}: {name}", numbers[name], g) for name, g in case.goals.items()]


def _said(goal: Goal) -> str:
    return f"{goal.goal:g} {'ok' if goal.met else 'no'}"


def _whole(value: float) -> float:
    """Without digits behind the point; NaN as it is."""
    return value if value != value else float(round(value))
