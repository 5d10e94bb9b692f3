"""Steps of laws with states: closed forms, bounds, impulse, order; what is refused."""

from math import exp

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES
from rigs import prescribed_motion

from symfric import Dahl, LoadDependent, LuGre, Stribeck, Sum, law_from_text, parameters, simulate
from symfric.codegen import law_block
from symfric.foundation.graph import graph
from symfric.laws import (
    GMS,
    Armstrong,
    BoucWen,
    ElastoPlastic,
    Element,
    ExactCoulomb,
    Gonthier,
    HaessigFriedland,
    Karnopp,
    Lagged,
    Leuven,
    MaxwellSlip,
    RateAndState,
    Slider,
    StickSlip,
)

pytestmark = pytest.mark.heavy

LOAD = 8.0
BRISTLE = ["lugre", "dahl", "lugre, delta 0.78, viscous", "lugre+dahl", "asymmetric(lugre)"]


def rolled(block, velocities, h, load=LOAD, state=None):
    """States after each step and forces, columns."""
    p = [float(v.start) for v in block.parameters if v.name != "h"] + [h]
    z = ca.DM.zeros(len(block.states)) if state is None else ca.DM(state)
    steps = block.step.mapaccum("steps", len(velocities), {"base": 10})
    inputs = np.stack([velocities, np.full(len(velocities), load)])
    states, outputs = steps(z, np.tile(p, (len(velocities), 1)).T, inputs)
    return states.full().T, outputs.full()[0]


def level(v, mu_s=0.15, mu_d=0.1, v_s=1e-3, load=LOAD):
    return load * (mu_d + (mu_s - mu_d) * exp(-((v / v_s) ** 2)))


@pytest.mark.parametrize("v", [2e-5, -1e-3, 0.1, -3.0])
@pytest.mark.parametrize("steps", [1, 7, 100])
def test_lugre_follows_the_exact_solution_whatever_the_step(v, steps):
    t_end = 2e-4
    steady, rate = level(v) / 1e5, 1e5 * abs(v) / level(v)
    states, _ = rolled(law_block(LuGre()), [v] * steps, t_end / steps)
    exact = np.sign(v) * steady * (1 - exp(-rate * t_end))
    assert states[-1, 0] == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("v", [2e-5, -1e-3, 0.1, -3.0])
def test_lugre_force_is_the_mean_over_the_step(v):
    h, sigma_1, sigma_2 = 2e-4, 190.0, 0.4
    steady, rate = np.sign(v) * level(v) / 1e5, 1e5 * abs(v) / level(v)
    end = steady * (1 - exp(-rate * h))
    mean_state = steady - end / (rate * h)
    _, forces = rolled(law_block(LuGre(sigma_2=sigma_2)), [v], h)
    assert forces[0] == pytest.approx(1e5 * mean_state + sigma_1 * end / h + sigma_2 * v, rel=1e-11)


@pytest.mark.parametrize("name", BRISTLE)
@pytest.mark.parametrize("v", [0.0, 1e-7, 4e-4, -0.02, 1.0])
def test_impulse_of_one_long_step_is_that_of_many_short_ones(name, v):
    block = law_block(CASES[name])
    start = rolled(block, [3e-4, -2e-3], 1e-3)[0][-1]
    one, F = rolled(block, [v], 5e-3, state=start)
    many, parts = rolled(block, [v] * 50, 1e-4, state=start)
    assert one[-1] == pytest.approx(many[-1], rel=1e-10, abs=1e-17)
    assert F[0] == pytest.approx(parts.mean(), rel=1e-10)


@pytest.mark.parametrize("h", [1e-6, 1e-3, 1.0, 1e3])
def test_the_bristle_never_leaves_its_bound(h):
    random = np.random.default_rng(0)
    velocities = 10.0 ** random.uniform(-6, 3, 500) * random.choice([-1.0, 1.0], 500)
    states, _ = rolled(law_block(LuGre()), velocities, h)
    assert np.abs(states).max() <= 0.15 * LOAD / 1e5 * (1 + 1e-12)
    assert np.abs(states).max() > 0.6 * 0.15 * LOAD / 1e5


def test_explicit_euler_would_leave_it_at_the_same_step():
    z, v, h = 0.0, 0.1, 1e-3
    for _ in range(60):
        z += h * (v - 1e5 * abs(v) / level(v) * z)
    assert abs(z) > 1e3


def test_force_after_a_jump_is_bounded_by_the_travel_of_the_bristle():
    h, v = 1e-3, 10.0
    _, forces = rolled(law_block(LuGre()), [v], h)
    travel = level(v) / 1e5
    assert 0 < forces[0] <= level(v) + 190.0 * travel / h
    assert forces[0] < 0.01 * 190.0 * v


