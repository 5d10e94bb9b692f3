"""Sensitivity of the friction force to the parameters of the law.

The symbol in the paper's caption is lost; here are all parameters, of both laws. A curve shows p
dF/dp / (mu_s N): by how much the force changes where a parameter changes by its own size.

Compared: derivatives by CasADi with central differences; the self-tuning law with Brown-McPhee.

Distance: largest difference of the derivatives, relative to mu_s N.

Refuted: that only Brown-McPhee is sensitive to a parameter of velocity. The law depends on B and v
by their product alone, so B dF/dB = v dF/dv, as v_t dF/dv_t = -v dF/dv there. The largest values
are 0.47 and 0.41 with mu_d = 2/3 mu_s, and within 40 % of each other for ratios from 0.3 to 0.9.
mu_d acts through C, whose slope by mu_d / mu_s grows without bound as that tends to 1.
"""

import casadi as ca
import numpy as np

from symfric import BrownMcPhee, Law, SelfTuning, symbolise
from symfric.foundation.panels import grid
from symfric.foundation.style import line
from symfric.gallery.plate import Plate, plate_of
from symfric.gallery.signals import largest

V_T, MU_S, MU_D = 0.015, 0.15, 0.1  # m/s, 1, 1
SYMBOLS = {"B": "B", "v_t": "v_t", "mu_s": "\\mu_s", "mu_d": "\\mu_d"}


def plate(quick: bool = False) -> Plate:
    """All parameters of both laws from -100 to 100 mm/s."""
    v = np.linspace(-0.1, 0.1, 201 if quick else 2001)
    laws: dict[str, tuple[Law, tuple[str, ...]]] = {
        "self-tuning": (
            SelfTuning.from_peak_velocity(V_T, mu_s=MU_S, mu_d=MU_D),
            ("B", "mu_s", "mu_d"),
        ),
        "Brown-McPhee": (BrownMcPhee(mu_s=MU_S, mu_d=MU_D, v_t=V_T), ("v_t", "mu_s", "mu_d")),
    }
    figure, [axes] = grid(1, 2, height=3.6, sharey=True)
    numbers: dict[str, float] = {}
    errors: list[float] = []
    for axis, (title, (law, names)) in zip(axes, laws.items(), strict=True):
        for k, name in enumerate(names):
            by_casadi, by_differences = sensitivity(law, name, v)
            axis.plot(1e3 * v, -by_casadi, label=f"to ${SYMBOLS[name]}$", **line(k))
            errors.append(largest(by_casadi - by_differences))
            numbers[f"largest sensitivity of {title} to {name} [1]"] = largest(by_casadi)
        axis.set_title(title, fontsize="medium")
        axis.set_xlabel("slip velocity [mm/s]")
        axis.legend(loc="upper right", frameon=False)
    axes[0].set_ylabel("sensitivity of friction / $\\mu_s N$ [1]")
    for ratio in (0.8, 0.99):
        numbers[f"dC / d(mu_d/mu_s) at mu_d/mu_s = {ratio} [1]"] = (
            -2 / np.pi / np.sqrt(1 - ratio**2)
        )
    scaled = {law: sensitivity(laws[law][0], laws[law][1][0], v)[0] for law in laws}
    by_speed = {law: by_its_speed(laws[law][0], v) for law in laws}
    claims = {
        "B dF/dB = v dF/dv": np.allclose(scaled["self-tuning"], by_speed["self-tuning"]),
        "v_t dF/dv_t = -v dF/dv": np.allclose(scaled["Brown-McPhee"], -by_speed["Brown-McPhee"]),
        "the largest of both are 0.47 and 0.41": (
            np.allclose([largest(one) for one in scaled.values()], [0.47, 0.41], atol=0.01)
        ),
    }
    apart = [abs(ratio_of_largest(ratio) - 1) for ratio in (0.3, 0.5, 0.7, 0.9)]
    numbers["largest sensitivity to B over that to v_t, less 1, ratios from 0.3 to 0.9 [1]"] = max(
        apart
    )
    claims["they are within 40 % of each other for ratios from 0.3 to 0.9"] = max(apart) < 0.4
    far = max(errors)
    return plate_of(__name__, figure, far, "1", numbers, claims, within=3e-10, quick=quick)


def ratio_of_largest(ratio: float) -> float:
    """The largest v dF/dv of the self-tuning law over that of Brown-McPhee, at mu_d / mu_s."""
    v, mu = np.linspace(-0.1, 0.1, 401), {"mu_s": MU_S, "mu_d": ratio * MU_S}
    laws = (SelfTuning.from_peak_velocity(V_T, **mu), BrownMcPhee(v_t=V_T, **mu))
    one, other = (largest(by_its_speed(law, v)) for law in laws)
    return one / other


def by_its_speed(law: Law, v: np.ndarray) -> np.ndarray:
    """The velocity times dF/dv, over mu_s N, at the velocities v [m/s]."""
    speed = ca.SX.sym("v")
    slope = ca.Function("slope", [speed], [ca.jacobian(law.force(speed, 1.0), speed)])
    return v * slope(v[None]).full()[0] / MU_S


def sensitivity(law: Law, name: str, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """P dF/dp / (mu_s N) by CasADi and by central differences, at the velocities v [m/s]."""
    value, speed = float(getattr(law, name)), ca.SX.sym("v")
    free, (parameter,) = symbolise(law, name)
    force = free.force(speed, 1.0)
    p = parameter.symbol
    F = ca.Function("F", [speed, p], [force])
    dF = ca.Function("dF", [speed, p], [ca.jacobian(force, p)])
    h = 1e-5 * value
    differences = (F(v[None], value + h) - F(v[None], value - h)).full()[0] / (2 * h)
    return dF(v[None], value).full()[0] * value / MU_S, differences * value / MU_S
