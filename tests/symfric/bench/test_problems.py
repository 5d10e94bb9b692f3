"""Published problems, mechanisms and regularisation: errors have known limits."""

from dataclasses import replace
from math import atan2, hypot, isnan, pi

import pytest

from symfric import BrownMcPhee, ExactCoulomb, Model, Variable, simulate
from symfric.bench import ivp, multibody, regularisation
from symfric.bench.ivp import ANDREWS, DIGITS, DRIFT, PROBLEMS, correct_digits
from symfric.bench.ivp_problems import InitialValueProblem
from symfric.bench.multibody import chain, chains, count, exponent
from symfric.bench.regularisation import CASES, last_cycle, peak
from symfric.bench.report import Row
from symfric.scenes import Rabinowicz

# ---- initial-value problems ----

LATE = {("ring modulator", "rodas5p"): 4}
"""Fewer digits than required at rtol 1e-6: fast oscillations add up their phases."""
MOST_STEPS = {
    "HIRES": 250, "Robertson": 350, "van der Pol": 800, "Oregonator": 1100,
    "Chemical Akzo Nobel": 130, "transistor amplifier": 4500, "Pleiades": 330,
    "Andrews' squeezer": 400, "car axis": 1100,
}  # fmt: skip
"""The squeezer in joint coordinates is a case of `multibody/test_loops.py`."""


def reached(
    problem: InitialValueProblem, method: str, rtol: float, engine: str | None = None
) -> Row:
    """A measurement with at least the required digits."""
    title, row = next(ivp.measure(problem, problem.model(), method, rtol, engine))
    assert title == DIGITS
    required = problem.digits[rtol]
    required = LATE.get((problem.name, method), required) if rtol == 1e-6 else required
    assert row["correct digits"] >= required > 0, row
    assert row["relative error"] == pytest.approx(10 ** -row["correct digits"])
    assert 0.001 < row["time per run [ms]"] < 1e5
    return row


def test_published_digits_are_reached_at_the_default_tolerance() -> None:
    """Andrews' squeezer was called singular, the amplifier discontinuous."""
    for problem in PROBLEMS:
        if problem.name in MOST_STEPS:
            row = reached(problem, "rodas5p", 1e-6, "vm")
            assert row["steps"] <= MOST_STEPS[problem.name], row


def test_published_digits_are_reached_at_a_tight_tolerance() -> None:
    """Robertson's reactions to 1e11 stopped at rtol <= 1e-8."""
    for name in ("HIRES", "Robertson", "Chemical Akzo Nobel"):
        reached(next(p for p in PROBLEMS if p.name == name), "rodas5p", 1e-10, "vm")


@pytest.mark.slow
def test_published_digits_are_reached_by_all_methods() -> None:
    for problem in PROBLEMS:
        for method in ivp.METHODS:
            for rtol in (1e-6,) if method in problem.laborious else (1e-6, 1e-10):
                reached(problem, method, rtol)


def test_drift_of_constraints_shrinks_with_the_tolerance() -> None:
    model = ANDREWS.model()
    rows = [dict(ivp.measure(ANDREWS, model, "rodas5p", rtol, "vm")) for rtol in (1e-6, 1e-8)]
    loose, tight = (row[DRIFT]["largest constraint violation"] for row in rows)
    assert 0.0 < tight < 1e-2 * loose < 1e-7


def test_digits_are_those_of_the_worst_signal() -> None:
    hires = PROBLEMS[0].model
    run = simulate(hires(), 1.0, backend="vm", samples=2)
    end = run.final
    other = InitialValueProblem("off", hires, 1.0, {"y1": end["y1"], "y2": end["y2"] * (1 + 1e-4)})
    digits, worst = correct_digits(other, run)
    assert (round(digits, 3), worst) == (4.0, "y2")
    assert (
        15 < correct_digits(InitialValueProblem("same", hires, 1.0, {"y1": end["y1"]}), run)[0] < 16
    )


def test_a_failure_is_noted_with_its_reason() -> None:
    y = Variable("y1", "1", start=1.0)
    model = Model("grow", x=(y,), ode=y.symbol**2)
    problem = InitialValueProblem("late", lambda: model, 1e3, {"y1": 1.0})
    (_, row), note = ivp.measure(problem, model, "rodas5p", 1e-6, "vm")
    assert isnan(row["correct digits"])
    assert "late, rodas5p: not run" in note and "grows without bound" in note


