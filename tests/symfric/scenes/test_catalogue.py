"""Every law with states on the belt: how far the block is carried, against published reaches."""

import pytest

from symfric import Law, rabinowicz, simulate
from symfric.laws.catalogue import DYNAMIC_LAWS

IDEAL, WITHOUT_STICTION = 0.5705, 0.4354

REACH: dict[str, tuple[float, float]] = {
    "dahl": (0.4352, 1e-3),
    "bliman_sorine": (0.508, 5e-3),
    "haessig_friedland": (0.547, 5e-3),
    "lugre": (0.5667, 5e-4),
    "lugre_normalised": (0.5667, 5e-4),
    "lugre_passive": (0.5670, 1e-3),
    "elasto_plastic": (0.5670, 5e-4),
    "leuven": (IDEAL, 5e-3),
    "maxwell_slip": (WITHOUT_STICTION, 1e-3),
    "gms": (IDEAL, 0.015),
    "stick_slip": (IDEAL, 0.01),
    "gonthier": (0.5745, 2e-3),
    "bristle_2d": (IDEAL, 5e-3),
    "bouc_wen": (WITHOUT_STICTION, 1e-3),
    "rate_and_state": (0.53836, 1e-4),  # SciPy's Radau at 1e-9
    "armstrong": (0.523, 5e-3),
    "exact_coulomb": (IDEAL, 5e-5),
}
"""Largest elongation [m] and how far off it may be: published (0.4352, 0.5667, 0.5670, 0.5745),
the closed forms with and without stiction, or, where the law has no such counterpart (a peak, a
dwell or a logarithm that depends on the time), what was computed here."""


@pytest.mark.parametrize("name", DYNAMIC_LAWS)
def test_block_is_carried_as_far_as_stated(name: str) -> None:
    law: Law = DYNAMIC_LAWS[name]()
    # unloaded at first, as the published runs were
    start = {"z": 0.0, "s_dw": 0.0} if name == "gonthier" else {}
    run = simulate(rabinowicz(law), 20.0, x0=start, rtol=1e-6, samples=8001)
    reach, error = REACH[name]
    assert run["x"].max() == pytest.approx(reach, abs=error)
