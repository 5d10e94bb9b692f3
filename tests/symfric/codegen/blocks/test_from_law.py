"""Steps of laws with states: closed forms, bounds, impulse, order, loads of zero."""

from math import exp

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES, NO_STEP
from one_program import along, block_of
from rigs import prescribed_motion
from tables import Names, table

from symfric import LoadDependent, LuGre, MixedLubrication, Sum, Viscous, parameters, simulate
from symfric.codegen import law_block, plant_block
from symfric.codegen.blocks.held_step import force_of_rate, held_step
from symfric.foundation.parameters import param, parametric
from symfric.laws import GMS, Armstrong, Element, MaxwellSlip, Slider
from symfric.scenes import Rabinowicz

LOAD = 8.0
BRISTLE = ["lugre", "dahl", "lugre, delta 0.78, viscous", "lugre+dahl", "asymmetric(lugre)"]
z2 = ca.SX.sym("z", 2)


def starts(block) -> list[float]:
    return [float(v.start) for v in block.parameters]


def rolled(law, velocities, h, load=LOAD, state=None):
    """States after each step and mean forces, for held velocities, step sizes and loads."""
    block, n = block_of(law), len(velocities)
    p = np.tile(starts(block), (n, 1))
    p[:, -1] = h
    u = np.column_stack([velocities, np.broadcast_to(load, n)])
    states, outputs = along(block, u, p, [0.0] * len(block.states) if state is None else state)
    return states, outputs[:, 0]


def level(v, mu_s=0.15, mu_d=0.1, v_s=1e-3, load=LOAD):
    return load * (mu_d + (mu_s - mu_d) * exp(-((v / v_s) ** 2)))


@pytest.mark.parametrize("v", [2e-5, -1e-3, 0.1, -3.0])
def test_lugre_follows_the_exact_solution_and_its_mean_for_any_step(v):
    t_end, sigma_1, sigma_2 = 2e-4, 190.0, 0.4
    steady, rate = np.sign(v) * level(v) / 1e5, 1e5 * abs(v) / level(v)
    end = steady * (1 - exp(-rate * t_end))
    for law in (LuGre(sigma_2=sigma_2), LuGre(sigma_2=sigma_2, v_eps=0.0)):
        for steps in (1, 7, 100):
            states, forces = rolled(law, [v] * steps, t_end / steps)
            assert states[-1, 0] == pytest.approx(end, rel=1e-12)
            if steps == 1:
                mean = 1e5 * (steady - end / (rate * t_end)) + sigma_1 * end / t_end
                assert forces[0] == pytest.approx(mean + sigma_2 * v, rel=1e-11)


@pytest.mark.parametrize("name", BRISTLE)
def test_one_long_step_has_the_impulse_of_many_short_ones_and_sliding_is_the_reset(name):
    law = CASES[name]
    start = rolled(law, [3e-4, -2e-3], 1e-3)[0][-1]
    for v in (0.0, 1e-7, 4e-4, -0.02, 1.0):
        one, F = rolled(law, [v], 5e-3, state=start)
        many, parts = rolled(law, [v] * 50, 1e-4, state=start)
        assert one[-1] == pytest.approx(many[-1], rel=1e-10, abs=1e-17)
        assert F[0] == pytest.approx(parts.mean(), rel=1e-10)
    block = block_of(law)
    for v in (0.05, -2e-3):
        slid = block.reset("init_sliding")(0.0, starts(block), [v, LOAD])
        after, y = block.step(slid, starts(block), [v, LOAD])
        assert (after / slid).full() == pytest.approx(1.0, rel=1e-12)
        assert y.full() == pytest.approx(float(law.force(v, LOAD, slid)), rel=1e-9)


def test_rest_keeps_the_bristle_and_a_jump_is_bounded_by_its_travel():
    states, forces = rolled(LuGre(), [0.0] * 10, 1e-3, state=[5e-6])
    assert (states == 5e-6).all()
    assert forces == pytest.approx(1e5 * 5e-6)
    _, (force,) = rolled(LuGre(), [10.0], 1e-3)
    assert 0 < force <= level(10.0) * (1 + 190.0 / 1e5 / 1e-3) < 0.01 * 190.0 * 10.0


def errors_along_a_motion(law, steps):
    """Relative errors of the states and of the work, velocities taken at mid-step."""
    motion = prescribed_motion(law, LOAD, lambda t: 2e-3 * (1.2 + ca.sin(20 * t)))
    t = np.linspace(0.0, 0.5, steps + 1)
    reference = simulate(motion, 0.5, t_eval=t, rtol=1e-10)
    middle = 2e-3 * (1.2 + np.sin(20 * (t[1:] + t[:-1]) / 2))
    states, forces = rolled(law, middle, t[1], state=np.ravel(law.steady_state(0.0, LOAD)))
    expected = np.stack([reference[s.name][1:] for s in law.states], axis=1)
    worst = np.abs(states - expected).max() / np.abs(expected).max()
    return worst, abs(np.sum(forces * middle) * t[1] / reference["work"][-1] - 1)


