"""Tables 4, 5, 8 and 9 of Jing and Mi, Investigation of Selection Mechanism of Friction Models.

The paper ranks eleven laws by the time T of a run and by a "position stability"

    S = sqrt(sum (x_k - mean x)^2 / (n - 1))                            its equation (1)

over the n values of the position that the solver returns. S is the standard deviation of the
motion: it grows with the amplitude and depends on the steps of the solver, but not on the
stability of a solution. Ranks per need are those of T and of S among the laws that the table ranks
for this need; J, S and Y are the paper's letters for static friction, the Stribeck effect and
pre-sliding.

After the tables, in eighty columns, are the results that cannot be reproduced, with numbers.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from math import inf, isfinite, nan
from textwrap import wrap
from time import process_time
from typing import Any, final

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from symfric import ALL_LAWS, BrownMcPhee, Law, Model, SolveError, simulate
from symfric.choice.friction import Friction
from symfric.choice.machine import OWN
from symfric.choice.measured import Requirements, measured
from symfric.choice.ranking import WIDTH, RankedLaw
from symfric.figures.regularisation import Machine, machine_of
from symfric.foundation import checks
from symfric.foundation.files import json_data
from symfric.foundation.numeric import Array
from symfric.scenes import PendulumBox, Rabinowicz, Scene

EQUAL = 1e-4
"""Error of the integrator at which our times are measured, relative to the motion of the law."""
SAMPLES = 20001
"""Number of equally spaced positions for S."""
RTOL, ATOL = 1e-3, 1e-8
"""Tolerances of the peer; the text states ode15s (default 1e-3) with an absolute error of 1e-8."""
WORK = 1_000_000_000
"""Largest number of CasADi instructions of a run, about three seconds."""
PATIENCE = 30.0
"""Largest processor time [s] of the peer."""


@final
@dataclass(frozen=True)
class Printed:
    """Law of the paper: name in the catalogue, needs for which it is ranked, T [s] and S [m]."""

    name: str
    needs: str
    T4: float
    S4: float
    T8: float
    S8: float

    def law(self) -> Law:
        """Return the law of the catalogue."""
        return ALL_LAWS[self.name]()


PRINTED = {
    "Smooth": Printed("coulomb", "", 2.6988, 0.127889, 3.5109, 0.058842),
    "Threlfall": Printed("threlfall", "", 2.7909, 0.116026, 4.3273, 0.064755),
    "Bengisu": Printed("bengisu_akay", "JS", 2.6242, 0.138757, 5.8561, 0.067982),
    "Karnopp": Printed("karnopp", "J", 2.3851, 0.139528, 6.5503, 0.070905),
    "Velocity-based": Printed("velocity_based", "J", 2.1976, 0.138141, 8.3748, 0.037149),
    "Awrejcewicz": Printed("awrejcewicz", "J", 2.3762, 0.125478, 6.1151, 0.071542),
    "Dahl": Printed("dahl", "Y", 9.6875, 0.134439, 45.3545, 0.068376),
    "LuGre": Printed("lugre", "JSY", 11.3336, 0.150088, 76.8279, 0.062963),
    "Elasto-plastic": Printed("elasto_plastic", "JSY", inf, 0.145011, 229.0278, 0.033126),
    "Stick-slip": Printed("stick_slip", "JS", 10.4979, 0.133829, 99.3741, 0.014088),
    "Gonthier": Printed("gonthier", "JSY", 16.7579, 0.146707, 129.9982, 0.053765),
}
"""Tables 4 and 8 as printed (S in m: the heading has a factor 100; "> 100" s is infinite here), and
the columns of tables 5 and 9 that have a rank for the law."""

COLUMNS: dict[str, Callable[[str], bool]] = {
    "J": lambda needs: "J" in needs,
    "S": lambda needs: "S" in needs,
    "Y": lambda needs: "Y" in needs,
    "J+S": lambda needs: needs == "JS",
    "J+S+Y": lambda needs: needs == "JSY",
}
"""Column of tables 5 and 9 -> True if a law has a rank in it; J+S ranks the laws without Y."""

TABLES: dict[str, tuple[type[Scene], str, str, str]] = {
    "rabinowicz": (Rabinowicz, "jing_mi_table_3", "table 4", "table 5"),
    "pendulum_box": (PendulumBox, "jing_mi_table_7", "table 8", "table 9"),
}
"""Scene -> its class, the preset with the paper's numbers, and the tables compared."""


