"""The mean force over a step and that at its end, beside the true ones along a motion."""

import casadi as ca
import numpy as np
import pytest
from rigs import prescribed_motion

from symfric import LuGre, simulate
from symfric.codegen import law_block
from symfric.laws import GMS, BoucWen, Coulomb, Dahl, ElastoPlastic, MaxwellSlip

LOAD = 10.0


def errors(law, speed, frequency, h, within=20):
    """Errors over one period: of F against the true mean, of F_end against the true end, and of
    both against the mean of the next step."""
    w, steps = 2 * np.pi * frequency, round(1.0 / frequency / h)
    motion = prescribed_motion(law, LOAD, lambda t: speed * ca.sin(w * t))
    fine = np.linspace(0.0, 1.0 / frequency, steps * within + 1)
    true = simulate(motion, fine[-1], t_eval=fine, rtol=1e-9)
    v = np.diff(-speed / w * np.cos(w * fine[::within])) / h
    block = law_block(law, h=h)
    p = [float(q.start) for q in block.parameters]
    state = [true[s.name][0] for s in law.states]
    found = np.zeros((steps, 2))
    for k in range(steps):
        state, forces = block.step(state, p, [v[k], LOAD])
        found[k] = forces.full().ravel()
    F = true["friction"]
    mean = (F[:-1] + F[1:]).reshape(steps, within).sum(axis=1) / (2 * within)
    ahead = found[:-1] - mean[1:, None]
    return found[:, 0] - mean, found[:, 1] - F[within::within], *ahead.T


def rms(error):
    return float(np.sqrt(np.mean(error**2)))


def test_the_numbers_of_the_text_about_lugre():
    """0.3 m/s at 1 Hz, 1 kHz: at reversals the load on the bristle turns within a step."""
    mean, end, *_ = errors(LuGre(), 0.3, 1.0, 1e-3)
    moving = np.abs(np.sin(2 * np.pi * (np.arange(1000) + 0.5) / 1000)) > 0.1
    assert np.abs(mean).max() == pytest.approx(0.022, rel=0.2)
    assert rms(mean) == pytest.approx(1.6e-3, rel=0.2)
    assert np.abs(mean[moving]).max() < 1e-4
    assert np.abs(end).max() == pytest.approx(0.36, rel=0.1)
    assert rms(end) == pytest.approx(0.017, rel=0.1)
    assert np.abs(end[moving]).max() < 1e-4


def test_each_of_the_forces_is_nearer_to_what_it_is_for():
    """Slow enough to be resolved: the mean is that of the step, the end is half a step newer."""
    mean, end, by_mean, by_end = errors(LuGre(), 2e-3, 1.0, 1e-3)
    assert rms(mean) < 1e-4
    assert rms(end) < 1e-3
    assert np.abs(by_mean).max() == pytest.approx(0.050, rel=0.1)
    assert np.abs(by_end).max() == pytest.approx(0.026, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("law", [LuGre(), ElastoPlastic()], ids=["lugre", "ep"])
def test_the_mean_is_of_second_order_and_the_force_at_the_end_of_first(law):
    coarse, fine = (errors(law, 2e-3, 1.0, h, within=10) for h in (1e-3, 5e-4))
    order = [float(np.log2(rms(a) / rms(b))) for a, b in zip(coarse[:2], fine[:2], strict=True)]
    assert 1.5 < order[0] < 3.5
    assert 0.8 < order[1] < 3.0


@pytest.mark.parametrize("law", [LuGre(), Dahl(), ElastoPlastic()], ids=["lugre", "dahl", "ep"])
def test_while_the_force_grows_the_end_is_above_the_mean(law):
    block = law_block(law, h=1e-3)
    p = [float(q.start) for q in block.parameters]
    _, forces = block.step([0.0] * len(law.states), p, [1e-4, LOAD])
    mean, end = forces.full().ravel()
    assert mean < end


@pytest.mark.parametrize(
    "law", [LuGre(), Dahl(), BoucWen(), MaxwellSlip(form="event"), GMS(form="event")],
    ids=["lugre", "dahl", "bouc_wen", "maxwell", "gms"],
)  # fmt: skip
def test_the_mean_of_short_steps_and_their_ends_meet(law):
    """F and F_end tend to the force of the law; so does the mean of a long step to that of many."""
    short, long = law_block(law, h=1e-7), law_block(law, h=1e-3)
    z = np.zeros(len(law.states))
    for _ in range(3):
        z = long.step(z, [float(q.start) for q in long.parameters], [3e-3, LOAD])[0].full().ravel()
    p = [float(q.start) for q in short.parameters]
    after, forces = short.step(z, p, [3e-3, LOAD])
    expected = float(law.force(3e-3, LOAD, after))
    assert forces.full().ravel() == pytest.approx([expected, expected], rel=1e-3)


def test_a_law_without_states_has_one_force():
    assert list(law_block(Coulomb()).outputs) == ["F"]
    assert list(law_block(LuGre()).outputs) == ["F", "F_end"]