SECOND_ORDER = table(__file__)["second_order"]


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] * (k > 1)) for k, n in enumerate(SECOND_ORDER)],
)
def test_second_order_along_a_motion(name):
    law, steps = Names().value(name), SECOND_ORDER[name]
    coarse, fine = (np.array(errors_along_a_motion(law, n)) for n in (steps, 2 * steps))
    assert fine[0] < 2e-3
    assert fine[1] < 2e-4
    assert (coarse / fine > 3.3).all()
    assert (coarse / fine < 5.0).all()


@pytest.mark.parametrize("text", table(__file__)["bounded"]["laws"])
def test_no_step_leaves_the_bounds_of_the_states(text):
    law = Names().value(text)
    random = np.random.default_rng(0)
    velocities = 10.0 ** random.uniform(-6, 3, 300) * random.choice([-1.0, 1.0], 300)
    for h in (1e-6, 1e-3, 1.0, 1e3):
        states, _ = rolled(law, velocities, h)
        limits = np.abs(np.ravel(law.steady_state(1e-7, LOAD)))
        if isinstance(law, Armstrong):  # level of its spring, filtered velocity, a fraction
            limits = np.array([0.15 * LOAD / 1e5, np.abs(velocities).max(), 1.0])
            assert (states[:, 2] >= 0).all()
        assert (np.abs(states) <= limits * (1 + 1e-6)).all()
        reached = np.abs(states).max(axis=0)
        assert (reached[: 1 if isinstance(law, Armstrong) else None] > 0.5 * limits[0]).any()
    v = random.choice([0.0, 1e-6, 1e-4, 1e-2, 1.0, 10.0], 1000) * random.choice([-1.0, 1.0], 1000)
    N, h = random.choice([1e-3, 1.0, 10.0, 60.0], 1000), random.choice([1e-4, 0.1, 10.0], 1000)
    assert np.isfinite(rolled(law, v, h, load=N)[0]).all()  # loads that fall by decades


def test_maxwell_slip_follows_its_virgin_curve_and_a_dropping_load():
    for law in (MaxwellSlip(), MaxwellSlip(form="event")):
        states, _ = rolled(law, [1e-2] * 5, 1e-3)
        _, after = rolled(law, [1e-2] * 60, 1e-3, load=LOAD / 2, state=states[-1])
        assert after[-1] == pytest.approx(0.1 * LOAD / 2, rel=1e-6)
        slow, _ = rolled(law, [-1e-10] * 5, 1e-3, load=LOAD / 2, state=states[-1])
        assert np.abs(slow).max() <= np.abs(states[-1]).max() * (1 + 1e-12)
    law = MaxwellSlip((Slider(5e4, 0.025), Slider(1e4, 0.05)), form="event")
    for x in (2e-6, 1e-5, 1e-4):
        expected = [min(5e4 * x, 0.025 * LOAD), min(1e4 * x, 0.05 * LOAD)]
        for steps in (1, 7):
            states, _ = rolled(law, [x / steps] * steps, 1.0)
            assert states[-1, :2] == pytest.approx(expected, rel=1e-12)
    _, (F,) = rolled(MaxwellSlip((Slider(1e5, 0.1),), form="event"), [1.6e-5], 1.0)
    assert pytest.approx(0.75 * 0.8, rel=1e-12) == F  # half the way up to 0.8 N, half at 0.8 N


def test_gms_by_events_relaxes_to_the_stribeck_curve_and_sticks_when_the_motion_turns():
    law = GMS((Element(1e9),), C=24.0, form="event")
    low, high = level(2e-4), level(5e-3)
    states, _ = rolled(law, [2e-4] * 100, 1e-2)
    assert states[-1] == pytest.approx([low, 1.0], rel=1e-9)
    for steps in (1, 10):
        after, _ = rolled(law, [5e-3] * steps, 1 / 24.0 * high / steps, state=states[-1])
        assert after[-1, 0] == pytest.approx(high + (low - high) * exp(-1), rel=1e-9)
    law = GMS(form="event")
    slid, _ = rolled(law, [1e-2] * 3, 0.1)
    rest, _ = rolled(law, [0.0] * 3, 0.1, state=slid[-1])
    assert (rest == slid[-1]).all()
    back, _ = rolled(law, [-1e-9], 0.1, state=rest[-1])
    assert back[0, 4:] == pytest.approx([0.0] * 4)
    assert back[0, :4] == pytest.approx(slid[-1, :4] - 1e-10 * np.array([5e4, 2.5e4, 1.5e4, 1e4]))