def test_every_tolerance_and_method_has_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ivp, "PROBLEMS", PROBLEMS[:1])
    made = ivp.bench(quick=True)
    assert [(r["method"], r["rtol"]) for r in made.tables[DIGITS]] == [
        ("rodas5p", 1e-6), ("radau5", 1e-6)
    ]  # fmt: skip
    assert "Test Set" in made.notes[0]
    laborious = replace(PROBLEMS[0], laborious=("radau5",))
    rows = [row for title, row in ivp._rows(laborious, quick=False) if title == DIGITS]
    assert [row["rtol"] for row in rows] == [1e-6, 1e-8, 1e-10, 1e-6]
    assert len({p.name for p in PROBLEMS}) == len(PROBLEMS) == 11
    assert all({*p.reference} <= {*p.model().signals} for p in PROBLEMS if "joint" not in p.name)


# ---- mechanisms ----

FOUR = ("frictionless", "constant normal", "reactions in one", "reactions in all")
ABSOLUTE = pytest.param("absolute", marks=pytest.mark.slow)
INSTRUCTIONS = ("instructions, accelerations", "instructions, step", "nonzeros of the Jacobian")
SIZES = {
    "joint": [(8, 2), (8, 2), (8, 3), (8, 5)],
    "absolute": [(56, 26), (56, 26), (56, 27), (56, 30)],
}
"""Two multipliers of the rods, in absolute coordinates those of all joints; slider 4 carries its
weight only, which is no unknown if its joint is in the tree."""


@pytest.mark.parametrize("coordinates", ["joint", ABSOLUTE])
def test_every_kind_of_friction_has_its_unknowns_and_its_cost(coordinates: str) -> None:
    rows = [count("four_mass", variant, coordinates) for variant in FOUR]
    assert [(r["states"], r["algebraic variables"]) for r in rows] == SIZES[coordinates]
    none, constant, one, every = rows
    for column in INSTRUCTIONS:
        assert none[column] < constant[column] < every[column], column
        assert none[column] < one[column] < every[column], column
    assert every["instructions, step"] < 2 * none["instructions, step"]


def test_chains_are_measured_up_to_the_budget() -> None:
    (_, short), (_, long), note = chains(chain, (2, 4))
    assert (short["links"], long["links"]) == (2, 4)
    assert 0 < short["instructions"] < long["instructions"]
    assert all(0.1 < row["time per step [us]"] < 1e5 for row in (short, long))
    assert all(0 < row["build time [s]"] < 60 for row in (short, long))
    assert "instructions 1." in note
    assert [row["links"] for title, row in chains(chain, (1, 2, 3), budget=0.0)] == [1]


def test_the_exponent_is_that_of_a_power_law_for_long_chains() -> None:
    rows = [{"links": n, "y": 1e-6 * n**1.3} for n in (8, 16, 32)]
    short = {"links": 2, "y": 1.0}
    assert exponent([short, *rows], "y") == pytest.approx(1.3)
    assert exponent([short, {"links": 4, "y": 2**1.3}], "y") == pytest.approx(1.3)


@pytest.mark.parametrize("t_end", [1.0, pytest.param(100.0, marks=pytest.mark.slow)])
def test_energy_of_frictionless_mechanisms_is_constant(t_end: float) -> None:
    for _, row in multibody.drifts(t_end):
        assert 0 < row["relative change of energy"] < 1e-8 * t_end, row


# ---- regularisation ----

BELT, CRANK = CASES[0], CASES[-1]
FACTORS = (1e-2, 1e-3, 1e-4)


@pytest.fixture(scope="module")
def measured() -> dict[str, list[Row]]:
    """The belt against dry friction and against its own limit, and the crank."""
    own = replace(BELT, name="own", exact=None, cycle=False)
    found: dict[str, list[Row]] = {}
    for case, rtols in ((BELT, (1e-8,)), (own, (1e-8,)), (CRANK, (1e-6, 1e-8))):
        _, *rows = regularisation.rows(case, FACTORS, rtols, 2, "vm")
        found[case.name] = [row for _, row in rows]
    return found


