"""Identify the friction of a drive, compensate it in C, and test the C in the control loop.

    m v' = force - F,   m = 1 kg,   F: bristles, 6 N to break away, 4 N while sliding

LuGre is fitted to forces at constant speeds, which determine its levels. They do not determine the
stiffness of the bristles; half of the true value is assumed. The compensator of this law runs as C
at 1 kHz with a cascaded position controller, an encoder of 1 um and a delay of one sample. The loop
follows a sine, and rests after a step, where the integrator of the controller causes hunting. The
plants have bristles, elasto-plastic bristles, or exact Coulomb friction.

    python examples/compensate_drive.py [OUT]
"""

import sys
from pathlib import Path

import numpy as np

from identification import Dataset, Fit, Points
from symfric import ElastoPlastic, ExactCoulomb, Law, LuGre, drive
from symfric.codegen import generate, verify
from symfric.compensation import Cascade, close_loop, compensator, sine, step

CONTROLLER = Cascade(kp=20.0, kv=60.0, ki=10.0, inertia=1.0, count=1e-6)
CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
"""With a load of 1 N the coefficients are newtons."""
TRUTH = LuGre(sigma_0=2e5, sigma_1=400.0, **CURVE)
PLANTS: dict[str, Law] = {
    "bristles": TRUTH,
    "elasto-plastic": ElastoPlastic(sigma_0=2e5, sigma_1=400.0, **CURVE),
    "Coulomb": ExactCoulomb(form="stribeck", **CURVE),
}


def identified() -> LuGre:
    """Fit LuGre to noisy forces at constant speeds, with an assumed stiffness of the bristles."""
    speeds = np.geomspace(5e-4, 0.1, 20)
    v = np.concatenate([-speeds[::-1], speeds])
    exact = [float(TRUTH.sliding(float(s), 1.0, int(np.sign(s)))) for s in v]
    F = np.array(exact) + 0.05 * np.random.default_rng(0).standard_normal(v.size)
    guess = {"sigma_0": 1e5, "sigma_1": 300.0}
    fit = Fit(Points(), "lugre", Dataset.of(v=v, F=F, points=True), fixed=guess).solve(throw=False)
    if not isinstance(fit.law, LuGre):
        raise SystemExit("the fit has no law")
    return fit.law


def main(out: Path) -> None:
    """Fit, write the C, simulate the loops, print, and write data and pictures into `out`."""
    law = identified()
    print(
        f"fitted: mu_s {law.mu_s:.3g}, mu_d {law.mu_d:.3g} N, v_s {1e3 * law.v_s:.3g} mm/s, ",
        end="",
    )
    print(f"sigma_2 {law.sigma_2:.3g} N s/m")

    # compensating the excess of break-away over sliding would make the axis jump at rest
    block = compensator(law, v_blend=0.02, error_gain=CONTROLLER.kp, without=["stribeck"])
    print(f"C: {verify(generate(block, out / 'c')).status}")

    for name, friction in PLANTS.items():
        plant = drive(friction, m=CONTROLLER.inertia, N=1.0)
        moving = close_loop(plant, sine(0.02, 0.5, 6.0), block, controller=CONTROLLER)
        resting = close_loop(plant, step(0.01, 20.0), block, controller=CONTROLLER)
        hunting = [1e6 * loop.hunting for loop in resting.loops.values()]
        print(f"{name}: RMS error {moving.reduction('compensated'):.1f} times smaller, ", end="")
        print("hunting {:.4g} um without, {:.2g} um with".format(*hunting))
        if friction is TRUTH:
            moving.plot(path=out / "compensate_drive.png")
            resting.plot(path=out / "compensate_drive_at_rest.png")
            moving.to_csv(out / "compensate_drive.csv")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