@pytest.mark.parametrize("name", BRISTLE)
@pytest.mark.parametrize("v", [0.05, -2e-3])
def test_long_sliding_is_where_the_reset_starts(name, v):
    law = CASES[name]
    block = law_block(law)
    p = [float(q.start) for q in block.parameters]
    start = block.reset("init_sliding")(0.0, p, [v, LOAD])
    after, y = block.step(start, p, [v, LOAD])
    assert (after / start).full() == pytest.approx(1.0, rel=1e-12)
    assert y.full() == pytest.approx(float(law.force(v, LOAD, start)), rel=1e-9)


def test_at_rest_nothing_moves():
    block = law_block(LuGre())
    states, forces = rolled(block, [0.0] * 10, 1e-3, state=[5e-6])
    assert (states == 5e-6).all()
    assert forces == pytest.approx(1e5 * 5e-6)


def errors_along_a_motion(law, steps):
    """Relative errors of the states and of the work, velocities taken at mid-step."""
    motion = prescribed_motion(law, LOAD, lambda t: 2e-3 * (1.2 + ca.sin(20 * t)))
    t = np.linspace(0.0, 0.5, steps + 1)
    reference = simulate(motion, 0.5, t_eval=t, rtol=1e-10)
    middle = 2e-3 * (1.2 + np.sin(20 * (t[1:] + t[:-1]) / 2))
    h, start = t[1], np.ravel(law.steady_state(0.0, LOAD))
    states, forces = rolled(law_block(law), middle, h, state=start)
    work = np.sum(forces * middle) * h
    expected = np.stack([reference[s.name][1:] for s in law.states], axis=1)
    worst = np.abs(states - expected).max() / np.abs(expected).max()
    return worst, abs(work / reference["work"][-1] - 1)


SECOND_ORDER = {
    "lugre": (LuGre(sigma_2=0.4), 200),
    "dahl": (Dahl(), 200),
    "dahl, n 2": (Dahl(n=2.0), 2000),
    "dahl, n 0.5": (Dahl(n=0.5), 2000),
    "elasto_plastic": (ElastoPlastic(), 2000),
    "bouc_wen": (BoucWen(), 2000),
    "maxwell_slip, n 2": (MaxwellSlip(n=2.0), 2000),
    "stick_slip": (StickSlip(D_max=1e-5), 2000),
    "gonthier": (Gonthier(), 2000),
    "rate_and_state": (RateAndState(), 2000),
    "lagged": (Lagged(Stribeck()), 2000),
    "armstrong": (Armstrong(n=2.0), 2000),
    "armstrong and lugre": (Sum((Armstrong(n=2.0), LuGre())), 2000),
}


@pytest.mark.parametrize("name", SECOND_ORDER)
def test_second_order_along_a_motion(name):
    law, steps = SECOND_ORDER[name]
    coarse, fine = (np.array(errors_along_a_motion(law, n)) for n in (steps, 2 * steps))
    assert fine[0] < 2e-3
    assert fine[1] < 2e-4
    assert (coarse / fine > 3.3).all()
    assert (coarse / fine < 5.0).all()


YIELDING = {
    "dahl, n 2": Dahl(n=2.0),
    "dahl, n 0.5": Dahl(n=0.5),
    "elasto_plastic": ElastoPlastic(),
    "bouc_wen": BoucWen(n=20.0),
    "maxwell_slip": MaxwellSlip(),
    "haessig_friedland": HaessigFriedland(),
    "maxwell_slip, event": MaxwellSlip(form="event"),
    "haessig_friedland, event": HaessigFriedland(form="event"),
    "gms, event": GMS(form="event"),
}


@pytest.mark.parametrize("name", YIELDING)
@pytest.mark.parametrize("h", [1e-6, 1e-3, 1.0, 1e3])
def test_no_step_leaves_the_bounds_of_the_states(name, h):
    law, random = YIELDING[name], np.random.default_rng(0)
    velocities = 10.0 ** random.uniform(-6, 3, 500) * random.choice([-1.0, 1.0], 500)
    states, _ = rolled(law_block(law), velocities, h)
    limits = np.abs(np.ravel(law.steady_state(1e-7, LOAD)))
    assert (np.abs(states) <= limits * (1 + 1e-6)).all()
    assert (np.abs(states).max(axis=0) > 0.5 * limits).all()