@final
@dataclass(frozen=True)
class PaperRow:
    """Row of the comparison: a law with the printed and our values.

    Attributes:
        T, S: printed time [s] and standard deviation of x [m].
        time_s, attempts, rtol: processor time [s] of our run whose integrator's error is `EQUAL`,
            attempts of a step in it, relative tolerance.
        S_uniform, S_steps: S over equally spaced times, and over the integrator's own steps.
        S_peer, peer_steps: S over the steps of SciPy's BDF, which is related to ode15s, with the
            tolerances of the paper, and their number; NaN if the equations are not explicit.
        explicit_step: largest step [s] at which an explicit Runge-Kutta method is within 5 %.
        reason: reason why a number is missing.
    """

    name: str
    T: float
    S: float
    time_s: float = nan
    attempts: int = 0
    rtol: float = nan
    S_uniform: float = nan
    S_steps: float = nan
    S_peer: float = nan
    peer_steps: int = 0
    explicit_step: float | None = None
    reason: str = ""


@final
@dataclass(frozen=True)
class PaperComparison:
    """Tables of the paper with our numbers.

    Attributes:
        scene, times, ranks: names of the machine and of the tables.
        t_end: duration of the motion [s].
        error: error of the integrator at which our times are measured.
        rows: laws in the order of the paper.
    """

    scene: str
    times: str
    ranks: str
    t_end: float
    error: float
    rows: tuple[PaperRow, ...]

    def orders(self) -> dict[str, dict[str, list[str]]]:
        """Return column -> criterion -> laws in increasing order of the criterion.

        The criteria are printed T, our time, printed S, and our S over equal times and over steps.
        """
        by: Mapping[str, Callable[[PaperRow], float]] = {
            "printed T": lambda row: row.T,
            "our time": lambda row: row.time_s,
            "printed S": lambda row: row.S,
            "S equal": lambda row: row.S_uniform,
            "S steps": lambda row: row.S_steps,
        }
        return {
            column: {
                name: _sorted((r for r in self.rows if has(PRINTED[r.name].needs)), value)
                for name, value in by.items()
            }
            for column, has in COLUMNS.items()
        }

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; numbers that are not finite are null."""
        rows = json_data([asdict(row) for row in self.rows])
        return {"scene": self.scene, "tables": [self.times, self.ranks], "rows": rows,
                "orders": self.orders()}  # fmt: skip

    def lines(self) -> list[str]:
        """Return the lines of tables and evidence for a screen of eighty columns."""
        lacking = [f"{row.name}: {row.reason}" for row in self.rows if not isfinite(row.time_s)]
        texts = [
            [LEGEND, *lacking],
            [f"{self.ranks}: laws by printed and by our numbers, the smallest first"],
            reasons(self),
        ]
        first, ranks, last = ([line for t in text for line in wrap(t, WIDTH)] for text in texts)
        title = f"{PAPER}: {self.scene}, {self.times}"
        rows = map(_line, self.rows)
        return [
            *wrap(title, WIDTH), "", HEAD, *rows, "", *first, "", *ranks, *_orders(self), "", *last,
        ]  # fmt: skip


def _sorted(rows: Iterable[PaperRow], value: Callable[[PaperRow], float]) -> list[str]:
    """Return the names in order of a number; names without one are last, with a question mark."""
    known = list(rows)
    last = sorted(known, key=lambda row: (value(row) != value(row), value(row)))
    return [row.name if value(row) == value(row) else f"{row.name}?" for row in last]


def compare_with_paper(
    scene: str, names: Iterable[str] = PRINTED, progress: Callable[[str, float], None] | None = None
) -> PaperComparison:
    """Return the laws of the paper with its numbers, in "rabinowicz" or "pendulum_box".

    Raises:
        ValueError: another scene or law.
    """
    checks.choice("compare_with_paper: scene", scene, TABLES)
    chosen = checks.names("compare_with_paper: names", tuple(names), PRINTED)
    kind, preset, times, ranks = TABLES[scene]
    machine = machine_of(
        scene, partial(kind.preset, preset), None, ("x",), None, BrownMcPhee(), "vm"
    )
    rows: list[PaperRow] = []
    for k, name in enumerate(chosen):
        rows.append(_row(machine, name, first=times == "table 4"))
        if progress is not None:
            progress(name, (k + 1) / len(chosen))
    return PaperComparison(scene, times, ranks, machine.t_end, EQUAL, tuple(rows))


def _row(machine: Machine, name: str, first: bool) -> PaperRow:
    """Return the row of one law in the form of the preset."""
    printed = PRINTED[name]
    T, S = (printed.T4, printed.S4) if first else (printed.T8, printed.S8)
    try:
        return _measured(machine, name, printed.law(), T, S)
    except (SolveError, ValueError) as problem:
        return PaperRow(name, T, S, reason=" ".join(str(problem).split()).partition("; ")[0])


def _measured(machine: Machine, name: str, law: Law, T: float, S: float) -> PaperRow:
    model = machine.model(law)
    required = Requirements(
        machine, OWN, (), {"": Friction()}, None, EQUAL, 0.05, own=True, fixed=True, work=WORK,
    )  # fmt: skip
    row: RankedLaw = measured(required, name, law)
    t = np.linspace(0.0, machine.t_end, SAMPLES)
    run = simulate(model, machine.t_end, rtol=1e-6, t_eval=t, backend="vm")
    peer, steps = _peer(model, machine.t_end)
    return PaperRow(
        name, T, S, row.time_s, row.attempts, row.rtol, spread(run["x"]),
        spread(run.at(run.step_times)["x"]), peer, steps, row.explicit_step,
        row.reason or row.explicit_why,
    )  # fmt: skip


def spread(x: Array) -> float:
    """Return S [m] of the paper, the standard deviation of positions."""
    return float(np.std(x, ddof=1))


def _peer(model: Model, t_end: float) -> tuple[float, int]:
    """Return S over the steps of SciPy's BDF, and their number; S is NaN for implicit equations."""
    if model.z or model.events or model.holonomic:
        return nan, 0
    x, ode = model.vector("x"), model.ode
    if ode is None:
        return nan, 0
    f = ca.Function("f", [x], [ode])
    J = ca.Function("J", [x], [ca.jacobian(ode, x)])
    began = process_time()

    def rate(_: float, y: Array) -> Array:
        if process_time() - began > PATIENCE:
            raise TimeoutError
        return f(y).full().ravel()

    def slopes(_: float, y: Array) -> Array:
        return J(y).full()

    try:
        found: Any = solve_ivp(
            rate, (0.0, t_end), model.initial_state(), "BDF", rtol=RTOL, atol=ATOL, jac=slopes
        )
    except TimeoutError:
        return nan, 0
    if not found.success:
        return nan, int(found.t.size)
    place = [v.name for v in model.x].index("x")
    return spread(found.y[place]), int(found.t.size)


