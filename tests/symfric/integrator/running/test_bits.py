"""The same call gives the same bits: by both engines, in every process, at whatever moment."""

import os
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from typing import Any

import casadi as ca
import pytest
from backends import needs_compiler
from hybrid import ball

import symfric.integrator.running.integrator as module
from symfric import (
    BrownMcPhee,
    Event,
    ExactCoulomb,
    Hold,
    Linear,
    LuGre,
    MaxwellSlip,
    Model,
    RateAndState,
    Trajectory,
    Variable,
    drive,
    rabinowicz,
    simulate,
    simulate_many,
)
from symfric.integrator.running import run
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import _March
from symfric.laws import ALL_LAWS
from symfric.scenes import PendulumBox, SliderCrank

LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
FORCE = {"force": lambda t: 12 * ca.sin(3 * t)}
SAMPLED = {"force": Linear([0.0, 0.4, 0.9], [0.0, 15.0, -15.0])}


def eventful_dae() -> Model:
    """An algebraic unknown that follows a reset and a jump of an input, and has an event itself."""
    x, y = Variable("x", "1"), Variable("y", "1", start=1.0)
    z, u = Variable("z", "1"), Variable("u", "1")
    return Model(
        "dae", x=(x, y), z=(z,), u=(u,), ode=ca.vertcat(y.symbol, -z.symbol),
        alg=z.symbol + z.symbol**3 - 4 * x.symbol - u.symbol,
        events=(
            Event("back", z.symbol - 0.5, 0, reset={"x": x.symbol / 2, "y": -0.9 * y.symbol}),
            Event("turn", y.symbol, -1),
        ),
    )  # fmt: skip


HELD = {"force": Hold([0.0, 0.3, 0.4, 0.9], [0.0, 15.0, -15.0, 20.0])}


def cubic() -> Model:
    """z + z^3 = x + u: near jumps of u are followed in the loop, a far one takes a search."""
    x, z, u = Variable("x", "1"), Variable("z", "1"), Variable("u", "1")
    alg = z.symbol + z.symbol**3 - x.symbol - u.symbol
    return Model("cubic", x=(x,), z=(z,), u=(u,), ode=-z.symbol, alg=alg)


Case = tuple[Callable[[], Model], float, dict[str, Any]]
CASES: dict[str, Case] = {
    "events": (lambda: drive(ExactCoulomb()), 2.0, {"u": FORCE}),
    "storm": (lambda: ball(0.8), 5.0, {"rtol": 1e-10}),
    "many events": (lambda: drive(MaxwellSlip(form="event")), 2.0, {"u": SAMPLED}),
    "events of an unknown": (eventful_dae, 3.0, {"u": {"u": Hold([0, 1], [0, 2])}}),
    "samples": (lambda: drive(LuGre()), 1.0, {"u": SAMPLED}),
    "held events": (lambda: drive(ExactCoulomb()), 2.0, {"u": HELD}),
    "held cubic": (cubic, 2.0, {"u": {"u": Hold([0.0, 0.5, 1.0], [0.0, 0.4, 90.0])}}),
    "exponentials": (lambda: rabinowicz(RateAndState(), free=["k"]), 0.5, {"p": {"k": 3.0}}),
    "normal force": (lambda: PendulumBox(LAW).model(), 2.0, {}),
    "loop": (lambda: SliderCrank(LAW).model(), 0.1, {"times": [0.02, 0.04]}),
    "few steps": (lambda: rabinowicz(LuGre()), 5.0, {"max_steps": 70}),
    "loose": (lambda: rabinowicz(LuGre()), 5.0, {"method": "radau5"}),
}


def digest(run: Trajectory) -> str:
    """Every bit of a run but how long it took and what ran it."""
    total = sha256(run.message.encode() + repr(run.happened).encode())
    total.update(repr((run.statistics.steps, run.statistics.rejections)).encode())
    for values in (run.step_times, *(run[name] for name in run.units)):
        total.update(values.tobytes())
    return total.hexdigest()


def of_case(case: str, backend: str) -> str:
    make, t_end, arguments = CASES[case]
    return digest(simulate(make(), t_end, samples=51, backend=backend, throw=False, **arguments))


@needs_compiler
@pytest.mark.parametrize("case", CASES)
def test_both_engines_give_the_same_bits(case: str) -> None:
    assert of_case(case, "compiled") == of_case(case, "vm")


