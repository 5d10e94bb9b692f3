"""The referee knows nothing of symfric, and its equations are symfric's to rounding."""

import ast
import sys
from dataclasses import replace
from itertools import pairwise
from math import pi
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric.foundation.numeric import Array
from symfric.laws import ALL_LAWS
from symfric.stress import referee
from symfric.stress.cases import Case, Signal
from symfric.stress.problem import problem
from symfric.stress.referee import SmoothPiece, knows, solve
from symfric.stress.referee_equations import LAWS, SCENES, SIGNS

PAIRS = [(law, scene) for scene in SCENES for law in LAWS if knows(law, scene)]
FORMS = {"coulomb": [{"shape": s} for s in SIGNS], "exact_coulomb": [{"form": "stribeck"}]}
LEVELS = {"mu_s": 0.31, "mu_d": 0.17, "v_s": 3e-3, "sigma_2": 0.7, "delta": 1.3, "n": 1.7}
SHARED = LEVELS | {"v_d": 2e-3, "v_eps": 1e-4, "z_ba": 2e-7, "mu_v": 0.4, "A": 1.2, "beta": 0.6}


def test_referee_imports_no_symfric_beyond_itself() -> None:
    files = sorted(Path(referee.__file__).parent.glob("referee*.py"))
    assert len(files) == 2
    allowed = {*sys.stdlib_module_names, "numpy", "scipy"}
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0
                names = [node.module or ""]
            for name in names:
                own = name.startswith("symfric.stress.referee_")
                assert own or name.split(".")[0] in allowed, f"{file.name}: {name}"


class Both:
    """Rates of one case by the referee and by symfric."""

    def __init__(self, case: Case) -> None:
        self.case, ready = case, problem(case)
        self.model, requested = ready.model, ready.question()
        assert requested is not None
        self.requested = requested
        self.ode = self.model.function("ode")
        if self.model.z:
            others = [self.model.vector("x"), self.model.t, self.model.vector("u")]
            equations = ca.Function("g", [self.model.vector("z"), *others], [self.model.alg])
            self.root = ca.rootfinder("root", "newton", equations, {"abstol": 1e-14})

    def rates(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Rates of the machine and, but for modes, of the law at a state and a time by chance."""
        t, nominal = rng.uniform(0.01, 7.9), self.model.nominal("x")
        motion = SmoothPiece(self.requested, t - 1e-6, t + 1e-6)
        x = rng.normal(size=nominal.size) * nominal * 10 ** rng.uniform(-2, 0.7)
        if self.case.scene == "quarter_car":
            x[:2] = rng.normal(size=2) * 0.05
        if self.case.law == "exact_coulomb":
            for i, (velocity, rest) in enumerate(motion.scene.slides):
                x[motion.mode(i)] = mode = rng.integers(-1, 2)
                x[velocity] = rest + mode * abs(x[velocity])
        ours = np.array(motion(t, x.tolist()))
        u = [self.requested.signal.between(t - 1e-6, t + 1e-6)(t)] * len(self.model.u)
        z = self.root(self.guess(motion), x, t, u) if self.model.z else []
        theirs = self.ode(t, x, z, u, []).full()[:, 0]
        n = motion.scene.states if self.case.law == "exact_coulomb" else None
        return ours[:n], theirs[:n]

    def guess(self, motion: SmoothPiece) -> list[float]:
        """Normal and applied forces of the referee: symfric's equations have to hold for them."""
        names = ["x", "phi"] if self.case.scene == "pendulum_box" else ["phi"]
        loads = dict(zip(names, motion.loads, strict=True))
        return [loads[v.name.split("_")[0]][v.name.endswith("_F_e")] for v in self.model.z]


SOME = ("lugre", "exact_coulomb", "brown_mcphee", "coulomb")
"""Laws that the suite tries in every scene, the others in one."""


@pytest.mark.parametrize(
    ("law", "scene"),
    [pytest.param(law, scene, marks=[] if law in SOME or scene == "drive" else pytest.mark.slow)
     for law, scene in PAIRS],
)  # fmt: skip
def test_equations_are_those_of_symfric_to_rounding(law: str, scene: str) -> None:
    rng = np.random.default_rng(7)
    own = {name: SHARED[name] for name in SHARED if hasattr(ALL_LAWS[law](), name)}
    unsmoothed = [own | {"v_eps": 0.0}] if "v_eps" in own and scene == "drive" else []
    for forms in FORMS.get(law, [{}]):
        for values in (own, *unsmoothed):
            both = Both(Case(1, 1, scene, law, values, forms))
            for _ in range(8):
                ours, theirs = both.rates(rng)
                assert ours == pytest.approx(theirs, rel=1e-12, abs=1e-13 * np.abs(theirs).max())


@pytest.mark.parametrize(
    ("signal", "kinks"),
    [
        (Signal("constant", (3.0,)), 0),
        (Signal("sine", (2.0, 5.0, 1.0)), 0),
        (Signal("hold", (1.0, -2.0, 4.0), (0.0, 0.7, 1.4)), 3),
        (Signal("linear", (1.0, -2.0, 4.0), (0.0, 0.7, 1.4)), 3),
        (Signal("pulse", (2.0, 0.9, 0.3)), 2),
    ],
)
def test_a_mass_moves_under_each_kind_of_force(signal: Signal, kinks: int) -> None:
    """Without friction m v is the integral of the force, here by the trapezoidal rule."""
    case = Case(1, 1, "drive", "coulomb", {"mu_d": 0.0}, inputs={"force": signal}, t_end=2.0)
    ready = problem(case)
    requested = ready.question()
    assert requested is not None
    assert len(requested.signal.kinks) == kinks
    cuts = sorted({0.0, 2.0, *(t for t in requested.signal.kinks if 0 < t < 2)})
    gained = 0.0
    for a, b in pairwise(cuts):
        t = np.linspace(a, b, 20001)
        force = requested.signal.between(a, b)
        gained += np.trapezoid([force(s) for s in t.tolist()], t)
    assert 0.8 * solve(requested)[1, -1] == pytest.approx(gained, rel=1e-7, abs=1e-7)


def test_exact_block_on_its_belt_is_that_of_the_closed_form() -> None:
    """It sticks to mu_s m g / k, then slides for half a period about mu_d m g / k and sticks."""
    values = {"mu_s": 0.2, "mu_d": 0.1, "m": 1.0, "k": 4.0, "v_belt": 0.05, "g": 10.0}
    ready = problem(Case(1, 1, "rabinowicz", "exact_coulomb", values, t_end=12.0))
    requested = ready.question()
    assert requested is not None
    x, v, mode = solve(replace(requested, y=np.array([0.0, 0.05, 0.0])))
    t, w, away = ready.times, 2.0, 0.5 / 0.05
    sticks = t < away
    assert x[sticks] == pytest.approx(0.05 * t[sticks], abs=1e-12)
    since = w * (t[~sticks] - away)
    sliding = 0.25 + 0.25 * np.cos(since) + 0.05 / w * np.sin(since)
    back = since < 2 * pi - 2 * np.arctan(0.25 * w / 0.05)
    assert x[~sticks][back] == pytest.approx(sliding[back], abs=1e-9)
    assert set(mode) <= {-1.0, 0.0, 1.0}
    assert v.max() <= 0.05 + 1e-12