PAPER = "Jing and Mi, Investigation of Selection Mechanism of Friction Models in Multibody Systems"
STEP = 1e-6
"""Printed step size [s]."""
HEAD = (
    f"{'':<15}{'T [s]':>8}{'time [ms]':>11}{'tries':>8} |"
    f"{'S [cm]':>8}{'equal':>8}{'steps':>8}{'BDF':>8}"
)


LEGEND = (
    "T, S: printed. time, tries: processor time and attempts of our run whose integrator is 1e-4 "
    "off. equal, steps, BDF: S over equal times, over our steps, and over those of SciPy's BDF, "
    "the relative of ode15s, with the paper's absolute tolerance; explicit equations only."
)


def _line(row: PaperRow) -> str:
    T = "> 100" if row.T > 1e300 else f"{row.T:.2f}"
    spread = (row.S_uniform, row.S_steps, row.S_peer)
    time = f"{1e3 * row.time_s:.2f}" if isfinite(row.time_s) else "-"
    shown = "".join(f"{100 * s:>8.2f}" if isfinite(s) else f"{'-':>8}" for s in spread)
    tries = row.attempts or "-"
    return f"{row.name:<15}{T:>8}{time:>11}{tries:>8} |{100 * row.S:>8.2f}{shown}"


def _orders(found: PaperComparison) -> Iterator[str]:
    for column, orders in found.orders().items():
        for by, names in orders.items():
            text = f"{column:<6}{by:<10} {' < '.join(names)}"
            yield from wrap(text, WIDTH, subsequent_indent=17 * " ")