@pytest.mark.parametrize("law", [MaxwellSlip(), MaxwellSlip(form="event")])
def test_a_dropping_load_takes_the_force_with_it(law):
    block = law_block(law)
    states, _ = rolled(block, [1e-2] * 5, 1e-3)
    _, after = rolled(block, [1e-2] * 60, 1e-3, load=LOAD / 2, state=states[-1])
    assert after[-1] == pytest.approx(0.1 * LOAD / 2, rel=1e-6)
    slow, _ = rolled(block, [-1e-10] * 5, 1e-3, load=LOAD / 2, state=states[-1])
    assert np.abs(slow).max() <= np.abs(states[-1]).max() * (1 + 1e-12)


def test_maxwell_slip_by_events_follows_its_virgin_curve_in_any_steps():
    sliders = (Slider(5e4, 0.025), Slider(1e4, 0.05))
    block = law_block(MaxwellSlip(sliders, form="event"))
    for x in (2e-6, 1e-5, 1e-4):
        for steps in (1, 7):
            states, _ = rolled(block, [x / steps], 1.0)
            for _ in range(steps - 1):
                states, _ = rolled(block, [x / steps], 1.0, state=states[-1])
            expected = [min(5e4 * x, 0.025 * LOAD), min(1e4 * x, 0.05 * LOAD)]
            assert states[-1, :2] == pytest.approx(expected, rel=1e-12)


def test_mean_force_of_a_step_through_the_corner_is_that_of_its_ramp():
    block = law_block(MaxwellSlip((Slider(1e5, 0.1),), form="event"))
    _, (F,) = rolled(block, [1.6e-5], 1.0)  # half the way up to 0.8 N, half at 0.8 N
    assert pytest.approx(0.75 * 0.8, rel=1e-12) == F


def test_gms_by_events_relaxes_exponentially_to_the_stribeck_curve():
    law = GMS((Element(1e9),), C=24.0, form="event")
    block, low, high = law_block(law), level(2e-4), level(5e-3)
    states, _ = rolled(block, [2e-4] * 100, 1e-2)
    assert states[-1] == pytest.approx([low, 1.0], rel=1e-9)
    for steps in (1, 10):
        after, _ = rolled(block, [5e-3] * steps, 1 / 24.0 * high / steps, state=states[-1])
        assert after[-1, 0] == pytest.approx(high + (low - high) * exp(-1), rel=1e-9)


def test_gms_sticks_when_the_motion_turns_and_rests_in_between():
    block = law_block(GMS(form="event"))
    slid, _ = rolled(block, [1e-2] * 3, 0.1)
    rest, _ = rolled(block, [0.0] * 3, 0.1, state=slid[-1])
    assert (rest == slid[-1]).all()
    back, _ = rolled(block, [-1e-9], 0.1, state=rest[-1])
    assert back[0, 4:] == pytest.approx([0.0] * 4)
    assert back[0, :4] == pytest.approx(slid[-1, :4] - 1e-10 * np.array([5e4, 2.5e4, 1.5e4, 1e4]))


def test_a_static_law_is_one_function_of_v_and_N():
    block = law_block(Stribeck(sigma_2=0.4))
    assert block.is_function
    p = [float(q.start) for q in block.parameters]
    _, F = block.step([], p, [3e-4, LOAD])
    assert float(F) == pytest.approx(float(Stribeck(sigma_2=0.4).force(3e-4, LOAD)), rel=1e-14)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("lugre", "lugre"),
        ("coulomb+viscous", "coulomb_viscous"),
        ("asymmetric(coulomb+viscous)", "asymmetric_coulomb_viscous"),
    ],
)
def test_the_name_is_that_of_the_law_as_an_identifier(text, name):
    assert law_block(law_from_text(text)).name == name


def test_the_text_holds_the_equations_of_all_parts_once():
    block = law_block(law_from_text("asymmetric(coulomb+viscous)"))
    assert block.equations.count("F = mu_d N s(v / v_eps)") == 1
    assert block.equations.count("F = sigma_2 v") == 1
    assert block.doc.startswith("Law with different parameters")


def operations(**options) -> int:
    return graph(law_block(LuGre(), **options).step).operations


def test_folded_parameters_save_operations():
    everything = operations(free=tuple(parameters(LuGre())))
    default, few, none = operations(), operations(free=("mu_s",)), operations(free=(), h=1e-3)
    assert everything > default > few > none
    assert everything - none >= 8
    assert operations(fold=True, h=1e-3) == none


def test_fold_bakes_in_what_it_names_and_all_if_true():
    block = law_block(LuGre(), fold=("mu_s", "v_eps"))
    assert [p.name for p in block.parameters] == [
        "mu_d",
        "v_s",
        "sigma_0",
        "sigma_1",
        "sigma_2",
        "h",
    ]
    assert block.constants == {"mu_s": 0.15, "v_eps": 1e-15, "delta": 2.0}
    assert [p.name for p in law_block(LuGre(), fold=True).parameters] == ["h"]
    assert law_block(LuGre(), fold=True, h=1e-3).parameters == ()


