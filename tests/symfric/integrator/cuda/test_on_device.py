"""Ensembles on a device: what the virtual machine gives, to the bit, the counts and failures too.

The processor takes the place of the graphics processor: the text of the kernel is the same, and so
is all that drives it but the calls of CuPy (`test_cupy_device`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from device_cases import ALIKE, CASES, VELOCITIES
from differentiable import oscillator
from ensembles import after, assert_same

from symfric import BrownMcPhee, Law, LuGre, Model, Status, rabinowicz, simulate_many
from symfric.emitter.c99 import DOUBLE
from symfric.integrator.cuda import on_device
from symfric.integrator.cuda.device import Device, HostArray, HostDevice
from symfric.integrator.cuda.kernel import Kernel
from symfric.model import Event
from symfric.scenes.catalogue import ALL_SCENES


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> Callable[[Device], None]:
    """The processor as the device; or another one, handed in."""

    def use(device: Device) -> None:
        monkeypatch.setattr(on_device, "find_device", lambda: device)

    use(HostDevice())
    return use


@pytest.mark.parametrize(
    "case", [pytest.param(c, marks=pytest.mark.slow) if c in ALIKE else c for c in CASES]
)
def test_members_are_those_of_the_virtual_machine(case: str) -> None:
    make, t_end, arguments = CASES[case]
    model = make()
    ours = simulate_many(model, t_end, backend="cuda", **arguments)
    assert_same(ours, simulate_many(model, t_end, backend="vm", **arguments))
    if not any(word in case for word in ("fail", "assembled", "unknowns start", "jams")):
        assert not ours.failed
        assert ours.attempts.min() > 0
    if "jams" in case:
        assert list(ours.failed) == [1]
        assert "friction jams" in ours.failed[1]


def test_one_that_uses_up_its_steps_is_named() -> None:
    arguments: dict[str, Any] = {"p": {"k": [1.0, 1e8, 4.0]}, "max_steps": 1000}
    ours = simulate_many(oscillator(), 1.0, backend="cuda", **arguments)
    assert_same(ours, simulate_many(oscillator(), 1.0, backend="vm", **arguments))
    assert ours.failed[1].startswith(Status.MAX_STEPS.value)
    assert ours.attempts[1] == 1000


@dataclass(eq=False)
class Counting:
    """A device that notes its launches and the members that are to go on."""

    device: HostDevice
    launches: list[int]
    todo: list[int]
    lacking: int = 0

    name, free = "counting", 2**30

    def load(self, kernel: Any) -> Any:
        loaded = self.device.load(kernel)

        def launch(many: bytes, threads: int) -> None:
            self.launches.append(threads)
            loaded(many, threads)

        launch.threads = loaded.threads  # type: ignore[attr-defined]
        return launch

    def put(self, array: Any) -> HostArray:
        if array.dtype == np.int32:
            self.todo.append(array.size)
        if self.lacking and array.nbytes > self.lacking:
            raise MemoryError
        return self.device.put(array)

    def full(self, shape: tuple[int, ...], value: float, kind: Any) -> HostArray:
        return self.device.full(shape, value, kind)


def members() -> Any:
    return simulate_many(
        rabinowicz(LuGre()), 9.0, x0={"v": VELOCITIES}, t_eval=[0.0, 2.71, 9.0], backend="cuda"
    )


@pytest.mark.parametrize("threads", [1, 3, 1000])
def test_the_number_of_threads_changes_nothing(
    threads: int, here: Callable[[Device], None]
) -> None:
    expected = members()
    here(HostDevice(threads))
    assert_same(members(), expected)


def test_short_launches_change_nothing_and_leave_out_who_is_done(
    here: Callable[[Device], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    expected, device = members(), Counting(HostDevice(4), [], [])
    here(device)
    monkeypatch.setattr(on_device.DeviceMembers, "budget", 40)
    monkeypatch.setattr(on_device.DeviceMembers, "launched", lambda self, spent: None)
    assert_same(members(), expected)
    assert device.todo[0] == 7
    assert device.todo == sorted(device.todo, reverse=True)
    assert device.launches == [min(4, left) for left in device.todo]
    # four threads of 40 attempts each
    assert len(device.launches) >= expected.attempts.sum() / 160


def test_what_the_memory_does_not_hold_goes_in_parts(here: Callable[[Device], None]) -> None:
    expected = members()
    here(HostDevice(free=1000))
    assert_same(members(), expected)
    device = Counting(HostDevice(), [], [], lacking=200)  # others took the rest meanwhile
    here(device)
    assert_same(members(), expected)
    assert max(n for n in device.todo) == 7 // 2 or len(device.launches) > 1


def test_chunks_change_nothing_and_progress_rises_between_launches() -> None:
    told: list[float] = []
    arguments: dict[str, Any] = {"x0": {"x": np.linspace(0.5, 2.0, 10)}, "backend": "cuda"}
    whole = simulate_many(oscillator(), 1.0, **arguments)
    assert_same(simulate_many(oscillator(), 1.0, chunk=3, **arguments), whole)
    assert_same(simulate_many(oscillator(), 1.0, chunk=3, progress=told.append, **arguments), whole)
    assert told == sorted(told)
    assert set(told) >= {0.3, 0.6, 0.9, 1.0}


def test_an_interrupt_keeps_what_is_finished_and_a_folder_goes_on(tmp_path: Path) -> None:
    arguments: dict[str, Any] = {
        "x0": {"x": np.linspace(0.5, 2.0, 20)}, "chunk": 4, "backend": "cuda", "out": tmp_path,
    }  # fmt: skip
    many = simulate_many(oscillator(), 1.0, progress=after(3), **arguments)
    assert many.status is Status.INTERRUPTED
    finished = np.isfinite(many["x"][:, 0])
    assert 4 <= finished.sum() < 20
    np.testing.assert_array_equal(finished, np.isfinite(many.reached))
    again = simulate_many(oscillator(), 1.0, **arguments)
    assert again.status is Status.SUCCESS
    arguments.pop("out")
    assert_same(again, simulate_many(oscillator(), 1.0, **arguments))
    assert len(list(tmp_path.iterdir())) == 1


def test_an_interrupt_between_launches_ends_a_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(on_device.DeviceMembers, "budget", 5)
    monkeypatch.setattr(on_device.DeviceMembers, "launched", lambda self, spent: None)
    told = list[float]()

    def progress(fraction: float) -> None:
        told.append(fraction)
        raise KeyboardInterrupt

    monkeypatch.setattr(on_device, "find_device", lambda: HostDevice(2))
    x0 = {"x": np.linspace(0.5, 2.0, 20)}
    many = simulate_many(oscillator(), 1.0, x0=x0, backend="cuda", progress=progress)
    assert many.status is Status.INTERRUPTED
    assert 0 < told[0] < 1
    assert np.isnan(many.reached).all()


def test_the_size_of_a_chunk_is_that_of_its_work_or_of_its_results() -> None:
    kernel = Kernel("", DOUBLE, rows=7, given=5, states=2, signals=4, operations=800)
    assert on_device.chunk_of(kernel, 1, 0) == 2**30 // 800
    assert on_device.chunk_of(kernel, 10_000, 0) == 2**30 // (8 * 40_012)
    assert on_device.chunk_of(kernel, 1, 10**9) == 1
    half = replace(kernel, real=on_device.REALS["float"])
    assert on_device.chunk_of(half, 10_000, 0) == 2**30 // (4 * 40_012)


def with_events() -> Model:
    model = oscillator()
    event = Event("through", model.x[0].symbol)
    return replace(model, events=(event,))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"model": with_events()}, "a model without events, got 'oscillator' with through; use"),
        ({"executor": "processes"}, "no executor and no workers.*, got executor = 'processes'"),
        ({"workers": 2}, "no executor and no workers.*, got workers = 2"),
        ({"real": "half"}, "simulate_many: real: expected one of double, float, got half"),
        ({"real": "float"}, "rtol: expected at least 1e-05 with real='float', got 1e-06"),
        (
            {"real": "float", "backend": "auto"},
            "real: expected double for this backend, got float",
        ),
    ],
)
def test_what_a_device_has_no_use_for_is_refused(arguments: dict[str, Any], message: str) -> None:
    given = {"model": oscillator(), "t_end": 1.0, "backend": "cuda"} | arguments
    with pytest.raises(ValueError, match=message):
        simulate_many(**given)


@pytest.mark.slow
@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("name", ALL_SCENES)
def test_all_scenes_have_the_bits_of_the_virtual_machine(name: str, law: Law) -> None:
    """The arm compiles for half a minute."""
    made = ALL_SCENES[name](law).model()
    x = made.x[0]
    x0 = {x.name: float(x.start) + np.array([-0.01, 0.0, 0.01])}
    arguments: dict[str, Any] = {"x0": x0, "t_eval": np.linspace(0.0, 0.3, 4)}
    ours = simulate_many(made, 0.3, backend="cuda", **arguments)
    assert_same(ours, simulate_many(made, 0.3, backend="vm", **arguments))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["quarter_car", "pendulum_box", "slider_crank"])
def test_single_precision_follows_double(name: str) -> None:
    made = ALL_SCENES[name](BrownMcPhee()).model()
    x, t = made.x[0], np.linspace(0.0, 1.0, 5)
    x0 = {x.name: float(x.start) + np.array([-0.01, 0.0, 0.01])}
    exact = simulate_many(made, 1.0, x0=x0, t_eval=t, rtol=1e-9, backend="vm")
    with pytest.warns(UserWarning, match=r"rtol = 0\.0001 is above"):
        double, single = (
            simulate_many(made, 1.0, x0=x0, t_eval=t, rtol=1e-4, backend="cuda", real=real)
            for real in ("double", "float")
        )
    assert single.attempts == pytest.approx(double.attempts, rel=0.1)
    for v in made.x:
        scale = np.abs(exact[v.name]).max()
        error = [np.abs(found[v.name] - exact[v.name]).max() for found in (double, single)]
        assert error[1] < 2 * error[0] + 1e-4 * scale
