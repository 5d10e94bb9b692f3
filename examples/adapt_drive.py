"""Follow friction that doubles within a minute, and compensate it, in Python and in C.

    m v' = force - F,   m = 1 kg,   F: bristles, from 6 and 4 N to 12 and 8 N

The compensator uses the levels of the start and half the stiffness of the bristles. An estimator,
recursive least squares or an extended Kalman filter, compares force and motion at 1 kHz and writes
the scales of dry and viscous friction and the offset. The axis follows a sine with an encoder of
1 um and a delay of one sample. `adapt_drive.c` is the same loop with all parts in C.

    python examples/adapt_drive.py [OUT]
"""

import sys
from pathlib import Path

import numpy as np

from symfric import LuGre, drive
from symfric.codegen import generate, plant_block
from symfric.compensation import (
    Cascade,
    Comparison,
    close_loop,
    compensator,
    kalman_estimator,
    recursive_estimator,
    sine,
)
from symfric.foundation.panels import panels, save
from symfric.foundation.programs import finished, needed_compiler

CONTROLLER = Cascade(kp=20.0, kv=60.0, ki=10.0, inertia=1.0, count=1e-6)
CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
BELIEVED = LuGre(sigma_0=1e5, sigma_1=300.0, **CURVE)
NOISE = CONTROLLER.count / (CONTROLLER.h * np.sqrt(6.0))
"""Deviation of the velocity from differences of the encoder [m/s]."""
COMPENSATOR = compensator(BELIEVED, v_blend=0.02, error_gain=20.0, offset=0.0, without=["stribeck"])
ESTIMATORS = {"least squares": recursive_estimator, "Kalman filter": kalman_estimator}
PLANT = drive(LuGre(sigma_0=2e5, sigma_1=400.0, **CURVE), m=1.0, N=1.0, free=["mu_s", "mu_d"])
REFERENCE = sine(0.02, 0.5, 60.0)
TRUE = 1.0 + REFERENCE.t / 60.0


def in_c(out: Path) -> list[float]:
    """RMS errors of the loop in C: with fixed, estimated and true scales."""
    estimator = recursive_estimator(BELIEVED, mass=1.0, noise=NOISE)
    blocks = CONTROLLER.block(), COMPENSATOR, estimator, plant_block(PLANT, h=1e-4, name="plant")
    sources = [str(generate(b, out / "c", real="double").source("double")) for b in blocks]
    main, program = Path(__file__).with_suffix(".c"), str(out / "adapt_drive")
    needed_compiler().run("-O2", f"-I{out / 'c'}", str(main), *sources, "-o", program, "-lm")
    return [float(x) for x in finished((program,)).output.split()]


def draw(found: Comparison, name: str, out: Path) -> None:
    """Draw the scale of dry friction with its band, and the residuals."""
    run, t = found["compensated"].estimates, REFERENCE.t
    value, band = run["scale_coulomb"], 2.0 * run["scale_coulomb_sd"]
    figure, axes = panels(2)
    axes[0].fill_between(t, value - band, value + band, alpha=0.2)
    axes[0].plot(t, value, label=name)
    axes[0].plot(t, TRUE, "k--", label="true")
    axes[0].set(ylabel="scale of dry friction [1]", ylim=(0.5, 2.5))
    axes[0].legend(frameon=False)
    axes[1].plot(t, run["residual"], lw=0.5)
    axes[1].set(xlabel="t [s]", ylabel="residual [N]")
    save(figure, out / f"adapt_drive_{name.split()[0].lower()}.png")


def main(out: Path) -> None:
    """Simulate the loops, print, draw, and run the loop in C."""
    out.mkdir(parents=True, exist_ok=True)
    worn = {"mu_s": 6.0 * TRUE, "mu_d": 4.0 * TRUE}
    cases = {"fixed": {}, "true": {"scale_coulomb": TRUE}}
    both = close_loop(PLANT, REFERENCE, COMPENSATOR, controller=CONTROLLER, p=worn, cases=cases)
    best = both["true"].rms
    print(f"fixed levels: RMS error {both['fixed'].rms / best:.1f} of that with the true levels")
    for name, make in ESTIMATORS.items():
        block = make(BELIEVED, mass=1.0, noise=NOISE)
        found = close_loop(
            PLANT, REFERENCE, COMPENSATOR, controller=CONTROLLER, p=worn, estimator=block
        )
        run = found["compensated"]
        last, sd = (run.estimates[n][-1] for n in ("scale_coulomb", "scale_coulomb_sd"))
        print(f"{name}: {run.rms / best:.2f}, scale after a minute {last:.2f} +- {sd:.2f}")
        draw(found, name, out)
    fixed, adapted, right = in_c(out)
    print(f"least squares, all in C: {adapted / right:.2f}, fixed levels {fixed / right:.1f}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
