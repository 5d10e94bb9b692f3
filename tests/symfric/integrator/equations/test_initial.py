"""Start values and first steps, as a simulation shows them."""

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble, smooth_dae
from numpy.typing import NDArray

import symfric as sf
from symfric.foundation.programs import find_compiler
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.blocks import following
from symfric.integrator.equations.initial import (
    consistent,
    consistent_many,
    first_guess,
    first_step,
    smallest_step,
)
from symfric.scenes import SliderCrank

Array = NDArray[np.float64]

x = sf.Variable("x", "m", start=1.0)


def root(start: float, rhs: ca.SX) -> sf.Model:
    """0 = z^2 - rhs, with two solutions or none."""
    z = sf.Variable("z", "1", start=start)
    return sf.Model("root", x=(x,), z=(z,), ode=-x.symbol, alg=z.symbol**2 - rhs)


@pytest.mark.parametrize(("guess", "solution"), [(0.5, 2.0), (10.0, 2.0), (-0.1, -2.0)])
def test_start_value_of_an_algebraic_variable_chooses_the_branch(
    guess: float, solution: float
) -> None:
    run = sf.simulate(root(guess, 4 * x.symbol), 1.0, rtol=1e-8)
    assert run["z"][0] == pytest.approx(solution, rel=1e-12)
    assert run["z"] == pytest.approx(solution * np.exp(-run.t / 2), rel=1e-6)


def test_inconsistent_start_is_refused_naming_the_variable() -> None:
    with pytest.raises(
        ValueError, match=r"model 'root': expected consistent start .* equations for z near"
    ):
        sf.simulate(root(1.0, -1 - 0 * x.symbol), 1.0)


def test_undetermined_algebraic_variable_is_refused_naming_it() -> None:
    """The second equation does not hold it at all."""
    z = sf.Variable("z", "1")
    model = sf.Model("loose", x=(x,), z=(z,), ode=-z.symbol, alg=x.symbol - 1)
    with pytest.raises(ValueError, match="algebraic"):
        sf.simulate(model, 1.0)


def test_several_algebraic_variables_are_solved_together() -> None:
    y, z = sf.Variable("y", "1", start=1.0), sf.Variable("z", "1", start=0.5)
    equations = ca.vertcat(y.symbol**2 + z.symbol**2 - 4 * x.symbol, y.symbol - z.symbol)
    model = sf.Model("circle", x=(x,), z=(y, z), ode=-x.symbol, alg=equations)
    found = consistent(assemble(model), "here", np.array([1.0, 1.0, 0.5]), np.zeros(0))
    assert found == pytest.approx([1.0, np.sqrt(2), np.sqrt(2)], rel=1e-12)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("weight", [1e-12, 1.0, 1e12])
def test_neither_units_of_unknowns_nor_of_equations_matter(scale: float, weight: float) -> None:
    z = sf.Variable("z", "1", start=3 * scale)
    s = z.symbol / scale
    model = sf.Model(
        "scaled", x=(x,), z=(z,), ode=-x.symbol, alg=weight * (s**3 + s - 10 * x.symbol)
    )
    found = consistent(assemble(model), "here", np.array([1.0, 30 * scale]), np.zeros(0))
    assert found[1] == pytest.approx(2 * scale, rel=1e-14)


@pytest.mark.parametrize("guess", [0.0, 0.5, -3.0])
def test_solution_at_zero_is_found(guess: float) -> None:
    z = sf.Variable("z", "1")
    model = sf.Model("zero", x=(x,), z=(z,), ode=-x.symbol, alg=z.symbol + z.symbol**3)
    found = consistent(assemble(model), "here", np.array([1.0, guess]), np.zeros(0))
    assert found[1] == pytest.approx(0.0, abs=1e-12)


def test_guess_is_not_changed() -> None:
    before = np.array([1.0, 1.0, 0.3])
    found = consistent(assemble(smooth_dae().model), "here", before, np.zeros(0))
    assert before.tolist() == [1.0, 1.0, 0.3]
    assert found == pytest.approx([1.0, 1.0, 1.0])


