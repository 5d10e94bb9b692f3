"""Error of smooth friction against dry friction: orders, coefficients and honest references."""

from dataclasses import replace
from math import atan2, hypot, pi
from pathlib import Path

import pytest

from symfric import BrownMcPhee, ExactCoulomb, parameters, simulate
from symfric.bench import RegularisationBenchmark, bench_regularisation
from symfric.bench.regularisation import CASES, last_cycle, peak
from symfric.scenes import Rabinowicz

BELT, CRANK = CASES[0], CASES[-1]


@pytest.fixture(scope="module")
def measured() -> RegularisationBenchmark:
    """The belt against dry friction and against its own limit, and the crank."""
    own = replace(BELT, name="own", exact=None, cycle=False)
    factors = (1e-2, 0.0, 1e-3, 0.0, 1e-4)
    belt = bench_regularisation(quick=True, cases=(BELT, own), factors=factors, rtols=(1e-8,))
    crank = bench_regularisation(quick=True, cases=(CRANK,), factors=factors, rtols=(1e-6, 1e-8))
    return RegularisationBenchmark((*belt.rows, *crank.rows))


def cycle(reach: float) -> tuple[float, float]:
    """Period and amplitude of a block that breaks away `reach` beyond where dry sliding rests it.

    Stick 2 reach / v_b; slip an arc of a harmonic oscillation about mu_d N / k.
    """
    scene = Rabinowicz(BELT.law)
    omega = (scene.k / scene.m) ** 0.5
    arc = 2 * pi - 2 * atan2(reach * omega, scene.v_belt)
    return 2 * reach / scene.v_belt + arc / omega, 2 * hypot(reach, scene.v_belt / omega)


def test_cycle_of_dry_friction_is_that_of_the_closed_form() -> None:
    scene = Rabinowicz(ExactCoulomb(mu_s=0.15, mu_d=0.1))
    run = simulate(scene.model(), 20.0)
    assert last_cycle(run) == pytest.approx(cycle(0.05 * scene.m * scene.g / scene.k), 1e-6)


def test_break_away_is_late_by_what_passing_a_fold_takes(
    measured: RegularisationBenchmark,
) -> None:
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
    rows = [r for r in measured.rows if r.case == BELT.name and r.rtol == 1e-8]
    for row, off in zip(rows, (0.25, 0.1, 0.05), strict=True):
        late = 2.33810741 * ((m * row.value) ** 2 / (k * v_b * N * c)) ** (1 / 3)
        pairs = zip(cycle(dry + v_b * late), cycle(dry), strict=True)
        expected = max(a / b - 1 for a, b in pairs)
        assert row.cycle_error == pytest.approx(expected, rel=off)
    assert rows[-1].order == pytest.approx(2 / 3, abs=0.02)


def test_reference_that_is_extrapolated_says_its_own_error(
    measured: RegularisationBenchmark,
) -> None:
    """Against exact dry friction: differences of the errors are those of the reference."""
    exact, own = ([r for r in measured.rows if r.case == n] for n in (BELT.name, "own"))
    for a, b in zip(exact, own, strict=True):
        assert abs(a.error - b.error) == pytest.approx(b.uncertain, rel=0.3)


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
    found = bench_regularisation(
        quick=True, cases=(case,), factors=(1e-4, 0.0, 1e-5), rtols=(1e-8,)
    )
    assert found.rows[0].reference == "ExactCoulomb"
    assert found.rows[1].order == pytest.approx(order, abs=0.03)
    assert found.rows[1].error < 1e-3


def test_where_nothing_creeps_the_tolerance_is_what_is_left(
    measured: RegularisationBenchmark,
) -> None:
    """A crank that slides until it stops: order 3, and a floor that follows rtol."""
    rows = [r for r in measured.rows if r.case == CRANK.name]
    loose, tight = ([r for r in rows if r.rtol == rtol] for rtol in (1e-6, 1e-8))
    assert loose[2].error == pytest.approx(loose[1].error, rel=0.1)
    assert loose[2].error > 100 * tight[2].error
    assert [r.steps for r in loose] == sorted((r.steps for r in loose), reverse=True)


def test_peak_of_the_law_falls_short_of_its_static_level() -> None:
    law = BrownMcPhee(mu_s=0.15, mu_d=0.1, v_t=1e-3)
    assert 0.9993 * 0.15 < peak(law) < 0.15
    assert parameters(law)["mu_s"].value == 0.15


def test_picture_and_files_hold_every_row(
    measured: RegularisationBenchmark, tmp_path: Path
) -> None:
    RegularisationBenchmark(measured.rows[:3]).plot(tmp_path / "r.svg")
    measured.write_csv(tmp_path / "r.csv")
    lines = (tmp_path / "r.csv").read_text().splitlines()
    assert len(lines) == 1 + len(measured.rows) == 1 + (2 + 2) * 3
    assert lines[0].startswith("case,parameter,unit,value,rtol,error")
    assert measured.to_dict()["rows"][0]["order"] is None
    assert (tmp_path / "r.svg").stat().st_size > 0
