"""Laws of other places than the scene's own: each rubs where it is said to, and nowhere else."""

import numpy as np
import pytest

from symfric import BrownMcPhee, Coulomb, LuGre, Viscous, parameters, simulate
from symfric.scenes import ALL_SCENES, MECHANISMS, FourMass, SliderCrank
from symfric.scenes.linkages import MechanismScene

RUBS = {
    ("double_pendulum", "lower"): "phi_2",
    ("pendulum_box", "hinge"): "phi",
    ("four_mass", "guide_2"): "y2",
    ("four_mass", "guide_3"): "z3",
    ("four_mass", "guide_4"): "x4",
    ("slider_crank", "guide"): "slider",
    ("four_bar", "hinge_coupler"): "theta_coupler",
    ("four_bar", "hinge_rocker"): "theta_rocker",
    ("four_bar", "pin"): "pin",
    **{("arm", f"q{i}"): f"q{i}" for i in range(2, 7)},
}
"""Scene and place -> the joint whose friction it is."""

WITHOUT = {"guide", "pin"}
"""Places that do not rub where no law is given."""


def test_every_place_is_tested() -> None:
    """That of the second block by its own oracle."""
    there = {(name, place) for name, kind in ALL_SCENES.items() for place in kind.places()}
    assert there == {*RUBS, ("coupled_blocks", "block_2")}
    for kind in ALL_SCENES.values():
        assert all(kind.places().values())


ONE_OF_THE_ARM = [at for at in RUBS if at[0] != "arm" or at[1] == "q4"]


@pytest.mark.parametrize(("name", "place"), ONE_OF_THE_ARM)
def test_a_law_of_a_place_rubs_there_and_nowhere_else(name: str, place: str) -> None:
    scene = MECHANISMS[name](Viscous(sigma_2=0.0), **{place: Coulomb(mu_d=0.3, v_eps=0.01)})
    run = simulate(scene.model(), 0.01, samples=11)
    rubbed = {n for n in run.units if n.endswith("_friction") and abs(run[n]).max() > 1e-3}
    assert rubbed == {f"{RUBS[name, place]}_friction"}


@pytest.mark.parametrize("kind", MECHANISMS.values(), ids=[*MECHANISMS])
def test_without_laws_of_their_own_places_have_that_of_the_scene(
    kind: type[MechanismScene],
) -> None:
    law = BrownMcPhee(v_t=0.05)
    laws = {place: law for place in kind.places() if place not in WITHOUT}
    given, own = kind(law, **laws).model(), kind(law).model()
    assert [v.name for v in given.x] == [v.name for v in own.x]
    rates = [
        model.function("ode")(0.0, model.initial_state(), np.zeros(len(model.z)), [], []).full()
        for model in (given, own)
    ]
    np.testing.assert_array_equal(*rates)


def test_parameters_of_places_have_endings_where_they_share_a_name() -> None:
    scene = FourMass(BrownMcPhee(), guide_3=Coulomb(mu_d=0.2), guide_4=LuGre(mu_s=0.4))
    found = {n: p.value for n, p in parameters(scene).items()}
    assert (found["mu_d_1"], found["mu_d_2"], found["mu_d_3"]) == (0.1, 0.2, 0.1)
    assert (found["mu_s_1"], found["mu_s_3"], found["sigma_0"]) == (0.15, 0.4, 1e5)


def test_the_guide_of_the_slider_takes_its_share_of_the_energy() -> None:
    """And it is the law at the speed and the normal force of the guide."""
    law = BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)
    run = simulate(SliderCrank.preset("haug_with_guide", law).model(), 0.25, rtol=1e-9)
    alone = simulate(SliderCrank.preset("haug", law).model(), 0.25, rtol=1e-9)
    assert run["slider_friction"] == pytest.approx(
        [law.force(v, N) for v, N in zip(run["slider_rate"], run["slider_N"], strict=True)],
        abs=1e-8,
    )
    assert run["slider_N"].min() > 0
    assert run.energy_balance().relative < 1e-6
    assert run["energy"][-1] < alone["energy"][-1] - 10.0
