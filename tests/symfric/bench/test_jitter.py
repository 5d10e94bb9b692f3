"""Total variation of accelerations: no law jitters where the step resolves it, both where not."""

from pathlib import Path

import numpy as np
import pytest

from symfric import Viscous, simulate
from symfric.bench.jitter import jitter, runge_kutta_4, variation
from symfric.bench.pictures import plot_jitter
from symfric.figures import FigureData
from symfric.integrator.equations.blocks import refinement
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.scenes import SliderCrank


@pytest.fixture(scope="module")
def data() -> FigureData:
    return jitter((0.02, 0.002), fixed_ms=(2.0,), tolerances=(1e-7,), t_end=2.0)


@pytest.mark.parametrize(
    ("a", "expected"), [([1.0, 1.0], 0.0), ([0.0, 2.0, -1.0], 5.0), ([0.0, np.inf], np.nan)]
)
def test_variation_sums_all_ups_and_downs(a: list[float], expected: float) -> None:
    assert variation(np.array(a)) == pytest.approx(expected, nan_ok=True)


def test_every_law_is_run_in_every_way(data: FigureData) -> None:
    cases = ["rtol = 1e-07", "RK4, h = 2 ms", "Rodas5P, h = 1 ms"]
    assert [(c.law, c.case) for c in data.curves] == [
        (law, case) for law in ("brown_mcphee", "self_tuning") for case in cases
    ]
    assert all(np.isfinite(c["TV of x1''"]).all() for c in data.curves)


def test_fixed_steps_that_are_fine_enough_agree_with_error_control(data: FigureData) -> None:
    """At the wide transition; what happens at the narrow one is shown, not asserted."""
    for law in ("brown_mcphee", "self_tuning"):
        exact, *others = (c for c in data.curves if c.law == law)
        for other in others:
            assert other["TV of x1''"][0] == pytest.approx(exact["TV of x1''"][0], rel=0.02)


def test_picture_is_drawn(data: FigureData, tmp_path: Path) -> None:
    plot_jitter(data, tmp_path / "jitter.svg")
    assert (tmp_path / "jitter.svg").stat().st_size > 0


def test_classical_runge_kutta_has_order_4_on_the_constraints() -> None:
    model = SliderCrank(Viscous(sigma_2=0.0)).model()
    whole = system(model, input_data(model, None, 0.0, 0.05))
    step, exact = runge_kutta_4(whole), simulate(model, 0.05, rtol=1e-12, t_eval=[0.05])
    assert whole.manifold is not None
    errors: list[float] = []
    for count in (50, 100):
        y = np.concatenate([model.initial_state(), np.zeros(whole.n - whole.nx)])
        y = refinement(whole)(y, 0).full()
        for _ in range(count):
            y = step(y, 0.05 / count, 0).full()
        errors.append(abs(float(y[0, 0]) - exact["crank"][0]))
        assert np.abs(whole.manifold.defect(y, 0).full()).max() < 1e-11
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.4)
