"""The closed loop of a mass without friction against closed forms, and the controller."""

import casadi as ca
import numpy as np
import pytest
from one_program import Stepper

from symfric import Model, Output, Variable
from symfric.codegen import Block
from symfric.compensation import Cascade, Reference, close_loop

H, STEPS = 1e-3, 40
STILL = Cascade(h=H, kp=0.0, kv=0.0, ki=0.0, inertia=1.0, limit=2.0)
"""Controller that commands a_ref times its inertia."""


def mass() -> Model:
    x, v, f = Variable("x", "m"), Variable("v", "m/s"), Variable("f", "N")
    return Model("mass", x=(x, v), u=(f,), ode=ca.vertcat(v.symbol, f.symbol))


def reference(a: np.ndarray) -> Reference:
    return Reference(0 * a, 0 * a, a, H)


def push(name: str, force: float, **outputs: Output) -> Block:
    """A block with a constant force."""
    e = Variable("e", "m")
    return Block(
        name, inputs=(e,), outputs={"F": Output(force + 0 * e.symbol, "N"), **outputs},
    )  # fmt: skip


def closed(a: np.ndarray, blocks: object, **how: object):
    settings = {"controller": STILL, "backend": "vm", **how}
    return close_loop(mass(), reference(a), blocks, **settings)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_force_acts_after_its_delay(delay: int) -> None:
    a = np.random.default_rng(0).uniform(-1.0, 1.0, STEPS)
    found = closed(a, push("push", 0.5), delay=delay)
    for name, extra in (("without", 0.0), ("compensated", 0.5)):
        late = np.concatenate([np.zeros(delay), (a + extra)[: STEPS - delay]])
        assert found[name].force == pytest.approx(late, abs=1e-12)
        v = H * np.cumsum(late)
        assert found[name].v[1:] == pytest.approx(v, abs=1e-9)
        x = np.cumsum(H * np.append(0.0, v[:-1]) + H**2 / 2 * late)
        assert found[name].x[1:] == pytest.approx(x, abs=1e-9)
        assert found[name].added == pytest.approx(extra)


def test_all_forces_together_stay_within_the_limit_of_the_drive() -> None:
    found = closed(np.full(STEPS, 1.0), [push("one", 0.8), push("other", 0.9)])
    assert found["without"].force[1:] == pytest.approx(1.0)
    assert found["compensated"].force[1:] == pytest.approx(2.0)
    assert found["compensated"].added == pytest.approx(1.7)
    assert found["compensated"].saturated > 0.9


def test_an_observer_of_forces_sees_its_own_force_but_not_that_of_others() -> None:
    """The input u is the force that acted minus the forces of other blocks."""
    u = Variable("u", "N")
    echo = Block("echo", inputs=(u,), outputs={"F": Output(0.5 * u.symbol + 0.1, "N")})
    found = closed(np.full(STEPS, 0.3), [push("push", 0.4), echo])["compensated"]
    own = [0.1, 0.1]  # a force acts one sample later, and is observed one sample after that
    for _ in range(STEPS - 2):
        own.append(0.5 * (0.3 + own[-2]) + 0.1)
    assert found.added == pytest.approx(0.4 + np.array(own))


def test_a_block_holds_the_integrator_of_the_controller() -> None:
    """The hold acts from the next sample; the integral of the first sample remains."""
    own = Cascade(h=H, kp=0.0, kv=1.0, ki=10.0, inertia=0.0, count=1e-15, share=1.0)
    rest = Reference(np.zeros(STEPS), np.full(STEPS, 0.5), np.zeros(STEPS), H)
    runs = [
        close_loop(mass(), rest, push(name, 0.0, **more), controller=own, backend="vm", delay=0)
        for name, more in (("free", {}), ("held", {"hold": Output(1.0, "1")}))
    ]
    free, held = (run["compensated"] for run in runs)
    assert free.force == pytest.approx(runs[1]["without"].force)
    slow = 0.5 - np.diff(held.x[:STEPS], prepend=0.0) / H
    integral = np.where(np.arange(STEPS) > 0, 10 * H * 0.5, 0.0)
    assert held.force == pytest.approx(slow + integral, abs=1e-9)
    assert (free.force[5:] > held.force[5:] + 1e-4).all()


def test_errors_are_counted_after_a_tenth_of_the_time() -> None:
    """The error of a mass at rest is 1 mm before that and 1 um after it."""
    x = np.where(np.arange(STEPS) < STEPS // 10, 1e-3, 1e-6)
    found = close_loop(
        mass(), Reference(x, 0 * x, 0 * x, H), push("push", 0.0), controller=STILL, backend="vm"
    )
    assert found["without"].rms == pytest.approx(1e-6)
    assert found["without"].peak == pytest.approx(1e-6)


COUNT = 1e-3
OWN = Cascade(h=H, kp=10.0, kv=5.0, ki=2.0, inertia=3.0, limit=4.0, count=COUNT, share=0.25)


def test_the_controller_obeys_its_equations() -> None:
    go, v = Stepper(OWN.block()), 0.0
    for x, counts, before in ((1.4e-3, 1, 0), (1.6e-3, 2, 1), (-0.6e-3, -1, 2), (-0.4e-3, 0, -1)):
        found = go(x=x)
        v += 0.25 * ((counts - before) * COUNT / H - v)
        assert found["x_m"] == pytest.approx(counts * COUNT, abs=1e-15)
        assert found["e"] == pytest.approx(-counts * COUNT, abs=1e-15)
        assert found["v_m"] == pytest.approx(v)
    go = Stepper(OWN.block())
    first = go(r=0.02, v_ref=0.1, a_ref=0.2)
    assert (first["v_s"], first["u"]) == pytest.approx((0.3, 5.0 * 0.3 + 3.0 * 0.2))
    assert go.x[2] == pytest.approx(2.0 * 5.0 * H * 0.3)
    assert go(r=0.02, v_ref=0.1)["u"] == pytest.approx(5.0 * 0.3 + 3e-3)


def test_the_controller_stops_its_integration_at_the_limit_and_on_hold() -> None:
    go = Stepper(OWN.block())
    for v_ref, u in ((2.0, 4.0), (2.0, 4.0), (-2.0, -4.0)):
        assert go(v_ref=v_ref)["u"] == u
        assert go.x[2] == 0.0
    go(v_ref=0.1, hold=1.0)
    assert go.x[2] == 0.0
    go(v_ref=0.1, hold=0.5)
    assert go.x[2] == pytest.approx(2.0 * 5.0 * H * 0.1)
    go(v_ref=-2.0, a_ref=10.0)  # the acceleration moves it to the other limit: it continues to fall
    assert go.x[2] < 0.0
