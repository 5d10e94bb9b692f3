"""Laws that ask for the applied force, in joints: rest by modes against all modes tried."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
import pytest
from chains import X, Y, Z, attach
from dry import DryMotion, blocks_on_belt, pendulum_box
from stored import stored

from symfric import Coulomb, Model, SolveError, Status, Variable, Viscous, simulate, simulate_many
from symfric import multibody as mb
from symfric.laws import ALL_LAWS, Awrejcewicz, ExactCoulomb, Karnopp, Law, Stribeck
from symfric.scenes import Arm, FourBar, FourMass, PendulumBox, SliderCrank

pytestmark = pytest.mark.heavy
TIMES = np.linspace(0.02, 3.0, 150)
often = partial(pytest.param, marks=pytest.mark.slow)
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
    run = simulate(PendulumBox(law).model(), 3.0, rtol=1e-10, t_eval=TIMES)
    assert run["x"] == pytest.approx(x, abs=1e-8)
    assert run["phi"] == pytest.approx(phi, abs=1e-8)


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
    laws, how = (ExactCoulomb(), law(1e-4), law(1e-5)), {"rtol": 1e-9, "t_eval": TIMES[:50]}
    dry, *smooth = (simulate(PendulumBox(one).model(), 1.0, **how)["x"] for one in laws)
    errors = [float(np.abs(x - dry).max()) for x in smooth]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.02)
    assert errors[1] < 3e-6


TWO = ("karnopp", "lugre")
NINE = ("bengisu_akay", "velocity_based", "awrejcewicz", "ambrosio", "dahl", "elasto_plastic",
        "stick_slip", "threlfall", "gonthier")  # fmt: skip


@pytest.mark.parametrize("name", [*TWO, *map(often, NINE)])
def test_all_laws_of_the_selection_paper_run_on_its_pendulum_box(name: str) -> None:
    """Box and hinge take 7.69 J in a second of dry friction, and as much by any of these."""
    energy = simulate(PendulumBox(ALL_LAWS[name]()).model(), 1.0, samples=2)["energy"]
    assert energy[0] - energy[-1] == pytest.approx(7.69, rel=0.01)


def block(m: mb.Mechanism, i: int, law: Law, parent: str = "ground", **more: Any) -> None:
    """A block on a level track, with friction that its load of 1 N presses by 1 N."""
    sole = mb.JointFriction(law, eps=SHARP)
    attach(
        m, mb.Prismatic, f"s{i}", f"block{i}", parent, **{"z": X, "x": Z, "friction": sole} | more
    )


def belt(
    laws: Sequence[Law], to_ground: Sequence[float], between: Sequence[float], v: float
) -> Model:
    """Blocks of 1 kg (g = 1) on a driven belt, with springs to the ground and between."""
    m = mb.Mechanism("belt", gravity=(0.0, 0.0, -1.0))
    m.frame("ground.wall", at=(-20.0, 0.0, 0.0))
    attach(m, mb.Prismatic, "belt_x", "belt", z=X, x=Z, rate=v)
    m.constraint(mb.PrescribedMotion("drive", "belt_x", lambda t: v * t, "slide"))
    for i, law in enumerate(laws):
        block(m, i, law, "belt", rate=-v)
        m.frame(f"block{i}.far", at=(5.0, 0.0, 0.0))
        m.force(mb.SpringDamper(f"spring{i}", "ground.wall", f"block{i}", to_ground[i], 20.0))
    for i, k in enumerate(between):
        m.force(mb.SpringDamper(f"link{i}", f"block{i}", f"block{i + 1}.far", k, 5.0))
    return m.build()


def test_coupled_blocks_on_a_belt_move_in_pieces_of_matrix_exponentials() -> None:
    mu_s, mu_d, v = (0.5, 0.4), (0.3, 0.25), 0.1
    K = np.array([[1.6, -0.6], [-0.6, 1.4]])

    def computed() -> np.ndarray:
        found, y = blocks_on_belt(K, mu_s, mu_d, v, 40.0)
        return np.array([*(t for t, _, _ in found), *y])[None]

    (expected,) = stored("dry_blocks_on_belt", computed)
    laws = [ExactCoulomb(mu_s=a, mu_d=b) for a, b in zip(mu_s, mu_d, strict=True)]
    run = simulate(belt(laws, [1.0, 0.8], [0.6], v), 40.0, rtol=1e-10)
    assert [t for t, _ in run.happened] == pytest.approx(expected[:-4], abs=1e-8)
    blocks = [run.final[f"s{i}"] + run.final["belt_x"] for i in range(2)]
    assert blocks == pytest.approx(expected[-4:-2], abs=1e-8)


def test_a_loop_is_the_limit_of_its_smooth_law() -> None:
    """First order in the width, through rest of all contacts at once."""
    laws = ExactCoulomb(mu_s=0.3, mu_d=0.3), *(Coulomb(mu_d=0.3, v_eps=w) for w in (1e-4, 1e-5))
    how = {"rtol": 1e-9, "t_eval": np.linspace(0.05, 2.5, 50)}
    dry, *smooth = (simulate(FourMass(law).model(), 2.5, **how) for law in laws)
    assert "x1_loop_stick" in [name for _, name in dry.happened]
    for name in ("x1", "x4"):
        coarse, fine = (float(np.abs(run[name] - dry[name]).max()) for run in smooth)
        assert coarse / fine == pytest.approx(10.0, rel=0.05)


def pair(law_1: Law, law_2: Law) -> Model:
    """Blocks of 1 and 2 kg (g = 10) in one line, a rod between them and a force that grows."""
    m = mb.Mechanism("pair", gravity=(0.0, 0.0, -10.0))
    force = m.input("push", "N")
    for i, law in enumerate((law_1, law_2)):
        block(m, i, law, mass=1.0 + i, at=(3.0 * i, 0.0, 0.0))
    m.joint(mb.Distance("rod", "block0", "block1", length=3.0))
    m.force(mb.JointSpringDamper("motor", "s0", "slide", actuator=force))
    return m.build()


def test_rest_is_rest_for_as_long_as_it_lasts() -> None:
    """A thousand seconds at nine tenths of the break-away: no rate is left, so nothing drifts."""
    law = ExactCoulomb(mu_s=0.3, mu_d=0.3)
    run = simulate(pair(law, law), 1000.0, u={"push": 8.1})
    assert run.happened == ()
    assert max(abs(run.final[n]) for n in ("s0", "s1", "s0_rate", "s1_rate")) < 1e-13


def test_every_contact_of_an_arm_obeys_its_mode() -> None:
    """Six contacts, falling from rest: some break away at the start, all of them consistent."""
    mu_s, mu_d = 0.15, 0.1
    times, model = np.linspace(0.0, 0.05, 201), Arm(ExactCoulomb(mu_s=mu_s, mu_d=mu_d)).model()
    run = simulate(model, 0.05, rtol=1e-7, t_eval=times)
    assert len(run.happened) >= 3
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
    """At the same instant as under a smooth law."""
    law = ExactCoulomb(mu_s=0.12, mu_d=0.12)
    scene = PendulumBox(law, hinge=Viscous(sigma_2=0.0), m_box=0.02)
    message = "stopped at t = 0.08911.*friction jams.*normal force of joint 'x' with ExactCoulomb"
    with pytest.raises(SolveError, match=message) as caught:
        simulate(scene.model(), 3.0)
    assert caught.value.status is Status.JAMMED


@pytest.mark.slow
def test_absolute_coordinates_give_the_same_motion() -> None:
    scene = PendulumBox(ExactCoulomb())
    runs = [
        simulate(scene.mechanism().build(formulation=f), 1.5, rtol=1e-9, samples=16)
        for f in ("joint", "absolute")
    ]
    assert [n for _, n in runs[0].happened] == [n for _, n in runs[1].happened]
    assert runs[1]["energy"] == pytest.approx(runs[0]["energy"], rel=1e-7)
    assert np.abs(runs[1].final["x_slip"]) < 1e-8


def driven(law: Law) -> mb.Mechanism:
    m = mb.Mechanism("driven")
    attach(m, mb.Revolute, "shaft", "wheel", rate=1.0, friction=mb.JointFriction(law, radius=0.1))
    m.constraint(mb.PrescribedMotion("drive", "shaft", lambda t: t))
    return m


def moving_rod(law: Law) -> mb.Mechanism:
    """A pair of blocks whose rod changes its length with time, as a coupling of both."""
    m = mb.Mechanism("inchworm")
    for i in range(2):
        block(m, i, law)

    def gap(at: Any) -> Any:
        (first, _), (second, _) = (at.along(joint, "slide") for joint in m.joints)
        return second - first - 0.1 * ca.sin(at.t) ** 2

    m.constraint(mb.UserConstraint("rod", gap))
    return m


def test_where_rest_cannot_be_determined_the_joint_is_named() -> None:
    law, named = ExactCoulomb(), "> friction > law: expected one that needs only v"
    for build, message in (
        (driven(law).build, f"joint 'shaft' {named} and N, because"),
        (moving_rod(law).build, "joint 's0', 's1' > friction > law: .* in a loop that moves"),
        (FourBar(Karnopp(form="event")).model, "one that stops only at v = 0 in a loop"),
        (partial(SliderCrank(law).mechanism().build, formulation="absolute"),
         "a loop of at most 8 coordinates"),
        (partial(pair, law, Karnopp()), "laws in one loop that all stick by modes, or none"),
        (partial(mb.functions, PendulumBox(law).mechanism()), f"joint 'x' {named}"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            build()


def test_members_of_an_ensemble_have_their_own_levels() -> None:
    mu = Variable("mu", "1", start=0.3)
    model = PendulumBox(ExactCoulomb(mu_s=mu.symbol, mu_d=mu.symbol)).mechanism().build((mu,))
    assert {"x_F_e": "N", "phi_F_e": "N"}.items() <= {v.name: v.unit for v in model.z}.items()
    found = simulate_many(model, 0.3, p={"mu": np.array([0.1, 0.2])}, t_eval=[0.3])
    alone = simulate(model, 0.3, p={"mu": 0.2})
    assert found["phi"][1, -1] == pytest.approx(alone.final["phi"], abs=1e-9)


@pytest.mark.slow
def test_gradients_go_through_stick_and_slip_of_a_loop() -> None:
    """Through rest of three contacts at once and their break-away, against differences."""
    mu_s, mu_d = (Variable(n, "1", start=x) for n, x in (("mu_s", 0.15), ("mu_d", 0.1)))
    law = ExactCoulomb(mu_s=mu_s.symbol, mu_d=mu_d.symbol)
    model = FourMass(law).mechanism().build((mu_s, mu_d))
    run = simulate(model, 3.0, rtol=1e-9, sensitivities=["mu_s", "mu_d"])
    assert len(run.happened) > 2
    for v in (mu_s, mu_d):
        ends = [simulate(model, 3.0, p={v.name: float(v.start) + h}, rtol=1e-11).final["x1"]
                for h in (1e-6, -1e-6)]  # fmt: skip
        slope = run.sensitivities[v.name]["x1"][-1]
        assert slope == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-6)


def test_rest_is_found_where_loads_change_by_much() -> None:
    """The coupler and the crank of a four-bar are pressed ten times as much when it comes to rest.

    Damped Newton did not get there; the rocker turns in its dead centres on the way.
    """
    law = ExactCoulomb(mu_s=0.431, mu_d=0.242, sigma_2=0.5)
    run = simulate(FourBar(law).model(), 1.6, rtol=1e-6)
    names = [name for _, name in run.happened]
    assert names.count("theta_crank_loop_stick") == 4
    assert names.count("theta_rocker_turn") > 2
    assert min(run[f"theta_{part}_power"].min() for part in ("crank", "rocker")) > -1e-9


def test_blocks_that_move_differently_use_what_they_can_to_the_same_degree() -> None:
    """On two axes, a rod from 4 m to 3 m between them: s1' = -4/3 s0', 4 N + 3 N x 4/3 = 8 N."""
    m = mb.Mechanism("corner", gravity=(0.0, 0.0, 0.0))
    force = m.input("push", "N")
    for i, (axis, start, load, mu) in enumerate(((X, 4.0, 20.0, 0.2), (Y, 3.0, 10.0, 0.3))):
        sole = mb.JointFriction(ExactCoulomb(mu_s=mu, mu_d=0.1), normal=load)
        block(m, i, sole.law, z=axis, start=start, friction=sole)
    m.joint(mb.Distance("rod", "block0", "block1", length=5.0))
    m.force(mb.JointSpringDamper("motor", "s0", "slide", actuator=force))
    run = simulate(m.build(), 8.1, u={"push": lambda t: t}, samples=82)
    assert run.happened[0] == (pytest.approx(8.0, abs=1e-8), "s0_loop_slip")
    rest = run.t < 7.95
    assert run["s0_friction"][rest] == pytest.approx(4.0 * run.t[rest] / 8, abs=1e-9)
    assert run["s1_friction"][rest] == pytest.approx(-3.0 * run.t[rest] / 8, abs=1e-9)
