"""Two blocks against a matrix exponential between their changes of mode, and one alone."""

import numpy as np
import pytest
from dry import blocks_on_belt

from symfric import BrownMcPhee, ExactCoulomb, LuGre, rabinowicz, simulate
from symfric.scenes import CoupledBlocks

UNIT = {"m_1": 1.0, "m_2": 1.0, "g": 1.0, "start_2": 0.0}


@pytest.mark.parametrize("v_belt", [0.1, 0.3])
def test_blocks_stick_and_slip_as_the_matrix_exponential_says(v_belt: float) -> None:
    laws = ExactCoulomb(mu_s=1.0, mu_d=0.7), ExactCoulomb(mu_s=1.3, mu_d=0.9)
    K = np.array([[1.0 + 1.2, -1.2], [-1.2, 0.8 + 1.2]])
    happened, last = blocks_on_belt(K, (1.0, 1.3), (0.7, 0.9), v_belt, 40.0)
    scene = CoupledBlocks(
        laws[0], block_2=laws[1], k_1=1.0, k_2=0.8, k_c=1.2, v_belt=v_belt, **UNIT
    )
    run = simulate(scene.model(), 40.0, rtol=1e-10)
    found = [(t, int(name[6]) - 1, name[8:]) for t, name in run.happened]
    assert len(happened) > 10
    assert [(i, what) for _, i, what in found] == [(i, what) for _, i, what in happened]
    assert [t for t, _, _ in found] == pytest.approx([t for t, _, _ in happened], abs=1e-7)
    final = [run[name][-1] for name in ("x_1", "x_2", "v_1", "v_2")]
    assert final == pytest.approx(last, abs=1e-7)


def test_without_the_spring_between_each_is_a_block_of_rabinowicz() -> None:
    scene = CoupledBlocks(BrownMcPhee(), block_2=LuGre(), k_c=0.0, start_2=0.0)
    run = simulate(scene.model(), 10.0, rtol=1e-9)
    for i, law in ((1, BrownMcPhee()), (2, LuGre())):
        alone = simulate(rabinowicz(law), 10.0, rtol=1e-9)
        assert run[f"x_{i}"][-1] == pytest.approx(alone["x"][-1], abs=1e-6)


def test_blocks_that_start_together_stay_together() -> None:
    run = simulate(CoupledBlocks(BrownMcPhee(), start_2=0.0).model(), 6.0, rtol=1e-9)
    assert run["x_1"] == pytest.approx(run["x_2"], abs=1e-9)
    alone = simulate(rabinowicz(BrownMcPhee()), 6.0, rtol=1e-9)
    assert run["x_1"][-1] == pytest.approx(alone["x"][-1], abs=1e-7)


def test_work_of_the_belt_is_what_springs_and_friction_take() -> None:
    scene = CoupledBlocks(LuGre())
    run = simulate(scene.model(), 5.0, rtol=1e-9, samples=50001)
    energy = 0.4 * (run["v_1"] ** 2 + run["v_2"] ** 2) + 1.05 * (run["x_1"] ** 2 + run["x_2"] ** 2)
    energy += 1.25 * (run["x_2"] - run["x_1"]) ** 2
    belt = -0.1 * (run["friction_1"] + run["friction_2"])
    work = np.trapezoid(belt - run["power_1"] - run["power_2"], run.t)
    assert energy[-1] - energy[0] == pytest.approx(work, abs=1e-5)
