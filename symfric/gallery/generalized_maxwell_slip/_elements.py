"""The elements of GMS, Leuven and Maxwell slip, and what else could be made of them."""

from functools import partial

from identification import Measured, fit_elements
from symfric.figures import Curve
from symfric.gallery.generalized_maxwell_slip import _by_hand
from symfric.gallery.generalized_maxwell_slip._laws import ELEMENTS, PATH


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


def alternative(numbers: dict[str, float]) -> dict[str, bool]:
    """How Leuven with the state equation of section 4 misses the inner loop of figure 5."""
    missed: list[float] = []
    for delta in (1.0, 2.0, _by_hand.DELTA_L):
        step = partial(_by_hand.leuven, alternative=True, delta=delta)
        missed.append(_by_hand.opening(PATH, 8.0, step))
        numbers[f"inner loop missed by the equation of section 4, delta_l = {delta:g} [1]"] = (
            missed[-1]
        )
    return {"the equation of section 4 misses the inner loop by 15 % or more": min(missed) > 0.15}
