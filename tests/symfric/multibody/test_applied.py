"""Laws that ask for the applied force, in joints: rest by modes against all modes tried."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
import pytest
from dry import DryMotion, blocks_on_belt, pendulum_box
from stored import stored

from symfric import Coulomb, Model, SolveError, Status, Variable, Viscous, simulate, simulate_many
from symfric.laws import (
    Ambrosio,
    Awrejcewicz,
    BengisuAkay,
    Dahl,
    ElastoPlastic,
    ExactCoulomb,
    Gonthier,
    Karnopp,
    Law,
    LeineSwitch,
    LuGre,
    StickSlip,
    Stribeck,
    Threlfall,
    VelocityBased,
)
from symfric.multibody import (
    Distance,
    JointFriction,
    JointSpringDamper,
    Mechanism,
    PrescribedMotion,
    Prismatic,
    Revolute,
    SpringDamper,
    UserConstraint,
    functions,
)
from symfric.scenes import Arm, FourBar, FourMass, PendulumBox, SliderCrank

pytestmark = pytest.mark.heavy
TIMES = np.linspace(0.02, 3.0, 150)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
often = partial(pytest.param, marks=pytest.mark.slow)
solve = partial(simulate)
SHARP = 1e-12
"""Width of |f|, so that a load of 1 N presses with 1 N."""


@pytest.mark.parametrize(("mu_s", "mu_d"), [(0.15, 0.1), often(0.15, 0.15), often(0.5, 0.3)])
def test_pendulum_box_is_the_motion_of_the_valid_modes(mu_s: float, mu_d: float) -> None:
    """Box and hinge stick and slip, and each changes what presses and loads the other."""

    def computed() -> np.ndarray:
        start = np.array([0.0, np.pi / 6, 0.0, 0.0])
        return DryMotion(pendulum_box(mu_d), mu_s).run(start, 3.0).at(TIMES)[:2]

    x, phi = stored(f"dry_pendulum_box_{mu_s}_{mu_d}", computed)
    law = ExactCoulomb(mu_s=mu_s, mu_d=mu_d)
    run = solve(PendulumBox(law).model(), 3.0, rtol=1e-10, t_eval=TIMES)
    assert run["x"] == pytest.approx(x, abs=1e-8)
    assert run["phi"] == pytest.approx(phi, abs=1e-8)


def test_functions_of_a_mechanism_refuse_what_they_cannot_know() -> None:
    with pytest.raises(
        ValueError, match="joint 'x' > friction > law: expected one that needs only v"
    ):
        functions(PendulumBox(ExactCoulomb()).mechanism())


@pytest.mark.parametrize(
    "law",
    [
        lambda w: Karnopp(D_v=w),
        often(lambda w: Awrejcewicz(epsilon=w, v_s=w)),
        often(lambda w: Stribeck(v_s=w, v_eps=w / 10)),
    ],
    ids=["Karnopp", "Awrejcewicz", "Stribeck"],
)
def test_smooth_laws_tend_to_dry_friction_with_their_width(law: Callable[[float], Law]) -> None:
    """To first order: a tenth of the width, a tenth of the error."""
    dry = solve(PendulumBox(ExactCoulomb()).model(), 1.0, rtol=1e-9, t_eval=TIMES[:50])
    errors: list[float] = []
    for width in (1e-4, 1e-5):
        run = solve(PendulumBox(law(width)).model(), 1.0, rtol=1e-8, t_eval=TIMES[:50])
        errors.append(float(np.abs(run["x"] - dry["x"]).max()))
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.02)
    assert errors[1] < 3e-6


ELEVEN = (
    *(Threlfall(), Karnopp(), LuGre(), Gonthier()),
    *map(often, (BengisuAkay(), VelocityBased(), Awrejcewicz(), Ambrosio())),
    *map(often, (Dahl(), ElastoPlastic(), StickSlip())),
)


@pytest.mark.parametrize("law", ELEVEN, ids=lambda law: type(law).__name__)
def test_all_laws_of_the_selection_paper_run_on_its_pendulum_box(law: Law) -> None:
    """Box and hinge take 7.69 J in a second of dry friction, and as much by any of these."""
    energy = solve(PendulumBox(law).model(), 1.0, samples=2)["energy"]
    assert energy[0] - energy[-1] == pytest.approx(7.69, rel=0.01)


def belt(
    laws: Sequence[Law], to_ground: Sequence[float], between: Sequence[float], v: float
) -> Model:
    """Blocks of 1 kg (g = 1) on a driven belt, with springs to the ground and between."""
    m = Mechanism("belt", gravity=(0.0, 0.0, -1.0))
    m.frame("ground.track", z=X, x=Z)
    m.frame("ground.wall", at=(-20.0, 0.0, 0.0))
    m.body("belt", 1.0, (1.0, 1.0, 1.0))
    m.frame("belt.track", z=X, x=Z)
    m.joint(Prismatic("belt_x", "ground.track", "belt.track", 0.0, v))
    m.constraint(PrescribedMotion("drive", "belt_x", lambda t: v * t, "slide"))
    for i, law in enumerate(laws):
        m.body(f"block{i}", 1.0, (1.0, 1.0, 1.0))
        m.frame(f"block{i}.foot", z=X, x=Z)
        m.frame(f"block{i}.far", at=(5.0, 0.0, 0.0))
        sole = JointFriction(law, eps=SHARP)
        m.joint(Prismatic(f"s{i}", "belt.track", f"block{i}.foot", 0.0, -v, sole))
        m.force(SpringDamper(f"spring{i}", "ground.wall", f"block{i}", to_ground[i], 20.0))
    for i, k in enumerate(between):
        m.force(SpringDamper(f"link{i}", f"block{i}", f"block{i + 1}.far", k, 5.0))
    return m.build()


def test_leine_switch_runs_the_published_cycle_as_a_mechanism() -> None:
    model = belt([LeineSwitch(mu_s=1.0, delta=3.0, form="event")], [1.0], [], 0.2)
    run = solve(model, 35.0, rtol=1e-9)
    slips = [t for t, name in run.happened if name == "s0_slip"]
    sticks = [t for t, name in run.happened if name == "s0_stick"]
    assert np.diff(slips) == pytest.approx(12.001031, abs=2e-6)
    assert sticks[-1] - slips[-1] == pytest.approx(4.296000, abs=2e-6)


def test_coupled_blocks_on_a_belt_move_in_pieces_of_matrix_exponentials() -> None:
    mu_s, mu_d, v = (0.5, 0.4), (0.3, 0.25), 0.1
    K = np.array([[1.6, -0.6], [-0.6, 1.4]])

    def computed() -> np.ndarray:
        found, y = blocks_on_belt(K, mu_s, mu_d, v, 40.0)
        return np.array([*(t for t, _, _ in found), *y])[None]

    (expected,) = stored("dry_blocks_on_belt", computed)
    laws = [ExactCoulomb(mu_s=a, mu_d=b) for a, b in zip(mu_s, mu_d, strict=True)]
    run = solve(belt(laws, [1.0, 0.8], [0.6], v), 40.0, rtol=1e-10)
    assert [t for t, _ in run.happened] == pytest.approx(expected[:-4], abs=1e-8)
    blocks = [run.final[f"s{i}"] + run.final["belt_x"] for i in range(2)]
    assert blocks == pytest.approx(expected[-4:-2], abs=1e-8)


def crank_and_slider(law: Law) -> Model:
    """Friction in the bearing of the crank and in the guide of the slider: one loop."""
    m = SliderCrank(law, omega=10.0).mechanism()
    guide = JointFriction(law, length=0.1, width=0.1)
    m.joints = [replace(j, friction=guide) if j.name == "slider" else j for j in m.joints]
    return m.build()


@pytest.mark.parametrize(
    ("model", "names", "end", "happens"),
    [
        (lambda law: FourMass(law).model(), ("x1", "x4"), 2.5, "x1_loop_stick"),
        often(crank_and_slider, ("crank", "slider"), 2.0, "crank_loop_stick"),
    ],
    ids=["four_mass", "slider_crank"],
)
def test_loops_are_the_limit_of_their_smooth_law(
    model: Callable[[Law], Model], names: tuple[str, str], end: float, happens: str
) -> None:
    """First order in the width, through turns in dead centres and rest of all contacts at once."""
    times = np.linspace(end / 50, end, 50)
    dry = solve(model(ExactCoulomb(mu_s=0.3, mu_d=0.3)), end, rtol=1e-10, t_eval=times)
    assert happens in [name for _, name in dry.happened]
    errors: list[list[float]] = []
    for width in (1e-4, 1e-5):
        run = solve(model(Coulomb(mu_d=0.3, v_eps=width)), end, rtol=1e-8, t_eval=times)
        errors.append([float(np.abs(run[n] - dry[n]).max()) for n in names])
    for coarse, fine in zip(*errors, strict=True):
        assert coarse / fine == pytest.approx(10.0, rel=0.05)


def pair(law_1: Law, law_2: Law, rate: float = 1.0) -> Model:
    """Blocks of 1 and 2 kg (g = 10) in one line, a rod between them and a force that grows."""
    m = Mechanism("pair", gravity=(0.0, 0.0, -10.0))
    force = m.input("push", "N")
    for i, (law, mass) in enumerate(((law_1, 1.0), (law_2, 2.0))):
        m.frame(f"ground.track{i}", at=(3.0 * i, 0.0, 0.0), z=X, x=Z)
        m.body(f"block{i}", mass, (1.0, 1.0, 1.0))
        m.frame(f"block{i}.foot", z=X, x=Z)
        sole = JointFriction(law, eps=SHARP)
        m.joint(Prismatic(f"s{i}", f"ground.track{i}", f"block{i}.foot", friction=sole))
    m.joint(Distance("rod", "block0", "block1", length=3.0))
    m.force(JointSpringDamper("motor", "s0", "slide", actuator=force))
    return m.build()


def test_rest_is_rest_for_as_long_as_it_lasts() -> None:
    """A thousand seconds at nine tenths of the break-away: no rate is left, so nothing drifts."""
    law = ExactCoulomb(mu_s=0.3, mu_d=0.3)
    run = solve(pair(law, law), 1000.0, u={"push": 8.1})
    assert run.happened == ()
    assert max(abs(run.final[n]) for n in ("s0", "s1", "s0_rate", "s1_rate")) < 1e-13


def test_every_contact_of_an_arm_obeys_its_mode() -> None:
    """Six contacts, falling from rest: some break away at the start, all of them consistent."""
    mu_s, mu_d = 0.15, 0.1
    times, model = np.linspace(0.0, 0.05, 201), Arm(ExactCoulomb(mu_s=mu_s, mu_d=mu_d)).model()
    run = solve(model, 0.05, rtol=1e-7, t_eval=times)
    assert len(run.happened) > 10
    work = np.zeros_like(times)
    for i in range(1, 7):
        v, F, N = (run[f"q{i}_{name}"] for name in ("slip", "friction", "N"))
        mode = np.round(run[f"q{i}_mode"])
        rest = mode == 0
        assert np.abs(v[rest]).max(initial=0.0) < 1e-12
        assert (np.abs(F) - mu_s * N)[rest].max(initial=-1.0) < 1e-6
        assert (mode * v).min() > -1e-9
        assert F[~rest] == pytest.approx((mu_d * N * mode)[~rest], rel=1e-9)
        work += run[f"q{i}_power"]
    lost = run["energy"][0] - run["energy"][-1]
    assert np.trapezoid(work, times) == pytest.approx(lost, rel=1e-4)


def test_a_light_box_jams_by_name_under_dry_friction_too() -> None:
    """At the same instant as under a smooth law, see `test_jamming`."""
    law = ExactCoulomb(mu_s=0.12, mu_d=0.12)
    scene = PendulumBox(law, hinge=Viscous(sigma_2=0.0), m_box=0.02)
    message = "stopped at t = 0.08911.*friction jams.*normal force of joint 'x' with ExactCoulomb"
    with pytest.raises(SolveError, match=message) as caught:
        solve(scene.model(), 3.0)
    assert caught.value.status is Status.JAMMED


@pytest.mark.slow
def test_absolute_coordinates_give_the_same_motion() -> None:
    scene = PendulumBox(ExactCoulomb())
    runs = [
        solve(scene.mechanism().build(formulation=f), 1.5, rtol=1e-9, samples=16)
        for f in ("joint", "absolute")
    ]
    assert [n for _, n in runs[0].happened] == [n for _, n in runs[1].happened]
    assert runs[1]["energy"] == pytest.approx(runs[0]["energy"], rel=1e-7)
    assert np.abs(runs[1].final["x_slip"]) < 1e-8


def driven(law: Law) -> Mechanism:
    m = Mechanism("driven")
    m.body("wheel", 1.0, (1.0, 1.0, 1.0))
    m.joint(Revolute("shaft", "ground", "wheel", 0.0, 1.0, JointFriction(law, radius=0.1)))
    m.constraint(PrescribedMotion("drive", "shaft", lambda t: t))
    return m


def _gap(at: Any, m: Mechanism) -> Any:
    (first, _), (second, _) = (at.along(joint, "slide") for joint in m.joints)
    return second - first


def moving_rod(law: Law) -> Mechanism:
    """A pair of blocks whose rod changes its length with time, as a coupling of both."""
    m = Mechanism("inchworm")
    for i in range(2):
        m.frame(f"ground.track{i}", z=X, x=Z)
        m.body(f"block{i}", 1.0, (1.0, 1.0, 1.0))
        m.frame(f"block{i}.foot", z=X, x=Z)
        m.joint(Prismatic(f"s{i}", f"ground.track{i}", f"block{i}.foot",
                          friction=JointFriction(law)))  # fmt: skip
    m.constraint(UserConstraint("rod", lambda at: _gap(at, m) - 0.1 * ca.sin(at.t) ** 2))
    return m


def test_where_rest_cannot_be_told_the_joint_is_named() -> None:
    law = ExactCoulomb()
    for m, message in (
        (
            driven(law),
            "joint 'shaft' > friction > law: expected one that needs only v and N, because",
        ),
        (moving_rod(law), "joint 's0', 's1' > friction > law: .* in a loop that moves with time"),
        (FourBar(Karnopp(form="event")).mechanism(), "one that stops only at v = 0 in a loop"),
    ):
        with pytest.raises(ValueError, match=message):
            m.build()
    with pytest.raises(ValueError, match="a loop of at most 8 coordinates"):
        SliderCrank(law).mechanism().build(formulation="absolute")

    with pytest.raises(ValueError, match="laws in one loop that all stick by modes, or none"):
        pair(ExactCoulomb(), Karnopp())


def test_members_of_an_ensemble_have_their_own_levels() -> None:
    mu = Variable("mu", "1", start=0.3)
    model = PendulumBox(ExactCoulomb(mu_s=mu.symbol, mu_d=mu.symbol)).mechanism().build((mu,))
    found = simulate_many(model, 0.3, p={"mu": np.array([0.1, 0.2])}, t_eval=[0.3])
    alone = solve(model, 0.3, p={"mu": 0.2})
    assert found["phi"][1, -1] == pytest.approx(alone.final["phi"], abs=1e-9)


@pytest.mark.slow
def test_gradients_go_through_stick_and_slip_of_a_loop() -> None:
    """Through rest of three contacts at once and their break-away, against differences."""
    mu_s, mu_d = (Variable(n, "1", start=x) for n, x in (("mu_s", 0.15), ("mu_d", 0.1)))
    law = ExactCoulomb(mu_s=mu_s.symbol, mu_d=mu_d.symbol)
    model = FourMass(law).mechanism().build((mu_s, mu_d))
    run = solve(model, 3.0, rtol=1e-9, sensitivities=["mu_s", "mu_d"])
    assert len(run.happened) > 2
    for v in (mu_s, mu_d):
        ends = [solve(model, 3.0, p={v.name: float(v.start) + h}, rtol=1e-11).final["x1"]
                for h in (1e-6, -1e-6)]  # fmt: skip
        slope = run.sensitivities[v.name]["x1"][-1]
        assert slope == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-6)


def test_rest_is_found_where_loads_change_by_much() -> None:
    """The coupler and the crank of a four-bar are pressed ten times as much when it comes to rest.

    Damped Newton did not get there; the rocker turns in its dead centres on the way.
    """
    law = ExactCoulomb(mu_s=0.431, mu_d=0.242, sigma_2=0.5)
    run = solve(FourBar(law).model(), 1.6, rtol=1e-6)
    names = [name for _, name in run.happened]
    assert names.count("theta_crank_loop_stick") == 4
    assert names.count("theta_rocker_turn") > 2
    assert min(run[f"theta_{part}_power"].min() for part in ("crank", "rocker")) > -1e-9


def test_blocks_that_move_differently_use_what_they_can_to_the_same_degree() -> None:
    """On two axes, a rod from 4 m to 3 m between them: s1' = -4/3 s0', 4 N + 3 N x 4/3 = 8 N."""
    m = Mechanism("corner", gravity=(0.0, 0.0, 0.0))
    force = m.input("push", "N")
    for i, (axis, start, load, mu) in enumerate(((X, 4.0, 20.0, 0.2), (Y, 3.0, 10.0, 0.3))):
        m.frame(f"ground.track{i}", z=axis, x=Z)
        m.body(f"block{i}", 1.0, (1.0, 1.0, 1.0))
        m.frame(f"block{i}.foot", z=axis, x=Z)
        sole = JointFriction(ExactCoulomb(mu_s=mu, mu_d=0.1), normal=load)
        m.joint(Prismatic(f"s{i}", f"ground.track{i}", f"block{i}.foot", start, friction=sole))
    m.joint(Distance("rod", "block0", "block1", length=5.0))
    m.force(JointSpringDamper("motor", "s0", "slide", actuator=force))
    run = solve(m.build(), 8.1, u={"push": lambda t: t}, samples=82)
    assert run.happened[0] == (pytest.approx(8.0, abs=1e-8), "s0_loop_slip")
    rest = run.t < 7.95
    assert run["s0_friction"][rest] == pytest.approx(4.0 * run.t[rest] / 8, abs=1e-9)
    assert run["s1_friction"][rest] == pytest.approx(-3.0 * run.t[rest] / 8, abs=1e-9)
