"""The static parameters of LuGre from forces at constant speeds, in six steps and in one.

    F = F_C + (F_S - F_C) exp(-(v/v_s)^delta) + sigma_2 v

A sled with carton is pulled over rubber, each speed nine times; here the points are made of the
values that the thesis printed for its pilot study (10 to 500 mm/min) and its main study (100 to 500
mm/min), with 2 % of noise. The pilot study tells all five parameters. The main study does not tell
the viscous one and hardly F_C: up to 500 mm/min the force only falls, which the fit says instead of
showing numbers alone. Up to 140 mm/min the sled moved in stick-slip: v_s of the pilot study lies
there.

    python examples/identify_laminator.py [OUT]

Source: A Friction Model for Laminator Nips, MSc thesis TFRT-5968, Lund 2015.
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from identification.starts.six_steps import six_steps
from symfric import SteadyStateLuGre

STUDIES = {
    "pilot": (SteadyStateLuGre(F_S=4.4861, F_C=2.5498, v_s=0.0012, sigma_2=230.0, delta=2.0), 10),
    "main": (SteadyStateLuGre(F_S=4.2672, F_C=2.6063, v_s=0.0049, sigma_2=5.0, delta=3.2), 100),
}
"""What was printed, and the slowest speed [mm/min]."""
STICK_SLIP = 140 / 60e3
"""Speed up to which the sled did not slide evenly [m/s]."""


def write(study: str, path: Path) -> None:
    """A file as a tensile tester leaves it, in mm/min and N."""
    law, slowest = STUDIES[study]
    v = np.repeat(np.arange(slowest, 501, 10), 9)
    noise = 1 + 0.02 * np.random.default_rng(0).standard_normal(v.size)
    force = np.array([float(law.outside(speed / 60e3, 1.0)) for speed in v.tolist()]) * noise
    rows = "\n".join(f"{speed},{F:.5f}" for speed, F in zip(v, force, strict=True))
    path.write_text(f"v [mm/min],F [N]\n{rows}\n")


def main(out: Path) -> None:
    """Write the points, fit them both ways, print, and leave pictures in `out`."""
    out.mkdir(parents=True, exist_ok=True)
    console = Console(soft_wrap=True, highlight=False)
    for study in STUDIES:
        file = out / f"{study}.csv"
        write(study, file)

        data = Dataset.read(file, points=True)
        steps = six_steps(data[0]["v"], data[0]["F"], unstable=STICK_SLIP)
        fit = Fit(Points(), "steady_state_lugre", data, free=["delta"]).solve()
        fit.plot(out / f"{study}.png")

        console.print(f"{study} study in six steps", str(steps), "", sep="\n", markup=False)
        console.print(f"{study} study at once", str(fit), "", sep="\n", markup=False)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