def test_sum_takes_the_step_of_each_term():
    terms = (GMS(form="event"), LuGre())
    state = np.array([0.01, 0.1, 0.05, 0.02, 1.0, 0.0, 1.0, 0.0]), np.array([2e-6])
    slip = 2e-3 * np.sin(np.arange(40) / 5)
    both = rolled(Sum(terms), slip, 1e-3, state=np.concatenate(state))
    one, other = (rolled(t, slip, 1e-3, state=z) for t, z in zip(terms, state, strict=True))
    assert both[0] == pytest.approx(np.hstack([one[0], other[0]]), rel=1e-13)
    assert both[1] == pytest.approx(one[1] + other[1], rel=1e-13)


def stepped(rate, start, h, rest, **options):
    step = held_step(rate, z2, h, ca.SX(rest), "here", **options)
    function = ca.Function("step", [z2], [step.end, step.mean, step.mean_rate, step.end_rate])
    return *(column.full().ravel() for column in function(start)), set(step.kinds)


def test_affine_states_are_exact_in_end_mean_and_rate():
    rate = ca.vertcat(3 - 2 * z2[0], -5 * z2[1])
    end, mean, mean_rate, end_rate, kinds = stepped(rate, [0.0, 1.0], 0.7, [1.5, 0.0])
    assert end == pytest.approx([1.5 * (1 - exp(-1.4)), exp(-3.5)], rel=1e-13)
    assert mean == pytest.approx([1.5 - end[0] / 1.4, (1 - end[1]) / 3.5], rel=1e-13)
    assert mean_rate * 0.7 == pytest.approx(end - np.array([0.0, 1.0]), rel=1e-13)
    assert end_rate == pytest.approx([3 - 2 * end[0], -5 * end[1]], rel=1e-13)
    assert kinds == {"exact"}
    end, *_, kinds = stepped(ca.vertcat(z2[1], -z2[1]), [0.0, 1.0], 2.0, [0.0, 0.0])
    assert end == pytest.approx([1 - exp(-2.0), exp(-2.0)], rel=1e-12)  # by its mean
    assert kinds == {"exact", "second order"}
    with pytest.raises(ValueError, match=r"here: .* states that depend on others"):
        held_step(ca.vertcat(z2[1] - z2[0] ** 3, -z2[1]), z2, 0.1, ca.SX([0.0, 0.0]), "here")


def test_a_step_ends_at_the_equilibrium_even_if_growth_overflows():
    for rate, start, mean_of_first in (
        (4 * (1 - z2[0] ** 30), 0.0, 1 - 0.25 / 2), (1e4 * z2[0] * (1 - z2[0]), 1e-3, None)
    ):  # fmt: skip
        end, mean, mean_rate, end_rate, _ = stepped(
            ca.vertcat(rate, 0 * z2[1]), [start, 0.0], 1.0, [1.0, 0.0]
        )
        assert (end[0], end_rate[0]) == (1.0, 0.0)
        assert np.isfinite([mean[0], mean_rate[0]]).all()
        assert mean_of_first is None or mean[0] == pytest.approx(mean_of_first)
    end, *_ = stepped(ca.vertcat(-(z2[0] ** 2), z2[1]), [1.0, 0.0], 0.1, [2.0, 0.0])
    assert end[0] < 1.0  # it moves away from the equilibrium
    at_mean = ca.vertcat(5 * (1 - (z2[0] / z2[1]) ** 30), 0 * z2[0] + 2)
    end, *_ = stepped(at_mean, [0.0, 1.0], 1.0, ca.vertcat(z2[1], z2[1]), each=True)
    assert end == pytest.approx([2.0, 3.0], rel=1e-12)


def test_rates_inside_a_force_become_symbols():
    rate = ca.vertcat(1 - z2[0], z2[1] ** 2)
    force, r = force_of_rate(3 * z2[0] + 7 * (1 - z2[0]), rate, z2)
    of = ca.Function("F", [z2, r], [force])
    assert float(of([2.0, 0.0], [5.0, 0.0])) == 6.0 + 35.0


