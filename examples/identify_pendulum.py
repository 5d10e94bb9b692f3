"""Friction of a pendulum from four records of free swings with unknown release, in one fit.

    phi'' = -w^2 sin phi - c sign(phi') - d phi' - e |phi'| phi'

An encoder of 4096 lines reads the angle at 100 Hz. Position and velocity at the start of each
record are unknown, so each record has its own start values; Coulomb, viscous and air friction and
the natural frequency are common to all. Swings from small angles distinguish dry friction from air
friction, unlike those from large angles. A fifth record, which is not fitted, validates the result.

    python examples/identify_pendulum.py [OUT]
"""

import sys
from pathlib import Path

import casadi as ca
import numpy as np

from identification import Dataset, Fit, Shooting
from symfric import Model, Variable, simulate

TRUTH = {"w": 6.1, "c": 0.05, "d": 0.02, "e": 0.03}
RELEASED = (1.2, 0.8, 0.4, 0.2, 0.6)  # rad
LINE = 2 * np.pi / 4096
T = np.linspace(0.0, 12.0, 1201)


def pendulum() -> Model:
    """Return the model; dry friction is smoothed over 1 mrad/s."""
    phi = Variable("phi", "rad", nominal=0.1)
    v = Variable("rate", "rad/s", nominal=0.5)
    w = Variable("w", "rad/s", start=5.0, lower=0.0, doc="natural frequency")
    c = Variable("c", "rad/s^2", start=0.1, lower=0.0, doc="dry friction over inertia")
    d = Variable("d", "1/s", start=0.1, lower=0.0, doc="viscous friction over inertia")
    e = Variable("e", "1/rad", start=0.1, lower=0.0, doc="friction of the air over inertia")
    size = ca.sqrt(v**2 + 1e-6)
    brake = c * v / size + d * v + e * size * v
    swing = -(w**2) * ca.sin(phi) - brake
    return Model("pendulum", x=(phi, v), p=(w, c, d, e), ode=ca.vertcat(v, swing))


def recorded(model: Model) -> Dataset:
    """Return quantised swings, recorded from some time after the release on."""
    records: list[Dataset] = []
    for k, angle in enumerate(RELEASED):
        late = 0.13 + 0.1 * k
        run = simulate(model, 12.0 + late, x0={"phi": angle}, p=TRUTH, t_eval=T + late, rtol=1e-9)
        seen = LINE * np.round(run["phi"] / LINE)
        records.append(Dataset.of(t=T, phi=seen, units={"phi": "rad"}, name=f"swing {k}"))
    return sum(records[1:], records[0])


def main(out: Path) -> None:
    """Fit four swings, predict the fifth."""
    model = pendulum()
    data = recorded(model)
    swings, other = Dataset(data.records[:4], "swings"), Dataset(data.records[4:], "other")
    fit = Fit(Shooting(), model, swings).solve()
    print(fit)
    for (record, signal), error in fit.validate(other).items():
        off, line = 1e3 * error.rms, 1e3 * LINE
        print(f"{record}, {signal}: off by {off:.2f} mrad; a line is {line:.2f} mrad")
    fit.plot(out / "pendulum.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
