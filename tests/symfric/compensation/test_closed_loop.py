"""Compensators in the closed loop of a drive with another friction law."""

from dataclasses import replace

import numpy as np
import pytest

from symfric import GMS, ElastoPlastic, Element, ExactCoulomb, Law, LuGre, Stribeck, drive
from symfric.compensation import (
    Cascade,
    Comparison,
    Reference,
    close_loop,
    compensator,
    disturbance_observer,
    lugre_observer,
    moves,
    sine,
    step,
)
from symfric.scenes import Drive

CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
"""With N = 1 N the coefficients are newtons."""
BELIEVED = LuGre(sigma_0=1e5, sigma_1=300.0, **CURVE)
SOFT = Cascade(kp=20.0, kv=60.0, ki=10.0)
heavy = pytest.mark.heavy
PLANTS: dict[str, Law] = {
    "bristles": LuGre(sigma_0=2e5, sigma_1=400.0, **CURVE),
    "elasto-plastic": ElastoPlastic(sigma_0=2e5, sigma_1=400.0, **CURVE),
    "springs": GMS(
        elements=tuple(Element(k, 0.25) for k in (1.5e5, 7.5e4, 4.5e4, 3e4)),
        C=400.0,
        form="event",
        **CURVE,
    ),
    "Coulomb": ExactCoulomb(form="stribeck", **CURVE),
}
EACH = [pytest.param(name, marks=() if name == "bristles" else pytest.mark.slow) for name in PLANTS]
BLOCK = compensator(
    BELIEVED, v_blend=0.02, error_gain=20.0, scales={"coulomb": 1.0, "stribeck": 0.0}
)
"""Compensator without the Stribeck term, which makes an axis jump."""


def compared(name: str, reference: Reference, block=BLOCK, **settings) -> Comparison:
    plant = drive(PLANTS[name], m=1.0, N=1.0)
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
    """Levels of 50 %, 80 % and 120 % on bristles; 120 % on Coulomb friction hunts."""
    cases = {f"{s:g}": {"scale_coulomb": s, "scale_stribeck": s} for s in (0.5, 0.8, 1.0, 1.2)}
    found = compared("bristles", sine(0.02, 0.5, 2.0), cases=cases, noise=3e-6)
    half, less, right, more = (found.reduction(name) for name in cases)
    assert 2.0 < half < less < right
    assert min(less, more) > 5.0
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
    block = compensator(Stribeck(v_eps=1e-3, **CURVE), ramp=None)
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
