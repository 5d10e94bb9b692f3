"""Equal calls give equal bits: by both engines, in every process, at any moment.

Virtual machine and compiled loop: the same steps, the same reasons to stop.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import bits, made, needs_compiler
from closed_forms import assemble
from hybrid import ball

import symfric as sf
import symfric.integrator.running.engine as loop
import symfric.integrator.running.integrator as module
import symfric.integrator.running.run as running
from symfric import LuGre, rabinowicz
from symfric.integrator.methods.attempt import build_step
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running import run
from symfric.integrator.running.engine import loop_source
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import _March
from symfric.laws import ALL_LAWS
from symfric.scenes import PendulumBox, SliderCrank

LAW = sf.BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
FORCE = {"force": lambda t: 12 * ca.sin(3 * t)}
SAMPLED = {"force": sf.Linear([0.0, 0.4, 0.9], [0.0, 15.0, -15.0])}


def eventful_dae() -> sf.Model:
    """An algebraic unknown that follows a reset and a jump of an input, and has an event itself."""
    x, y = sf.Variable("x", "1"), sf.Variable("y", "1", start=1.0)
    z, u = sf.Variable("z", "1"), sf.Variable("u", "1")
    return sf.Model(
        "dae", x=(x, y), z=(z,), u=(u,), ode=ca.vertcat(y.symbol, -z.symbol),
        alg=z.symbol + z.symbol**3 - 4 * x.symbol - u.symbol,
        events=(
            sf.Event("back", z.symbol - 0.5, 0, reset={"x": x.symbol / 2, "y": -0.9 * y.symbol}),
            sf.Event("turn", y.symbol, -1),
        ),
    )  # fmt: skip


HELD = {"force": sf.Hold([0.0, 0.3, 0.4, 0.9], [0.0, 15.0, -15.0, 20.0])}


def cubic() -> sf.Model:
    """z + z^3 = x + u: near jumps of u are followed in the loop, a far one takes a search."""
    x, z, u = sf.Variable("x", "1"), sf.Variable("z", "1"), sf.Variable("u", "1")
    alg = z.symbol + z.symbol**3 - x.symbol - u.symbol
    return sf.Model("cubic", x=(x,), z=(z,), u=(u,), ode=-z.symbol, alg=alg)


Case = tuple[Callable[[], sf.Model], float, dict[str, Any]]
CASES: dict[str, Case] = {
    "events": (lambda: sf.drive(sf.ExactCoulomb()), 2.0, {"u": FORCE}),
    "storm": (lambda: ball(0.8), 5.0, {"rtol": 1e-10}),
    "many events": (lambda: sf.drive(sf.MaxwellSlip(form="event")), 2.0, {"u": SAMPLED}),
    "events of an unknown": (eventful_dae, 3.0, {"u": {"u": sf.Hold([0, 1], [0, 2])}}),
    "samples": (lambda: sf.drive(sf.LuGre()), 1.0, {"u": SAMPLED}),
    "held events": (lambda: sf.drive(sf.ExactCoulomb()), 2.0, {"u": HELD}),
    "held cubic": (cubic, 2.0, {"u": {"u": sf.Hold([0.0, 0.5, 1.0], [0.0, 0.4, 90.0])}}),
    "exponentials": (lambda: sf.rabinowicz(sf.RateAndState(), free=["k"]), 0.5, {"p": {"k": 3.0}}),
    "normal force": (lambda: PendulumBox(LAW).model(), 2.0, {}),
    "loop": (lambda: SliderCrank(LAW).model(), 0.1, {"times": [0.02, 0.04]}),
    "few steps": (lambda: sf.rabinowicz(sf.LuGre()), 5.0, {"max_steps": 70}),
    **{
        method: (lambda: sf.rabinowicz(sf.LuGre()), 0.5, {"method": method})
        for method in ("rodas3", "rodas4p", "radau5", "dopri5")
    },
}


def digest(run: sf.Trajectory) -> str:
    return sha256(b"".join(bits(run))).hexdigest()


def of_case(case: str, backend: str, model: sf.Model | None = None) -> str:
    make, t_end, given = CASES[case]
    model = model or made(make)
    return digest(sf.simulate(model, t_end, samples=51, backend=backend, throw=False, **given))


@needs_compiler
@pytest.mark.parametrize("case", CASES)
def test_both_engines_give_the_same_bits(case: str) -> None:
    assert of_case(case, "compiled") == of_case(case, "vm")


@needs_compiler
def test_large_steps_are_blocks_in_both_engines(monkeypatch: pytest.MonkeyPatch) -> None:
    """4f644ad compiled blocks and ran the step written out in the virtual machine."""
    monkeypatch.setattr(module, "INLINE", 100)
    model = CASES["normal force"][0]()
    assert of_case("normal force", "compiled", model) == of_case("normal force", "vm", model)


@needs_compiler
def test_engines_may_change_on_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """As "auto" does, at a moment that depends on the load of the machine."""
    requested = 0

    def by_turns(self: Integrator, _: str, __: float) -> object:
        nonlocal requested
        requested += 1
        return self.compiled if requested % 2 else self.vm

    plain = {case: of_case(case, "vm") for case in ("events", "samples")}
    monkeypatch.setattr(Integrator, "choose", by_turns)
    monkeypatch.setattr(run, "ATTEMPTS", {"vm": 9, "compiled": 7})
    for name in ("LEAST_ROWS", "MOST_ROWS"):  # a full record is continued without a trace
        monkeypatch.setattr(loop, name, 20)
    assert {case: of_case(case, "auto") for case in plain} == plain
    assert requested > 10


@needs_compiler
def test_derivatives_have_the_same_bits_by_both_engines() -> None:
    vm, compiled = (
        sf.simulate(
            sf.rabinowicz(sf.LuGre(), free=["mu_s", "k"]), 1.0, samples=5, backend=backend,
            sensitivities=["mu_s", "k"],
        )
        for backend in ("vm", "compiled")
    )  # fmt: skip
    for seed, slopes in vm.sensitivities.items():
        assert all((compiled.sensitivities[seed][n] == y).all() for n, y in slopes.items())
    assert vm.gradient({"x": 1.0}) == compiled.gradient({"x": 1.0})


def test_every_process_gives_the_same_bits() -> None:
    """Names of expressions hash otherwise in each of them."""
    names = ["loop"]
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
        for scene, u in ((sf.rabinowicz, {}), (sf.drive, FORCE)):
            try:
                model = scene(law())
            except ValueError:  # a law that needs more than these scenes have
                continue
            vm, compiled = (
                digest(sf.simulate(model, 2.0, u=u, samples=51, backend=backend, throw=False))
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
    sf.simulate(cubic(), t_end, backend="compiled", **arguments)
    assert searched == [1.0]


def driven_cubic(*events: sf.Event) -> sf.Model:
    """z + z^3 = x + u."""
    alg = Z.symbol + Z.symbol**3 - X.symbol - U.symbol
    ode = ca.sin(3 * X.symbol) - Z.symbol + 0.5 * U.symbol
    return sf.Model("cubic", x=(X,), z=(Z,), u=(U,), ode=ode, alg=alg, events=events)


X, Z, U = sf.Variable("v", "1", start=0.3), sf.Variable("z", "1"), sf.Variable("force", "1")
HIT = sf.Event("hit", X.symbol - 0.5, 1, reset={"v": -X.symbol})
MODELS = [
    *(sf.drive(law) for law in (sf.BrownMcPhee(), sf.LuGre(), sf.ExactCoulomb())),
    driven_cubic(),
    driven_cubic(HIT, sf.Event("low", X.symbol + 1, -1)),
]


def drawn(rng: np.random.Generator) -> tuple[float, dict[str, Any]]:
    """End time [s] and arguments of a run."""
    t_end, count = rng.uniform(0.2, 3.0), int(rng.integers(2, 40))
    at, values = np.sort(rng.uniform(-0.1, 1.1 * t_end, count)), rng.uniform(-25.0, 25.0, count)
    size = rng.uniform(5.0, 20.0)
    inputs = [sf.Hold(at, values), sf.Linear(at, values), size, lambda t: size * ca.sin(7 * t)]
    inner = at[(at >= 0) & (at <= t_end)]
    further: dict[str, Any] = {
        "max_steps": int(rng.integers(1, 200)),
        "times": np.sort(rng.uniform(0.0, t_end, 3)),
        "max_step": rng.uniform(1e-3, 0.1),
        "method": "radau5",
    }
    return t_end, {
        "u": {"force": inputs[rng.integers(4)]},
        "t_eval": np.unique([*rng.uniform(0.0, t_end, 9), *inner[:2], *[t_end][: rng.integers(2)]]),
        "rtol": 10.0 ** rng.uniform(-8, -5),
        "x0": {"v": rng.choice([0.0, 0.3, -0.2])},
        **{name: value for name, value in further.items() if rng.random() < 0.3},
    }


@needs_compiler
@pytest.mark.parametrize("cases", [range(5), pytest.param(range(5, 150), marks=pytest.mark.slow)])
def test_random_runs_have_the_same_bits_by_both_engines(
    cases: range, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many attempts, rows and bytes they may take before the state is inspected."""
    rng = np.random.default_rng(10 + cases.start)
    for case in cases:
        model, (t_end, arguments) = MODELS[case % len(MODELS)], drawn(rng)
        found: list[list[bytes]] = []
        for backend, most in (("vm", 2**26), ("compiled", int(rng.choice([500, 2**26])))):
            attempts = dict.fromkeys(("vm", "compiled"), int(rng.choice([5, 100, 50_000])))
            monkeypatch.setattr(running, "ATTEMPTS", attempts)
            monkeypatch.setattr(running, "MOST_BYTES", most)
            monkeypatch.setattr(loop, "MOST_ROWS", int(rng.choice([64, 2048])))
            run = sf.simulate(model, t_end, backend=backend, throw=False, **arguments)
            found.append(bits(run))
        assert found[0] == found[1], (case, arguments)


def test_source_of_a_model_does_not_change_when_it_is_built_again() -> None:
    """Its hash is the name in the cache."""
    one, other = (
        loop_source(build_step(assemble(rabinowicz(LuGre())), RODAS5P), RODAS5P.H.shape[0])
        for _ in range(2)
    )
    assert one == other
