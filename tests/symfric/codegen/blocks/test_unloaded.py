"""A contact without load has no dry friction, and works again when the load returns."""

import numpy as np
import pytest
from law_cases import CASES, NO_STEP

from symfric import Law, LoadDependent, LuGre, Sum, Viscous
from symfric.codegen import law_block
from symfric.codegen.runner import run_vm
from symfric.emitter.c99 import DOUBLE

BRISTLES = [name for name, law in CASES.items() if law.states and name not in NO_STEP]
STEPS = 400
AWAY = slice(100, 200)
"""Steps without load: sliding to and fro, at rest, and sliding again."""


def swung(law: Law) -> np.ndarray:
    """States and forces over sliding to and fro, a while of it without load."""
    block = law_block(law)
    k = np.arange(STEPS)
    u = np.zeros((STEPS, len(block.inputs)))
    u[:, 0] = np.where((k >= 150) & (k < 180), 0.0, 0.01 * np.sin(0.3 * k))
    u[:, 1] = 10.0
    u[AWAY, 1] = 0.0
    return run_vm(block, DOUBLE, u, guards=False)


def forces(law: Law) -> np.ndarray:
    """The mean forces of the steps of `swung`."""
    return swung(law)[:, len(law.states)]


@pytest.mark.parametrize("name", BRISTLES)
def test_every_law_survives_a_load_of_zero(name: str) -> None:
    assert np.isfinite(swung(CASES[name])).all()


@pytest.mark.parametrize(
    "name", ["lugre", "dahl", "bouc_wen", "elasto_plastic", "maxwell_slip", "maxwell_slip, event",
             "bliman_sorine", "haessig_friedland", "gms, event, viscous"],
)  # fmt: skip
def test_without_load_there_is_no_dry_friction_and_then_it_returns(name: str) -> None:
    law = CASES[name]
    found = forces(law)
    viscous = 0.4 * 0.01 if "viscous" in name else 0.0
    assert np.abs(found[AWAY]).max() <= viscous * 1.001
    rested = law_block(law)
    k = np.arange(200, STEPS)
    u = np.zeros((len(k), len(rested.inputs)))
    u[:, :2] = np.column_stack([0.01 * np.sin(0.3 * k), np.full(len(k), 10.0)])
    fresh = run_vm(rested, DOUBLE, u, guards=False)[:, len(law.states)]
    assert found[200:] == pytest.approx(fresh, rel=1e-6, abs=1e-6)
    assert np.abs(found[200:]).max() > 0.9


def test_viscous_friction_stays() -> None:
    found = forces(Sum((LuGre(), Viscous(sigma_2=0.5))))
    v = 0.01 * np.sin(0.3 * np.arange(STEPS))
    assert found[100:150] == pytest.approx(0.5 * v[100:150])
    assert (found[150:180] == 0.0).all()


def test_a_preload_holds_on() -> None:
    assert np.abs(forces(LoadDependent(LuGre(), N_0=2.0))[AWAY]).max() > 0.1


def test_the_data_sheet_says_so_where_it_is_so() -> None:
    said = [any("Without load" in use for use in law_block(law).use) for law in (
        LuGre(), LoadDependent(LuGre(), N_0=2.0), CASES["lugre_normalised"]
    )]  # fmt: skip
    assert said == [True, False, False]
