"""Compensators in the closed loop of a drive with another friction law.

The closed loop of a mass without friction against closed forms, and the controller.

C of compensators and observers: the bits of CasADi, and nothing that is not finite.
"""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from one_program import OneProgram, Stepper, has_bits, is_near, jobs_of
from tables import sampled

import symfric as sf
from symfric.codegen import Block
from symfric.codegen.guards import Status
from symfric.compensation import (
    Cascade,
    Comparison,
    Compensation,
    Reference,
    close_loop,
    compensator,
    disturbance_observer,
    gms_observer,
    lugre_observer,
    moves,
    sine,
    step,
)
from symfric.scenes import Drive

CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
"""With N = 1 N the coefficients are newtons."""
BELIEVED = sf.LuGre(sigma_0=1e5, sigma_1=300.0, **CURVE)
SOFT = Cascade(kp=20.0, kv=60.0, ki=10.0)
heavy = pytest.mark.heavy
PLANTS: dict[str, sf.Law] = {
    "bristles": sf.LuGre(sigma_0=2e5, sigma_1=400.0, **CURVE),
    "elasto-plastic": sf.ElastoPlastic(sigma_0=2e5, sigma_1=400.0, **CURVE),
    "springs": sf.GMS(
        elements=tuple(sf.Element(k, 0.25) for k in (1.5e5, 7.5e4, 4.5e4, 3e4)),
        C=400.0,
        form="event",
        **CURVE,
    ),
    "Coulomb": sf.ExactCoulomb(form="stribeck", **CURVE),
}
EACH = [pytest.param(name, marks=() if name == "bristles" else pytest.mark.slow) for name in PLANTS]
BLOCK = compensator(
    BELIEVED, v_blend=0.02, error_gain=20.0, scales={"coulomb": 1.0, "stribeck": 0.0}
)
"""Compensator without the Stribeck term, which makes an axis jump."""


def compared(name: str, reference: Reference, block=BLOCK, **settings) -> Comparison:
    plant = sf.drive(PLANTS[name], m=1.0, N=1.0)
    return close_loop(plant, reference, block, **({"controller": SOFT} | settings))


@pytest.mark.parametrize("name", EACH)
def test_the_rms_tracking_error_is_more_than_nine_times_smaller(name: str) -> None:
    """The error is 1.3 mm without, and 15, 15, 11 and 11 times smaller with it."""
    found = compared(name, sine(0.02, 0.5, 2.0))
    assert found["without"].rms > 1e-3
    assert found.reduction("compensated") > 9.0
    assert found["compensated"].status == 0


@pytest.mark.parametrize("name", EACH)
def test_a_limit_cycle_of_a_millimetre_vanishes(name: str) -> None:
    """After a step of 1 cm the axis hunts by 1000 counts; with compensation by less than one."""
    found = compared(name, step(0.01, 20.0 if name == "springs" else 12.0))
    assert found["without"].hunting > 1000 * SOFT.count
    assert found["compensated"].hunting < SOFT.count
    assert not [remark for remark in found.remarks() if remark.startswith("compensated")]


@heavy
def test_wrong_levels_compensate_less_and_excessive_ones_hunt() -> None:
    """Levels of 50 % and 120 % on bristles; 120 % on Coulomb friction hunts."""
    cases = {f"{s:g}": {"scale_coulomb": s, "scale_stribeck": s} for s in (0.5, 1.0, 1.2)}
    found = compared("bristles", sine(0.02, 0.5, 2.0), cases=cases, noise=3e-6)
    half, right, more = (found.reduction(name) for name in cases)
    assert 2.0 < half < right and more > 5.0
    found = compared("Coulomb", step(0.01, 8.0), cases={"too much": cases["1.2"]})
    assert found["too much"].hunting > 100 * SOFT.count
    assert "! too much: hunts at rest" in found.table()


@pytest.mark.slow
@heavy
def test_observers_find_what_a_law_or_a_weak_compensator_leaves() -> None:
    """The law on the measured velocity: 77 times smaller with the error as input, 5 without."""
    reference, observer = sine(0.02, 0.5, 2.0), lugre_observer(BELIEVED, 60.0)
    cases = {"observer": {}, "law alone": {"k_e": 0.0}}
    found = compared("bristles", reference, observer, cases=cases)
    assert found.reduction("observer") > 50.0
    assert found.reduction("law alone") < 10.0
    rest = compared("bristles", step(0.01, 12.0), observer)
    assert rest["compensated"].hunting < SOFT.count
    half = compensator(BELIEVED, v_blend=0.02, scales={"coulomb": 0.5, "stribeck": 0.5})
    force = disturbance_observer(1.0, 100.0)
    alone, both = (
        compared("bristles", reference, blocks).reduction("compensated")
        for blocks in (force, [half, force])
    )
    assert alone > 5.0
    assert both > 1.5 * alone


def test_the_vm_gives_the_bits_of_the_c_and_float_is_near(compiler) -> None:
    del compiler
    reference = moves([1e-3], 0.2, 0.1)
    runs = {
        key: compared("bristles", reference, backend=key[0], real=key[1])["compensated"]
        for key in (("c", "double"), ("vm", "double"), ("c", "float"))
    }
    c, vm, single = runs.values()
    assert (c.x == vm.x).all()
    assert (c.added == vm.added).all()
    assert np.abs(single.x - c.x).max() < SOFT.count
    assert (single.added != c.added).any()


def test_a_compensator_without_states_is_a_function(compiler) -> None:
    """A law without states and without a ramp is one C function of scalars."""
    del compiler
    block = compensator(sf.Stribeck(v_eps=1e-3, **CURVE), ramp=None)
    assert block.is_function
    found = compared("bristles", moves([1e-3], 0.2, 0.1), block)
    assert np.abs(found["compensated"].added).max() > 3.0


