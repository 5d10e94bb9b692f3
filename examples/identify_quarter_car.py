"""Friction in the guide of a quarter car, from how body and wheel move over three ramps.

The road lifts a wheel by 85 mm, by 50 mm more, and drops it by 100 mm. Displacements of body and
wheel are measured at 200 Hz with 50 um of noise; the suspension is known, the friction of the guide
that leads the body is not. The general law has a decaying level, a Coulomb part whose load follows
from the lean of the strut, and a viscous part; the simple law leaves the Coulomb part out. Both are
fitted from starts off by a factor of two, and the residuals say which one is wrong.

    python examples/identify_quarter_car.py [OUT]
"""

import sys
from pathlib import Path

import numpy as np

from identification import Dataset, Fit, Shooting
from symfric import QuarterCarGeneral, QuarterCarSimple, simulate
from symfric.scenes import QuarterCar

TRUTH = QuarterCarGeneral(C_e=180.0, e_1=0.01, mu=0.05, sigma_v=1500.0)
START = {"C_e": 360.0, "e_1": 0.005, "mu": 0.1, "sigma_v": 750.0}
NOISE = 5e-5  # m
T = np.linspace(0.0, 10.0, 2001)


def measured() -> Dataset:
    """Return the record of two displacement sensors."""
    run = simulate(QuarterCar(TRUTH).model(), 10.0, t_eval=T, rtol=1e-9)
    body, wheel = NOISE * np.random.default_rng(0).standard_normal((2, T.size))
    return Dataset.of(
        t=T, X_b=run["X_b"] + body, X_w=run["X_w"] + wheel,
        units={"X_b": "m", "X_w": "m"}, name="three ramps",
    )  # fmt: skip


def main(out: Path) -> None:
    """Fit both laws; only the one that made the data explains them."""
    data = measured()
    for law in (QuarterCarSimple(), QuarterCarGeneral()):
        free = [name for name in START if hasattr(law, name)]
        start = {name: START[name] for name in free}
        car = QuarterCar(law)
        fit = Fit(Shooting(x0="given"), car, data, free=free, fixed="others", start=start).solve()
        sys.stdout.write(f"{fit}\n\n")
        fit.plot(out / f"{fit.name}.png")


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    main(folder)