def reasons(found: PaperComparison) -> list[str]:
    """Return the reasons why printed numbers cannot be reproduced, with measured values."""
    return [text for text in (_of_times(found), _of_spread(found), _of_ranks(found), OPEN) if text]


def _of_times(found: PaperComparison) -> str:
    printed = [row.T for row in found.rows if isfinite(row.T)]
    ours = [row.time_s for row in found.rows if isfinite(row.time_s)]
    if not ours:
        return ""
    count = found.t_end / STEP
    steps = [row.explicit_step for row in found.rows if row.explicit_step]
    able = "; no explicit method takes this machine, whose reactions are unknowns of its equations"
    if steps:
        able = (
            f"; explicit steps of {min(steps):g} to {max(steps):g} s follow within 5 % for "
            f"{len(steps)} of {len(found.rows)} laws"
        )
    return (
        f"T: the table of the machine says Runge-Kutta with steps of {STEP:g} s, which are "
        f"{count:.2g} steps, {1e9 * min(printed) / count:.0f} ns each in the fastest run; the text "
        f"says ode15s, which chooses its steps{able}. Printed times span a factor "
        f"of {max(printed) / min(printed):.0f}, ours at equal error "
        f"{max(ours) / min(ours):.0f}. Processor and program are not named."
    )


def _of_spread(found: PaperComparison) -> str:
    known = [row for row in found.rows if isfinite(row.S_uniform) and isfinite(row.S_steps)]
    if not known:
        return ""
    most = max(known, key=lambda row: abs(row.S_steps / row.S_uniform - 1))
    off = {
        "equal times": [abs(row.S_uniform / row.S - 1) for row in known],
        "our steps": [abs(row.S_steps / row.S - 1) for row in known],
    }
    said = ", ".join(
        f"{100 * min(each):.0f} to {100 * max(each):.0f} % over {what}"
        for what, each in off.items()
    )
    return (
        "S is the standard deviation of x over the points that a solver returns, an amplitude and "
        f"no measure of stability: one motion of {most.name} has {100 * most.S_uniform:.1f} cm "
        f"over equal times and {100 * most.S_steps:.1f} cm over our steps. What is printed is "
        f"{said} away."
    )


def _of_ranks(found: PaperComparison) -> str:
    orders = found.orders().items()
    same = {
        by: [column for column, each in orders if each[f"printed {by}"] == each[ours]]
        for by, ours in (("T", "our time"), ("S", "S steps"))
    }
    said = [
        f"the order by {by} is ours in {', '.join(columns) or 'no column'}"
        for by, columns in same.items()
    ]
    return f"Ranks: {'; '.join(said)}."


OPEN = (
    "Not printed: who takes which velocity of tables 3 and 7 (the presets say how they are read "
    "here), Gonthier's v_d, the radius of the hinge in which table 7's N/m and m/s act, relative "
    "tolerances, initial conditions beyond positions. z_max = z_ba in table 7 leaves the "
    "elasto-plastic law of that form 0/0; here z_ss follows from sigma_0. The text contradicts its "
    "tables: for pre-sliding by S it chooses Elasto-plastic in both machines, table 5 has Dahl "
    "first; and it compares three machines, of which one, with its tables, is missing."
)