@needs_compiler
def test_large_steps_are_blocks_in_both_engines(monkeypatch: pytest.MonkeyPatch) -> None:
    """4f644ad compiled blocks and ran the step written out in the virtual machine."""
    monkeypatch.setattr(module, "INLINE", 100)
    assert of_case("normal force", "compiled") == of_case("normal force", "vm")


@needs_compiler
def test_engines_may_change_on_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """As "auto" does, at a moment that depends on the load of the machine."""
    asked = 0

    def by_turns(self: Integrator, _: str, __: float) -> object:
        nonlocal asked
        asked += 1
        return self.compiled if asked % 2 else self.vm

    plain = {case: of_case(case, "vm") for case in ("events", "samples")}
    monkeypatch.setattr(Integrator, "choose", by_turns)
    monkeypatch.setattr(run, "ATTEMPTS", {"vm": 9, "compiled": 7})
    assert {case: of_case(case, "auto") for case in plain} == plain
    assert asked > 10


@needs_compiler
def test_members_are_the_same_by_both_engines_but_for_functions_that_vectors_need() -> None:
    """Lanes have an exponential and a power of their own: last digits differ, steps do not."""
    for u, t_eval in ((SAMPLED, [0.3, 0.4, 1.0]), (FORCE, [1.0])):
        vm, compiled = (
            simulate_many(
                drive(LuGre()), 1.0, u=u, x0={"v": [-0.1, 0.2]}, t_eval=t_eval, backend=backend
            )
            for backend in ("vm", "compiled")
        )
        for name in vm.signals:
            assert vm[name] == pytest.approx(compiled[name], rel=1e-7, abs=1e-9)
        assert vm.attempts == pytest.approx(compiled.attempts, rel=0.02)


@needs_compiler
def test_derivatives_have_the_same_bits_by_both_engines() -> None:
    vm, compiled = (
        simulate(
            rabinowicz(LuGre(), free=["mu_s", "k"]), 1.0, samples=5, backend=backend,
            sensitivities=["mu_s", "k"],
        )
        for backend in ("vm", "compiled")
    )  # fmt: skip
    for seed, slopes in vm.sensitivities.items():
        assert all((compiled.sensitivities[seed][n] == y).all() for n, y in slopes.items())
    assert vm.gradient({"x": 1.0}) == compiled.gradient({"x": 1.0})


def test_every_process_gives_the_same_bits() -> None:
    """Names of expressions hash otherwise in each of them."""
    names = ["events", "normal force", "loop"]
    script = (
        f"import sys; sys.path[:0] = {sys.path!r}; import warnings\n"
        f"warnings.simplefilter('ignore')\n"
        f"from importlib.util import spec_from_file_location as s, module_from_spec as m\n"
        f"spec = s('bits', {__file__!r}); module = m(spec); spec.loader.exec_module(module)\n"
        f"print(*(module.of_case(name, 'vm') for name in {names!r}))"
    )
    there = subprocess.run(
        [sys.executable, "-c", script], env=os.environ | {"PYTHONHASHSEED": "4711"},
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    assert there.stdout.split() == [of_case(name, "vm") for name in names]


@needs_compiler
@pytest.mark.slow
def test_every_law_gives_the_same_bits_by_both_engines() -> None:
    count = 0
    for law in ALL_LAWS.values():
        for scene, u in ((rabinowicz, {}), (drive, FORCE)):
            try:
                model = scene(law())
            except ValueError:  # a law that needs more than these scenes have
                continue
            vm, compiled = (
                digest(simulate(model, 2.0, u=u, samples=51, backend=backend, throw=False))
                for backend in ("vm", "compiled")
            )
            assert vm == compiled, model.name
            count += 1
    assert count > 80


@needs_compiler
def test_only_a_far_jump_is_searched_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two jumps: the compiled loop comes back for the far one alone."""
    searched = list[float]()
    search = _March._make_consistent  # pyright: ignore[reportPrivateUsage]

    def counted(self: _March, moved: bool = False) -> None:
        searched.append(self.t)
        search(self, moved)

    monkeypatch.setattr(_March, "_make_consistent", counted)
    _, t_end, arguments = CASES["held cubic"]
    simulate(cubic(), t_end, backend="compiled", **arguments)
    assert searched == [1.0]