def test_a_drive_that_turns_has_its_units(tmp_path) -> None:
    turning = Drive(PLANTS["bristles"], m=1.0, N=1.0, turning=True)
    block = compensator(replace(turning, law=BELIEVED))
    found = close_loop(turning.model(), moves([1e-3], 0.1, 0.05), block, controller=SOFT)
    assert found.units == ("rad", "N m")
    one = found["compensated"]
    assert one.work == pytest.approx(float(np.sum(one.force * np.diff(one.x))))
    with pytest.raises(ValueError, match="expected one of without, compensated"):
        found.plot("compensate")
    assert "RMS [urad]" in found.table()
    figure = found.plot(path=tmp_path / "loops.png")
    assert [axis.get_ylabel() for axis in figure.axes[:2]] == ["x [mrad]", "error [urad]"]
    assert (tmp_path / "loops.png").stat().st_size > 10_000
    assert str(found) == repr(found) == found.table()
    assert repr(one).startswith("<Loop 'compensated': 150 samples, RMS error ")
    assert len(repr(one)) < 80
    found.to_csv(tmp_path / "loops.csv")
    lines = (tmp_path / "loops.csv").read_text().splitlines()
    assert len(lines) == 151
    assert lines[0].startswith("t [s],reference [rad],x (without) [rad]")
    assert "added (compensated) [N m]" in lines[0]


def test_ctrl_c_returns_the_results_so_far(monkeypatch) -> None:
    from symfric.compensation import loop  # noqa: PLC0415

    calls = []
    plain = loop._commanded

    def interrupted(*given):
        calls.append(1)
        if len(calls) == 350:
            raise KeyboardInterrupt
        return plain(*given)

    monkeypatch.setattr(loop, "_commanded", interrupted)
    found = compared("bristles", moves([1e-3], 0.2, 0.1))
    assert found["compensated"].force.size == 49
    assert "compensated: interrupted at 0.049 s" in found.remarks()
    assert np.isnan(found["compensated"].hunting)


def test_references_are_smooth_and_rest() -> None:
    found = moves([0.01, 0.0], 0.5, 1.0)
    assert found.x[500] == 0.01
    assert found.x[-1] == 0.0
    assert np.abs(np.diff(found.x) / found.h - found.v[:-1]).max() < found.h * np.abs(found.a).max()
    assert found.rest == slice((2000 + 3000) // 2, None)
    assert sine(0.01, 1.0, 1.0).rest is None
    assert Reference(np.ones(20), np.zeros(20), np.zeros(20), 1e-3).rest == slice(10, None)


H, STEPS = 1e-3, 40
STILL = Cascade(h=H, kp=0.0, kv=0.0, ki=0.0, inertia=1.0, limit=2.0)
"""Controller that commands a_ref times its inertia."""


def mass() -> sf.Model:
    x, v, f = sf.Variable("x", "m"), sf.Variable("v", "m/s"), sf.Variable("f", "N")
    return sf.Model("mass", x=(x, v), u=(f,), ode=ca.vertcat(v.symbol, f.symbol))


def reference(a: np.ndarray) -> Reference:
    return Reference(0 * a, 0 * a, a, H)


def push(name: str, force: float, **outputs: sf.Output) -> Block:
    """A block with a constant force."""
    e = sf.Variable("e", "m")
    return Block(
        name, inputs=(e,), outputs={"F": sf.Output(force + 0 * e.symbol, "N"), **outputs},
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
    u = sf.Variable("u", "N")
    echo = Block("echo", inputs=(u,), outputs={"F": sf.Output(0.5 * u.symbol + 0.1, "N")})
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
        for name, more in (("free", {}), ("held", {"hold": sf.Output(1.0, "1")}))
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


FULL = Compensation(
    N="input", dead_zone=1e-3, inertia=1.0, delay=1e-3, error_gain=20.0, hold=(1e-5, 1e-3),
    stick=(1.0, 0.1, 1e-3), dither=(0.1, 100.0), limit=5.0, slew=100.0, offset=0.1,
)  # fmt: skip
TERMS = ["coulomb", "stribeck", "viscous", "bristle"]
TABLE = ((0, 0), (0.3, 0.6), (1, 1))
BLOCKS = [
    compensator(sf.LuGre(), settings=FULL, scales=TERMS),
    compensator(sf.GMS(form="event"), settings=FULL, scales=TERMS),
    compensator(sf.Stribeck(v_eps=1e-3), settings=FULL, build_up=1e-4, build_up_table=TABLE),
    compensator(sf.BoucWen(), N="input"),
    lugre_observer(sf.LuGre(mu_s=6.0, mu_d=4.0, sigma_2=1.0), 20.0, limit=5.0),
    lugre_observer(sf.LuGrePassive(), 20.0, h=1e-3),
    gms_observer(sf.GMS(form="event", mu_s=6.0, mu_d=4.0), 20.0),
    disturbance_observer(1.0, 200.0, order=2),
]


@pytest.mark.heavy
@pytest.mark.parametrize("real", sampled(["double", "float"], of=2))
def test_c_agrees_with_casadi_and_stays_finite(real, compiler, tmp_path):
    program = OneProgram(BLOCKS, tmp_path, compiler, real=real)
    if real == "double":
        has_bits(program)
    else:
        is_near(program, 1e-5)
    for rows in program.run([job for job in jobs_of(program) if np.isnan(job[1]).any()]):
        assert np.isfinite(rows).all()
        status = rows[:, -1].astype(int)
        assert status.any()
        assert not (status & Status.OUTPUT).any()
