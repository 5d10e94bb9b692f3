"""Good data raise no error, whatever the law, the sensor and the motion."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from tables import sampled

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from symfric import BrownMcPhee, LuGre, law_from_text, rabinowicz, simulate
from symfric.scenes import Drive

RNG = np.random.default_rng(0)


def noisy(y: np.ndarray, size: float) -> np.ndarray:
    return y + size * RNG.standard_normal(y.size)


def silent(data: Dataset, *expected: str) -> None:
    """No error, and no warning but those of the kinds `expected`."""
    found = data.check()
    assert not found.errors, str(found)
    assert set(found.kinds) <= set(expected), str(found)


def test_emps(emps_files: Dataset) -> None:
    silent(emps_files)


@pytest.mark.parametrize(("case", "joint"), [(3, 2), (4, 7)])
def test_franka(shared_data: Path, case: int, joint: int) -> None:
    """In the second file the velocity is twice the slope of the angle, and that is reported."""
    file = shared_data / "franka_low_speed" / f"case{case}_slow.csv"
    if not file.is_file():
        pytest.skip("the Franka records are not on this machine (../shared/data)")
    columns = {"x": f"q{joint}", "v": f"dq{joint}", "force": f"q{joint}_tau_J_compensate"}
    data = Dataset.read(file, columns=columns, units="rad, N m")
    silent(data, "irregular", "frozen", "excitation", "units")
    assert any("v is 1.99" in f.sentence for f in data.check()) == (case == 4)


def test_pendulum_of_others(shared_data: Path) -> None:
    files = shared_data / "dfki_pendulum"
    if not files.is_dir():
        pytest.skip("the pendulum records are not on this machine (../shared/data)")
    data = Dataset.read(str(files / "*.csv"), units="rad, N m")
    silent(data, "irregular", "excitation", "clipping", "delay")


@pytest.mark.parametrize(
    "law", sampled(["asymmetric(coulomb+viscous)", "viscous", "makkar_dixon"], of=3)
)
def test_laws(law: str) -> None:
    silent(synthetic_drive_data(law_from_text(law), normal_force=20.0, speeds=(0.01, 0.08)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_sensors(seed: int) -> None:
    speeds = (0.004, 0.02, 0.08)
    data = synthetic_drive_data(seed=seed, speeds=speeds, force_noise=5.0, position_noise=1e-6)
    silent(data, "resolution")
    t, x, force = (data[0][key] for key in ("t", "x", "force"))
    for count, volt in ((10.0 ** (-seed - 3), 10.0 ** (1 - seed)), (1e-4, 1.0)):
        coarse = {"x": count * np.round(x / count), "force": volt * np.round(force / volt)}
        silent(Dataset.of(t=t, **coarse), "resolution", "excitation")
    silent(synthetic_drive_data(seed=seed, speeds=speeds, turning=True))


def motions() -> Iterator[tuple[str, Dataset, tuple[str, ...]]]:
    t, turning = np.arange(0.0, 12.0, 2e-3), "rad, N m"
    for size in (0.05, 0.001):
        x = size * (2 * np.abs((t / 2) % 2 - 1) - 1)
        v = np.gradient(x, t)
        force = noisy(20 * np.sign(v) + 50 * v + 2 * np.gradient(v, t), 0.5)
        data = Dataset.of(t=t, x=1e-6 * np.round(x / 1e-6), force=force)
        yield "triangle", data, ("speeds", "excitation")
    x = 0.01 * np.sin(2 * np.pi * t)
    v = np.gradient(x, t)
    force = noisy(20 * np.tanh(v / 1e-3) + 10 * np.gradient(v, t), 0.5)
    yield "sine", Dataset.of(t=t, x=noisy(x, 1e-7), force=force), ("excitation",)
    v = np.convolve(np.repeat(np.linspace(0.5, 10, 12), 500), np.ones(30) / 30, "same")
    x, force = np.cumsum(v) * 2e-3, noisy(7e-3 + 1e-3 * v + 2e-4 * np.gradient(v, t), 1e-3)
    yield "staircase", Dataset.of(t=t, x=x, force=force, units=turning), ("one-way", "excitation")
    rest = np.concatenate([np.zeros(2000), x - x[0], np.full(2000, x[-1] - x[0])])
    push = noisy(np.concatenate([np.zeros(2000), force, np.zeros(2000)]), 1e-3)
    still = {"t": 2e-3 * np.arange(rest.size), "x": noisy(rest, 1e-5), "force": push}
    data = Dataset.of(still, units=turning)
    yield "at rest in part", data, ("one-way", "excitation", "spikes")
    block = simulate(rabinowicz(BrownMcPhee()), t_end=40.0)
    times = np.arange(0.0, 40.0, 5e-3)
    x = np.interp(times, block.t, block["x"])
    for every in (1, 20):
        data = Dataset.of(t=times[::every], x=noisy(x, 1e-6)[::every], force=-2.1 * x[::every])
        yield "stick-slip", data, ("excitation", "one-way", "sign", "unrelated")
    count = 2 * np.pi / 4096
    swing = count * np.round(2.0 * np.exp(-0.1 * t) * np.cos(4 * t) / count)
    yield "free swing", Dataset.of(t=t, x=swing, units=turning), ()
    data = Dataset.of(t=t, x=swing, force=0 * t, units=turning)
    yield "free swing without drive", data, ("constant",)


def test_motions() -> None:
    for name, data, kinds in motions():
        try:
            silent(data, *kinds)
        except AssertionError as error:
            error.add_note(name)
            raise


def shaken(frequency: float, slow: float = 0.0, hum: float = 0.0) -> Dataset:
    """A growing sine of force that shakes bristles by micrometres; a sensor that hums at 50 Hz."""
    law = LuGre(mu_s=15.0, mu_d=10.0, sigma_0=1e6, sigma_1=2e3, sigma_2=0.0, v_s=1e-3)
    t = np.arange(0.0, 4.0, 1e-3)

    def push(t: Any, sin: Any = ca.sin) -> Any:
        return 3.5 * t * sin(2 * np.pi * frequency * t) + slow * sin(2 * np.pi * 0.1 * t)

    model = Drive(law, m=95.0, N=1.0).model()
    x = simulate(model, 4.0, u={"force": push}, t_eval=t, rtol=1e-8)["x"]
    assert np.ptp(x) < 1e-3
    force = push(t, np.sin) + hum * np.sin(2 * np.pi * 50 * t)
    return Dataset.of(t=t, x=noisy(x, 1e-9), force=noisy(force, 0.01))


def test_an_excitation_is_no_hum_and_an_additional_hum_is_reported() -> None:
    for frequency, slow in ((8.0, 0.0), (8.0, 2.0), (20.0, 0.0)):
        assert "hum" not in shaken(frequency, slow).check().kinds
    (hum,) = (f for f in shaken(20.0, hum=5.0).check() if f.kind == "hum")
    assert "49.9 Hz" in hum.sentence


def test_the_mass_in_a_motion_of_one_frequency() -> None:
    """A mass and a spring have the same effect there, but few drives have a spring."""
    t = 0.002 * np.arange(2000)
    x, w = 0.02 * np.sin(5 * t), 0.1 * np.cos(5 * t)
    noise = 0.5 * np.random.default_rng(0).standard_normal(t.size)
    heavy, light = (-m * 25 * x + 20 * np.sign(w) + 200 * w + noise for m in (50.0, 0.0))
    kinds = [Dataset.of(t=t, x=x, force=F).check().kinds for F in (heavy, light)]
    assert ["excitation" in some for some in kinds] == [False, True]
