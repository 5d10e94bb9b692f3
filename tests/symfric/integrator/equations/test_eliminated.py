"""Mechanisms without friction by an explicit method: its order, its solution, what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from symfric import BrownMcPhee, Viscous, simulate
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.methods.families import eliminated
from symfric.integrator.methods.tableaux import DOPRI5
from symfric.integrator.step.attempt import build_fixed
from symfric.model import Model
from symfric.scenes import DoublePendulum, FourBar, MechanismScene


def bare(scene: MechanismScene) -> Model:
    """The scene with nothing that rubs."""
    mechanism = scene.mechanism()
    mechanism.joints = [replace(joint, friction=None) for joint in mechanism.joints]
    return mechanism.build()


TREE, LOOP = bare(DoublePendulum(Viscous())), bare(FourBar(Viscous()))
each = pytest.mark.parametrize("model", [TREE, LOOP], ids=["tree", "loop"])


@each
def test_order_five(model: Model) -> None:
    """Of positions and velocities, accelerations and multipliers alike."""
    whole = system(model, input_data(model, None, 0.0, 1.0))
    start = consistent(
        whole, "start", first_guess(whole, model, model.initial_state()), np.zeros(0)
    )
    step = build_fixed(whole, DOPRI5)

    def end(steps: int) -> np.ndarray:
        h = 0.1 / steps
        return step.mapaccum(steps)(start, h, np.zeros((0, steps))).full()[:, -1]

    exact = end(512)
    errors = [np.abs((end(n) - exact) / (1 + np.abs(exact))).max() for n in (16, 32, 64)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 4.6).all()  # of the loop 6.3 and 5.9: its leading error is small


@each
def test_same_motion_and_reactions_as_by_the_implicit_method(model: Model) -> None:
    runs = [simulate(model, 0.5, rtol=1e-9, method=m, samples=51) for m in ("dopri5", "rodas5p")]
    explicit, implicit = runs
    for name in model.signals:
        size = 1 + np.abs(implicit[name]).max()
        assert explicit[name] == pytest.approx(implicit[name], abs=2e-6 * size)
    assert explicit.statistics.steps < 0.7 * implicit.statistics.steps
    work = len(DOPRI5.A) * (explicit.statistics.steps + explicit.statistics.rejections)
    assert explicit.statistics.factorisations == explicit.statistics.evaluations == work


def test_friction_from_reactions_is_refused() -> None:
    model = FourBar(BrownMcPhee()).model()
    assert eliminated(system(model, input_data(model, None, 0.0, 1.0))) is None
    with pytest.raises(
        ValueError, match=r"DOPRI5: expected an ODE .* with friction from reactions"
    ):
        simulate(model, 0.1, method="dopri5")