def cycle(reach: float) -> tuple[float, float]:
    """Period and amplitude of a block that breaks away `reach` beyond where dry sliding rests it.

    Stick 2 reach / v_b; slip an arc of a harmonic oscillation about mu_d N / k.
    """
    scene = Rabinowicz(BELT.law)
    omega = (scene.k / scene.m) ** 0.5
    arc = 2 * pi - 2 * atan2(reach * omega, scene.v_belt)
    return 2 * reach / scene.v_belt + arc / omega, 2 * hypot(reach, scene.v_belt / omega)


def test_the_cycle_of_dry_friction_is_that_of_the_closed_form() -> None:
    scene = Rabinowicz(ExactCoulomb(mu_s=0.15, mu_d=0.1))
    run = simulate(scene.model(), 20.0)
    assert last_cycle(run) == pytest.approx(cycle(0.05 * scene.m * scene.g / scene.k), 1e-6)
    assert last_cycle(simulate(scene.model(), 1.0)).size == 0


@pytest.mark.slow
def test_break_away_is_late_by_the_passage_of_a_fold(measured: dict[str, list[Row]]) -> None:
    """Riccati's m v_t w' = k v_b t + N c w^2 blows up at the first zero of the Airy function.

    Near its peak the law is N (mu_s - c w^2), w = v/v_t - 1, c = 3/4 (mu_s - mu_d). The spring is
    stretched further by v_b T until then: order 2/3.
    """
    law = BELT.law
    assert isinstance(law, BrownMcPhee)
    scene = Rabinowicz(law)
    m, k, v_b, N = scene.m, scene.k, scene.v_belt, scene.m * scene.g
    c = 0.75 * (law.mu_s - law.mu_d)
    dry = (peak(law) - law.mu_d) * N / k
    rows = measured[BELT.name]
    for row, off in zip(rows, (0.25, 0.1, 0.05), strict=True):
        late = 2.33810741 * ((m * row["value"]) ** 2 / (k * v_b * N * c)) ** (1 / 3)
        pairs = zip(cycle(dry + v_b * late), cycle(dry), strict=True)
        expected = max(a / b - 1 for a, b in pairs)
        assert row["error of the last cycle"] == pytest.approx(expected, rel=off)
    assert isnan(rows[0]["order"])
    assert rows[-1]["order"] == pytest.approx(2 / 3, abs=0.02)
    assert rows[0]["parameter"] == "v_t [m/s]"


def test_an_extrapolated_reference_states_its_own_error(measured: dict[str, list[Row]]) -> None:
    """Against exact dry friction: differences of the errors are those of the reference."""
    for a, b in zip(measured[BELT.name], measured["own"], strict=True):
        difference = abs(a["error"] - b["error"])
        assert difference == pytest.approx(b["error of the reference"], rel=0.3)
        assert isnan(b["error of the last cycle"])


@pytest.mark.parametrize(
    ("name", "order"),
    [
        ("pendulum_box brown_mcphee", 1.0),
        pytest.param("pendulum_box lugre_normalised", 0.5, marks=pytest.mark.slow),
        pytest.param("four_mass coulomb", 0.9, marks=pytest.mark.slow),
        pytest.param("rabinowicz lugre", 0.57, marks=pytest.mark.slow),
    ],
)
def test_laws_tend_to_friction_without_regularisation(name: str, order: float) -> None:
    """Creep is of order v_t (with tanh times a logarithm), bristles turn in sigma_0^(-1/2)."""
    (case,) = (c for c in CASES if c.name == name)
    note, _, (_, last) = regularisation.rows(case, (1e-4, 1e-5), (1e-8,), 2, "vm")
    assert "compared with ExactCoulomb" in note
    assert last["order"] == pytest.approx(order, abs=0.03)
    assert last["error"] < 1e-3


def test_without_creep_the_error_of_the_integrator_remains(measured: dict[str, list[Row]]) -> None:
    """A crank that slides until it stops: order 3, and a floor that follows rtol."""
    rows = measured[CRANK.name]
    loose, tight = ([r for r in rows if r["rtol"] == rtol] for rtol in (1e-6, 1e-8))
    assert loose[2]["error"] == pytest.approx(loose[1]["error"], rel=0.1)
    assert loose[2]["error"] > 100 * tight[2]["error"]
    assert [r["steps"] for r in loose] == sorted((r["steps"] for r in loose), reverse=True)
    assert all(0.01 < r["time per run [ms]"] < 1e4 for r in rows)