def test_many_start_as_each_one_alone() -> None:
    """Both branches, guesses that need damping, guesses without a solution."""
    system = assemble(root(1.0, 4 * x.symbol))
    starts, guesses = [1.0, 2.0, -1.0, 0.5, 1.0], [0.5, -1e-3, 1.0, 1e6, 0.0]
    y, none = np.column_stack([starts, guesses]), np.zeros((5, 0))
    before = y.copy()
    found, failed = consistent_many(system, Columns(system.constraints), "here", y, none)
    np.testing.assert_array_equal(y, before)
    for m in range(5):
        if m in failed:
            with pytest.raises(ValueError, match=r"^here: expected consistent start values") as e:
                consistent(system, "here", y[m], none[m])
            assert failed[m] == str(e.value)
        else:
            alone = consistent(system, "here", y[m], none[m])
            assert found[m] == pytest.approx(alone, rel=1e-12)
    assert sorted(failed) == [2, 4]


def test_members_whose_residual_would_grow_take_the_same_branch_as_alone() -> None:
    """z^3 = z from 0.45: full steps overshoot and end at -1, where damped ones find the near 0."""
    z = sf.Variable("z", "1")
    model = sf.Model("cubic", x=(x,), z=(z,), ode=-x.symbol, alg=z.symbol**3 - z.symbol)
    system, guesses = assemble(model), np.array([0.45, 0.46, 0.9])
    y, none = np.column_stack([np.ones(3), guesses]), np.zeros((3, 0))
    found, failed = consistent_many(system, Columns(system.constraints), "here", y, none)
    assert not failed
    alone = [consistent(system, "here", y[m], none[m])[1] for m in range(3)]
    assert found[:, 1] == pytest.approx(alone, abs=1e-12)
    assert found[:, 1] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_bristle_starts_in_steady_sliding() -> None:
    """At -0.1 m/s far above the Stribeck velocity: z = -mu_d N / sigma_0."""
    run = sf.simulate(sf.rabinowicz(sf.LuGre()), 1e-3)
    assert run["z"][0] == pytest.approx(-0.1 * 0.8 * 9.81 / 1e5, rel=1e-9)
    assert run["z"] == pytest.approx(run["z"][0], rel=1e-6)


@pytest.mark.parametrize("rate", [1e-3, 1.0, 1e3, 1e6, 1e9])
def test_first_step_resolve_transients_of_any_speed(rate: float) -> None:
    """A second passes; the fast part lasts 1 / rate."""
    model = sf.Model("fast", x=(x,), ode=-rate * (x.symbol - 0.25))
    run = sf.simulate(model, 1.0, rtol=1e-8, t_eval=np.append(0.0, np.logspace(-12, 0, 60)))
    assert run["x"] == pytest.approx(0.25 + 0.75 * np.exp(-rate * run.t), abs=2e-8)


@pytest.mark.parametrize("span", [1e-9, 1.0, 1e9])
def test_span_of_any_length_is_started_and_ended(span: float) -> None:
    model = sf.Model("slow", x=(x,), ode=-x.symbol / span)
    run = sf.simulate(model, span, rtol=1e-8)
    assert run.final["x"] == pytest.approx(np.exp(-1), rel=1e-7)
    assert run.statistics.steps < 60


@pytest.mark.parametrize("law", [sf.BrownMcPhee(), sf.LuGre()])
def test_a_run_of_ages_does_not_begin_with_a_leap(law: sf.Law) -> None:
    """Over 1e20 s the first step took 1e12 s, to steady sliding that is unstable, with SUCCESS."""
    run = sf.simulate(sf.rabinowicz(law), 1e20, max_steps=1000, backend="vm", throw=False)
    assert run.status is sf.Status.MAX_STEPS
    begun = sf.simulate(sf.rabinowicz(law), 20.0, max_steps=1000, backend="vm")
    at = np.linspace(0.0, min(20.0, run.step_times[-1]), 50)
    assert run.at(at)["x"] == pytest.approx(begun.at(at)["x"], abs=1e-5)


