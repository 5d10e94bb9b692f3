"""Modes of several contacts decided in compiled code: the bits of the decision in Python."""

from ctypes import c_double, c_int
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import bits, needs_compiler

import symfric as sf
from symfric.integrator.compiled.compiler import load
from symfric.integrator.running import contact_modes
from symfric.integrator.running.contact_modes import TURNING, ContactModes
from symfric.model import Model
from symfric.scenes import Arm, DoublePendulum


def hammered() -> Model:
    """Three blocks between springs, driven, and hit by a hammer every half second.

    Blows change sliding velocities, some to zero, so that the modes of all contacts are decided.
    Each block also carries a part of the friction of the one before, so that modes affect others.
    """
    t, three = ca.SX.sym("t"), range(3)
    x = [sf.Variable(f"x{i}", "m") for i in three]
    v = [sf.Variable(f"v{i}", "m/s") for i in three]
    indexed = (f"{a}{i}" for a in ("omega", "mu_s", "mu_d", "kept", "hit") for i in three)
    p = {name: sf.Variable(name, "1", start=1.0) for name in ("k", "F", *indexed)}
    own = {name: one.symbol for name, one in p.items()}
    q = [0, *(a.symbol for a in x), 0]
    forces = [
        own["k"] * (q[i] - 2 * q[i + 1] + q[i + 2]) + own["F"] * ca.cos(own[f"omega{i}"] * t)
        for i in three
    ]
    laws = [sf.ExactCoulomb(mu_s=own[f"mu_s{i}"], mu_d=own[f"mu_d{i}"]) for i in three]
    rubbing = list[sf.Contact]()
    for i in three:
        forces[i] += 0.8 * rubbing[-1].force if rubbing else 0.0
        rest = {f"v{i}": 0.0}
        rubbing.append(
            sf.contact(f"c{i}", laws[i], v[i], 1.0, rest=rest, F_e=forces[i], bare=False)
        )
    blows = {f"v{i}": own[f"kept{i}"] * v[i].symbol + own[f"hit{i}"] for i in three}
    rates = [force - c.force for force, c in zip(forces, rubbing, strict=True)]
    return Model(
        "hammered", t=t, x=(*x, *v), p=tuple(p.values()), contacts=tuple(rubbing),
        ode=ca.vertcat(*(a.symbol for a in v), *rates),
        events=(sf.Event("blow", ca.sin(2 * np.pi * t), 0, reset=blows),),
    )  # fmt: skip


def drawn(seed: int) -> dict[str, Any]:
    """Parameters over two decades; the blocks start from rest or with equal speeds."""
    rng = np.random.default_rng(seed)
    force, sliding = 10 ** rng.uniform(-1, 1), rng.uniform(0.1, 1.0, 3)
    p = {"k": 10 ** rng.uniform(-1, 2), "F": force}
    for i in range(3):
        slow = float(force * sliding[i])
        p |= {f"omega{i}": rng.uniform(0.5, 5), f"kept{i}": rng.choice([0.0, 0.3, 1.0])}
        p |= {f"hit{i}": rng.choice([0.0, 0.0, 0.2, -0.2])}
        p |= {f"mu_d{i}": slow, f"mu_s{i}": slow * rng.choice([1.0, 1.5])}
    start = {f"x{i}": rng.normal() for i in range(3)} | {
        f"v{i}": rng.integers(-1, 2) for i in range(3)
    }
    return {"p": {n: float(x) for n, x in p.items()}, "x0": {n: float(x) for n, x in start.items()}}


MODELS: dict[str, tuple[Any, float, int, list[dict[str, Any]]]] = {
    "hammered": (hammered, 4.0, 7, [drawn(seed) for seed in range(10)]),
    "pendulum": (lambda: DoublePendulum(sf.ExactCoulomb()).model(), 3.0, 5, [{}]),
    "arm": (lambda: Arm(sf.ExactCoulomb(mu_s=0.3, mu_d=0.3)).model(), 0.2, 2, [{}]),
}


@needs_compiler
@pytest.mark.parametrize(
    "name", ["hammered", "pendulum", pytest.param("arm", marks=pytest.mark.slow)]
)
def test_compiled_code_decides_as_python_does(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make, t_end, least, cases = MODELS[name]
    model, calls, decided = make(), list[float](), ContactModes.decided

    def counted(self: ContactModes, t: float, *arguments: Any) -> Any:
        calls.append(t)
        return decided(self, t, *arguments)

    monkeypatch.setattr(ContactModes, "decided", counted)
    in_python = 0
    for case in cases:
        runs: list[sf.Trajectory] = []
        for backend in ("vm", "compiled"):
            calls.clear()
            runs.append(sf.simulate(model, t_end, backend=backend, samples=101, **case))
            assert backend == "compiled" or len(calls) >= least  # there is something to decide
        in_python += len(calls)
        assert bits(runs[0]) == bits(runs[1])
    assert in_python <= len(cases) // 4  # those for which all combinations are tried


@needs_compiler
def test_objections_of_compiled_code_are_those_of_python() -> None:
    """Of three contacts, of which several are inconsistent, some equally."""
    text = Path(contact_modes.__file__).with_name("decide.c").read_text("utf-8")
    names, begin = text.index("enum { UP"), text.index("static int symfric_objection")
    body = text[begin : text.index("/* Decides")].replace("$turning", repr(TURNING))
    head = (
        f"#include <math.h>\nenum {{ CONTACTS = 3 }};\n{text[names : text.index(chr(10), names)]}"
    )
    object_to = load(
        f"{head}\n{body.replace('static ', '')}", "symfric_objection"
    ).symfric_objection
    rng, several = np.random.default_rng(0), 0
    for _ in range(2000):
        modes, free = rng.integers(-1, 2, 3).astype(float), rng.integers(0, 2, 3)
        rows = rng.choice([-2.0, -1.0, -1e-9, 0.0, 0.5, 1.0], (3, 4)) * rng.choice([1.0, 30.0])
        expected = contact_modes.objection(modes, free, rows)
        better = (c_double * 3)(*modes)
        changed = object_to(better, (c_int * 3)(*free), (c_double * 12)(*rows.ravel()))
        assert changed == (expected is not None)
        if expected is not None:
            modes[expected[0]], several = expected[1], several + 1
        assert [*better] == modes.tolist()
    assert 1000 < several < 2000
