"""The elements of GMS, Leuven and Maxwell slip, found as the paper did it."""

from identification import Measured, fit_elements
from symfric.figures import Curve
from symfric.gallery.generalized_maxwell_slip._laws import ELEMENTS


def elements_again(curve: Curve) -> dict[str, float]:
    """The elements of `_laws` once more, from the loops of the generic model."""
    data = Measured(curve["v"], curve["F"], curve["x"], curve["t"])
    found = fit_elements(data, len(ELEMENTS), viscous=False, offset=False)
    return {
        "elements fitted to the generic model: rms [N]": found.rms,
        "sum of their levels, F_s = 1.05 N in table 1 [N]": float(found.levels.sum()),
        **{f"k_{i + 1} [N/m]": float(k) for i, k in enumerate(found.k)},
        **{f"alpha_{i + 1} [1]": float(share) for i, share in enumerate(found.shares)},
    }