def test_start_at_rest_in_all_derivatives_is_left() -> None:
    """x' = 5 t^4 from zero: nothing moves at first."""
    t, start = ca.SX.sym("t"), sf.Variable("x", "m")
    model = sf.Model("late", x=(start,), ode=5 * t**4 + 0 * start.symbol, t=t)
    run = sf.simulate(model, 2.0, rtol=1e-8)
    assert run["x"] == pytest.approx(run.t**5, abs=1e-6)


@pytest.mark.parametrize("backend", ["vm", "compiled"])
def test_smallest_step_follows_time_instead_of_its_end(backend: str) -> None:
    """Robertson's reactions over 1e11 s: the floor stood at 1e-15 t_end = 1e-4 s.

    Published at the end: a = 2.083340149701255e-8 (Test Set for IVP Solvers).
    """
    if backend == "compiled" and find_compiler() is None:
        pytest.skip("no C compiler")
    a, b = sf.Variable("a", "1", start=1.0, nominal=1e-8), sf.Variable("b", "1", nominal=1e-13)
    c = sf.Variable("c", "1")
    slow = -0.04 * a.symbol + 1e4 * b.symbol * c.symbol
    fast = 3e7 * b.symbol**2
    model = sf.Model("long", x=(a, b, c), ode=ca.vertcat(slow, -slow - fast, fast))
    run = sf.simulate(model, 1e11, rtol=1e-8, backend=backend, samples=2)
    many = sf.simulate_many(
        model, 1e11, x0={"a": [1.0, 1.0]}, rtol=1e-8, backend=backend, executor="serial"
    )
    assert run.statistics.smallest_step < 1e-4
    assert run.final["a"] == pytest.approx(2.083340149701255e-8, rel=1e-6)
    assert many["a"][:, 0] == pytest.approx(2 * [run.final["a"]], rel=1e-12)


def test_late_start_begins_with_a_step_that_time_can_resolve() -> None:
    """A second after 1e9 s, where the last digit of t is a tenth of a microsecond."""
    model = sf.Model("late", x=(x,), ode=-x.symbol)
    run = sf.simulate(model, 1e9 + 1, t_start=1e9, rtol=1e-8)
    assert run.final["x"] == pytest.approx(np.exp(-1), rel=1e-7)


def test_many_do_not_leap_to_a_far_solution() -> None:
    """A full step from 1.9 goes uphill on sin z = 0, and on from there to 4 pi; damped, to pi."""
    z = sf.Variable("z", "1")
    system = assemble(sf.Model("waves", x=(x,), z=(z,), ode=-x.symbol, alg=ca.sin(z.symbol)))
    y, none = np.array([[1.0, 1.9], [1.0, 3.0], [1.0, 0.3]]), np.zeros((3, 0))
    found, failed = consistent_many(system, Columns(system.constraints), "here", y, none)
    assert not failed
    assert found[:, 1] == pytest.approx([np.pi, np.pi, 0.0], abs=1e-12)


def test_a_quick_way_is_taken_where_it_leads_there() -> None:
    """The guess is put onto the constraints before; where it gives up, the search goes on."""
    model = SliderCrank(sf.BrownMcPhee()).model()
    system, none = assemble(model), np.zeros(0)
    follow = following(system)
    guess = first_guess(system, model, model.initial_state())
    searched, tried = consistent(system, "here", guess, none), list[bool]()

    def quick(y: Array, d: Array) -> Array | None:
        assert follow is not None
        defect = system.manifold.defect(y, d).full()  # type: ignore[union-attr]
        tried.append(bool(np.abs(defect).max() < 1e-9))
        return follow(y, d) if len(tried) < 2 else None

    for _ in range(2):
        found = consistent(system, "here", guess, none, quick)
        assert found == pytest.approx(searched, rel=1e-9, abs=1e-9 * np.abs(searched).max())
    assert tried == [True, True]


@pytest.mark.parametrize("t_start", [0.0, 3.0, -1e6])
def test_first_step_of_many_spans_have_the_bits_of_each(t_start: float) -> None:
    spans = np.array([1e-9, 0.1, 20.0, 999.0, 1000.1, 1e7])
    alone = [first_step(span, t_start) for span in spans.tolist()]
    assert first_step(spans, t_start).tolist() == alone
    assert smallest_step(spans).tolist() == [smallest_step(span) for span in spans.tolist()]