def test_a_constant_exponent_spares_the_power():
    def powers(free) -> int:
        source = graph(law_block(Stribeck(), free=free).step)
        return sum(node.op in (ca.OP_POW, ca.OP_CONSTPOW) for node in source.nodes)

    assert powers(None) == 0
    assert powers(("delta",)) > 0


def test_free_keeps_exactly_the_named_parameters():
    block = law_block(LuGre(), free=("mu_s", "delta"), h=2e-3)
    assert [p.name for p in block.parameters] == ["mu_s", "delta"]
    assert block.constants["h"] == 2e-3
    assert set(block.constants) == {"h", *parameters(LuGre())} - {"mu_s", "delta"}


def test_parameters_without_effect_do_not_appear():
    assert "rho_eps" not in [p.name for p in law_block(Dahl()).parameters]


@pytest.mark.parametrize(
    ("law", "options", "message"),
    [
        (GMS(), {}, "gms.*states that have circular dependencies; gms with form = 'event'"),
        (Leuven(), {}, "have circular dependencies"),
        (ExactCoulomb(), {}, "modes follow zero crossings within the step; karnopp and leine"),
        (Karnopp(form="event"), {}, "got one whose modes follow zero crossings"),
        (Dahl(), {"free": ("rho_eps",)}, "free: expected parameters that have an effect"),
        (LuGre(), {"free": ("mu_x",)}, "got mu_x; did you mean mu_"),
        (LuGre(), {"free": ("mu_s", "mu_s")}, "every name once"),
        (LuGre(v_eps=0.0), {"free": ("v_eps",)}, "finite force at rest"),
        (LuGre(mu_s=ca.SX.sym("mu_s")), {}, "numbers as parameters, got symbols .'mu_s'"),
        (LuGre(), {"h": 0.0}, r"h: expected a number > 0 \[s\]"),
        (LuGre(), {"h": float("nan")}, r"h: expected a number > 0 \[s\]"),
        (LuGre(), {"name": "my law"}, "C identifier, got 'my law'"),
        (LuGre(), {"free": ("mu_s",), "fold": True}, "fold: expected none with free"),
        (LuGre(), {"fold": ("mu_z",)}, "fold: expected one of"),
        (LuGre(), {"fold": False}, "expected True, names, or None for the default, got False"),
        (Stribeck(), {"h": 1e-3}, "h: expected none for a law without states, which has no step"),
        (Stribeck(), {"h": 1e-3, "fold": ("a",)}, "fold: expected.*; h: expected none"),
    ],
)
def test_what_has_no_step_or_makes_no_sense_is_refused(law, options, message):
    with pytest.raises(ValueError, match=message):
        law_block(law, **options)


def test_original_laws_without_smoothing_have_a_step():
    v, steady = 1e-3, level(1e-3) / 1e5
    states, _ = rolled(law_block(LuGre(v_eps=0.0)), [0.0, v, v], 1e-3)
    assert states[0, 0] == 0.0
    assert states[-1, 0] == pytest.approx(steady * (1 - exp(-v / steady * 2e-3)), rel=1e-12)


def test_a_preload_keeps_the_step_finite_without_load():
    block = law_block(LoadDependent(LuGre(), N_0=2.0))
    states, forces = rolled(block, [1e-3, 0.0, -1e-3], 1e-3, load=0.0)
    assert np.isfinite(states).all()
    assert np.isfinite(forces).all()


def test_sum_takes_the_step_of_each_term():
    """Events and bristles side by side: what each block does alone, with the same constants."""
    terms = (GMS(form="event"), LuGre())
    state = np.array([0.01, 0.1, 0.05, 0.02, 1.0, 0.0, 1.0, 0.0]), np.array([2e-6])
    slip = 2e-3 * np.sin(np.arange(40) / 5)
    both = rolled(law_block(Sum(terms), free=()), slip, 1e-3, state=np.concatenate(state))
    one, other = (
        rolled(law_block(term, free=()), slip, 1e-3, state=z)
        for term, z in zip(terms, state, strict=True)
    )
    assert both[0] == pytest.approx(np.hstack([one[0], other[0]]), rel=1e-13)
    assert both[1] == pytest.approx(one[1] + other[1], rel=1e-13)


def test_sum_with_a_term_that_has_no_step_is_refused_by_reason():
    with pytest.raises(ValueError, match="modes follow zero crossings"):
        law_block(Sum((LuGre(), ExactCoulomb())))
    with pytest.raises(ValueError, match="have circular dependencies"):
        law_block(Sum((LuGre(), Leuven())))