def errors(law, speed, h, within=10):
    """Errors over one period of 1 s: of F against the true mean, of F_end against the true end,
    and of both against the mean of the next step."""
    steps = round(1.0 / h)
    motion = prescribed_motion(law, 10.0, lambda t: speed * ca.sin(2 * np.pi * t))
    fine = np.linspace(0.0, 1.0, steps * within + 1)
    true = simulate(motion, 1.0, t_eval=fine, rtol=1e-9)
    v = np.diff(-speed / (2 * np.pi) * np.cos(2 * np.pi * fine[::within])) / h
    u = np.column_stack([v, np.full(steps, 10.0)])
    _, found = along(law_block(law, h=h), u, state=[true[s.name][0] for s in law.states])
    F = true["friction"]
    mean = (F[:-1] + F[1:]).reshape(steps, within).sum(axis=1) / (2 * within)
    return found[:, 0] - mean, found[:, 1] - F[within::within], *(found[:-1] - mean[1:, None]).T


def rms(error):
    return float(np.sqrt(np.mean(error**2)))


def test_the_errors_of_both_forces_are_those_of_the_docstring():
    mean, end, *_ = errors(LuGre(), 0.3, 1e-3)
    moving = np.abs(np.sin(2 * np.pi * (np.arange(1000) + 0.5) / 1000)) > 0.1
    assert np.abs(mean).max() == pytest.approx(0.022, rel=0.2)
    assert np.abs(end).max() == pytest.approx(0.36, rel=0.1)
    assert max(np.abs(mean[moving]).max(), np.abs(end[moving]).max()) < 1e-4
    coarse = errors(LuGre(), 2e-3, 1e-3)
    assert rms(coarse[0]) < 1e-4
    assert rms(coarse[1]) < 1e-3
    assert np.abs(coarse[2]).max() == pytest.approx(0.050, rel=0.1)
    assert np.abs(coarse[3]).max() == pytest.approx(0.026, rel=0.1)
    fine = errors(LuGre(), 2e-3, 5e-4)
    order = [np.log2(rms(a) / rms(b)) for a, b in zip(coarse[:2], fine[:2], strict=True)]
    assert 1.5 < order[0] < 3.5
    assert 0.8 < order[1] < 3.0


STEPS, AWAY = 240, slice(60, 120)
"""Steps without load: oscillating, at rest, and oscillating again."""


def swung(law, first=0):
    """States and forces of an oscillation, part of it without load."""
    block, k = block_of(law), np.arange(first, STEPS)
    u = np.zeros((len(k), len(block.inputs)))
    u[:, 0] = np.where((k >= 90) & (k < 110), 0.0, 0.01 * np.sin(0.3 * k))
    u[:, 1] = np.where((k >= AWAY.start) & (k < AWAY.stop), 0.0, 10.0)
    return np.hstack(along(block, u))


@pytest.mark.parametrize("name", [n for n, law in CASES.items() if law.states and n not in NO_STEP])
def test_every_law_survives_a_load_of_zero(name):
    law = CASES[name]
    found = swung(law)
    assert np.isfinite(found).all()
    forgets = any("Without load" in use for use in block_of(law).use)
    if forgets and name not in ("rate_and_state", "rate_and_state, slip"):
        fresh, force = swung(law, AWAY.stop), found[:, len(law.states)]
        viscous = [float(p.value) for p in parameters(law).values() if p.role == "viscous"]
        assert np.abs(force[AWAY]).max() <= 0.01 * max(viscous, default=0.0) * 1.001
        assert np.abs(force[AWAY.stop :] - fresh[:, len(law.states)]).max() < 1e-4
        assert np.abs(force[AWAY.stop :]).max() > 0.5


def test_without_load_viscous_friction_and_preloads_remain():
    v = 0.01 * np.sin(0.3 * np.arange(STEPS))
    found = swung(Sum((LuGre(), Viscous(sigma_2=0.5))))[:, 1]
    assert found[60:90] == pytest.approx(0.5 * v[60:90])
    assert (found[90:110] == 0.0).all()
    assert np.abs(swung(LoadDependent(LuGre(), N_0=2.0))[AWAY, 1]).max() > 0.1
    reported = [any("Without load" in use for use in block_of(law).use) for law in (
        LuGre(), LoadDependent(LuGre(), N_0=2.0), CASES["lugre_normalised"]
    )]  # fmt: skip
    assert reported == [True, False, False]


@parametric
class Thick(Viscous):
    h: float = param(1.0, unit="m", doc="film thickness")


def test_the_step_size_is_no_parameter_of_a_law():
    for make in (law_block, lambda law: plant_block(Rabinowicz(law))):
        with pytest.raises(ValueError, match="h: expected a parameter of another name"):
            make(Thick())
    assert law_block(MixedLubrication()).sample_time is None
    assert plant_block(Rabinowicz(MixedLubrication())).sample_time == 1e-3
