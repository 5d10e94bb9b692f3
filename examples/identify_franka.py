"""Friction in a joint of an arm at low speed: a bristle compared with elements with memory.

The record has angle and friction torque of a joint that moves slowly back and forth (400 Hz). Both
laws are fitted to the first half of it under the measured velocity. Initial values are computed
from the data: levels from bins of the speed, stiffness from the branches after reversals, elements
from a convex problem. The second half validates them. LuGre has no memory of earlier reversals;
generalised Maxwell-slip (GMS) with three elements has.

    python examples/identify_franka.py [OUT] [CSV]

CSV has columns time, q7 and q7_tau_J_compensate. By default the record in ../shared/data is used,
or a simulated one if there is none.
"""

import sys
from pathlib import Path

import numpy as np

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from symfric import GMS, Element, Hold, LuGre, simulate
from symfric.scenes import Prescribed

MEASURED = Path(__file__).parents[2] / "shared" / "data" / "franka_low_speed" / "case4_slow.csv"
COLUMNS = {"t": "time", "x": "q7", "F": "q7_tau_J_compensate"}
UNITS = {"t": "s", "x": "rad", "F": "N m"}


def made_up(path: Path) -> Path:
    """Write a simulated file: GMS of three elements, 20 s back and forth, noise and offset."""
    t = np.arange(0.0, 20.0, 0.005)
    q = 0.65 + 0.15 * np.sin(2 * t) + 0.03 * np.sin(0.7 * t)
    elements = (Element(2e4, 0.4), Element(900.0, 0.4), Element(4.0, 0.2))
    law = GMS(elements=elements, mu_s=0.24, mu_d=0.17, v_s=0.15, C=20.0, form="event")
    v = np.diff(q) / np.diff(t)
    run = simulate(Prescribed(law, N=1.0).model(), t[-1], u={"v": Hold(t[:-1], v)}, t_eval=t)
    F = run["friction"] - 0.2 + 0.03 * np.random.default_rng(0).standard_normal(t.size)
    rows = "\n".join(f"{a:.4f},{b:.6f},{c:.5f}" for a, b, c in zip(t, q, F, strict=True))
    path.write_text(f"time,q7,q7_tau_J_compensate\n{rows}\n")
    return path


def laws() -> dict[str, tuple[LuGre | GMS, list[str]]]:
    """Laws, and parameters fitted besides levels, viscous coefficient and Stribeck velocity."""
    gms = GMS(elements=tuple(Element(1e3, 1 / 3) for _ in range(3)), form="event")
    return {
        "LuGre": (LuGre(), ["delta"]),
        "GMS": (gms, ["delta", "C", "k_1", "k_2", "k_3", "alpha_2", "alpha_3"]),
    }


def main(out: Path, file: Path | None) -> None:
    """Read, fit to one half, validate by the other, and write pictures into `out`."""
    out.mkdir(parents=True, exist_ok=True)
    if file is None:
        file = MEASURED if MEASURED.is_file() else made_up(out / "made_up.csv")
    print(f"data: {file.name}")

    record = Dataset.read(file, columns=COLUMNS, units=UNITS).thinned(2)[0]
    v = np.gradient(record["x"], record.time)  # more accurate than a tachometer
    si = {"v": "rad/s", "F": "N m"}
    first, rest = Dataset.of(t=record.time, v=v, F=record["F"], units=si, name="arm").split(0.5)

    for name, (law, free) in laws().items():
        fit = Fit(Points(offset=True), law, first, free=free, starts=3).solve(throw=False)
        fit.plot(out / f"{name}.png")
        (half,) = fit.validate(rest).values()
        print(f"{name}: {half.rms:.4f} N m on the second half, {fit.status.name}")
        print(fit, "", sep="\n")


if __name__ == "__main__":
    given = [Path(text) for text in sys.argv[1:]]
    main(given[0] if given else Path("out"), given[1] if len(given) > 1 else None)
