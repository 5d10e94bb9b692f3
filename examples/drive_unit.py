"""Export a drive with friction to other tools as a Functional Mock-up Unit.

    m v' = force - F(v),   m = 1 kg,   F: 6 N to break away, 4 N while sliding

The unit contains the adaptive integrator and does not need Python. A position controller samples it
at 1 kHz, as in co-simulation: its force jumps every millisecond. The result is compared with that
of `stepper` in Python.

    python examples/drive_unit.py [OUT]
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from symfric import LuGre, stepper
from symfric.fmu import export_fmu, running
from symfric.foundation.panels import panels, save
from symfric.scenes import Drive

Array = NDArray[np.float64]
H, END = 1e-3, 2.0
TIMES: Array = np.arange(0.0, END, H)


def force(x: float, v: float, t: float) -> float:
    """PD control to 10 cm, and back after a second, in N."""
    goal = 0.1 if t < 1.0 else 0.0
    return float(np.clip(2000.0 * (goal - x) - 60.0 * v, -20.0, 20.0))


def in_unit(path: Path) -> tuple[Array, float]:
    """Position at the samples, and attempts of the integrator."""
    rows: list[float] = []
    with running(path) as unit:
        for t in TIMES.tolist():
            x, v = unit.get(["x", "v"]).tolist()
            rows.append(x)
            unit.set({"force": force(x, v, t)})
            unit.step(H)
        return np.array(rows), float(unit.get(["attempts"])[0])


def in_python(scene: Drive) -> Array:
    """Position at the samples, by the plant in Python."""
    plant = stepper(scene.model(), H, rtol=1e-8)
    rows: list[float] = []
    for t in TIMES.tolist():
        x, v = plant["x"], plant["v"]
        rows.append(x)
        plant.step([force(x, v, t)])
    return np.array(rows)


def main(out: Path) -> None:
    """Export, run, compare and draw."""
    law = LuGre(mu_s=6.0, mu_d=4.0, v_s=1e-2, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0)
    scene = Drive(law, m=1.0, N=1.0)
    unit = export_fmu(scene, out / "drive.fmu", rtol=1e-8, t_end=END)
    print(unit)
    x, attempts = in_unit(unit.path)
    difference = float(np.abs(x - in_python(scene)).max())
    print(f"1 kHz: {attempts / TIMES.size:.2f} attempts a sample, unit - Python {difference:.1e} m")
    figure, (axes,) = panels(1)
    axes.plot(TIMES, 1e3 * x)
    title = "Drive with LuGre friction as a unit, PD at 1 kHz"
    axes.set(xlabel="t [s]", ylabel="x [mm]", title=title)
    save(figure, out / "drive_unit.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
