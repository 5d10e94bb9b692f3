"""Figures 1 and 10: force profiles and sensitivity."""

import casadi as ca
import numpy as np

from symfric import BrownMcPhee, Law, SelfTuning, symbolise
from symfric.foundation.panels import grid, panels
from symfric.foundation.style import line
from symfric.gallery.drawing import legend_below
from symfric.gallery.plate import Drawn, plate
from symfric.gallery.signals import largest

MU = {"mu_s": 0.15, "mu_d": 0.1}
V_T = 0.015  # m/s


@plate("1", within=0.1)
def fig_01_force_profiles(quick: bool) -> Drawn:
    """Friction force against slip velocity: self-tuning law and Brown-McPhee.

    The force on the body under a constant load. The paper's range and load are lost; here are the
    friction coefficients and the 15 mm/s of its stick-slip test.

    Compared: the self-tuning law with Brown-McPhee, at equal velocity of the peak and at equal
    slope at rest.

    Distance: the largest difference at equal velocity of the peak, relative to the static level.

    Reproduced: the law behaves like Brown-McPhee, within 10 % of mu_s N, if its peak is where that
    of Brown-McPhee is. Its peak is mu_s N exactly, which Brown-McPhee never reaches; and it comes
    down to mu_d N like 1/v, so that at ten times the velocity of the peak it is still 10 % above,
    Brown-McPhee 0.8 %.

    Refuted: that the law needs no transition velocity. B is an inverse velocity: half of B at twice
    the speed gives the same force, and the peak lies at tan(pi/2C)/B.
    """
    v = np.linspace(-0.15, 0.15, 301 if quick else 6001)
    brown = BrownMcPhee(v_t=V_T, **MU)
    slope = 4 * MU["mu_d"] / V_T + 16 / 9 * (MU["mu_s"] - MU["mu_d"]) / V_T
    tuned = SelfTuning.from_peak_velocity(V_T, **MU)
    laws: dict[str, Law] = {
        "self-tuning, equal peak": tuned,
        "Brown-McPhee": brown,
        "self-tuning, equal slope": SelfTuning.from_slope(slope, 1.0, **MU),
    }
    forces = {name: on_curve(law, v) for name, law in laws.items()}

    figure, (above, below) = panels(2, height=2.4)
    for k, (name, F) in enumerate(forces.items()):
        above.plot(1e3 * v, -F, label=name, **line(k))
        below.plot(1e3 * v, -(F - forces["Brown-McPhee"]) / MU["mu_s"], **line(k))
    above.set_ylabel("friction on the body / N [1]")
    below.set(
        xlabel="slip velocity [mm/s]", ylabel="difference from\nBrown-McPhee / $\\mu_s N$ [1]"
    )
    legend_below(figure, above)

    peak = forces["self-tuning, equal peak"]
    slower = SelfTuning(B=float(tuned.B) / 2, **MU)
    difference = {n: largest(F - forces["Brown-McPhee"]) / MU["mu_s"] for n, F in forces.items()}
    numbers = {
        "difference at equal slope / mu_s N [1]": difference["self-tuning, equal slope"],
        "peak of the self-tuning law / mu_s N [1]": peak.max() / MU["mu_s"],
        "peak of Brown-McPhee / mu_s N [1]": forces["Brown-McPhee"].max() / MU["mu_s"],
        "excess of Brown-McPhee over mu_d N at 10 v_t [1]": tail(brown),
        "excess of the self-tuning law over mu_d N at 10 v_t [1]": tail(tuned),
        "B at equal peak [s/mm]": 1e-3 * float(tuned.B),
        "change of F by half of B at twice the speed [1]": largest(on_curve(slower, 2 * v) - peak),
    }
    claims = {
        "half of B at twice the speed gives the same force": largest(on_curve(slower, 2 * v) - peak)
        < 1e-12,
        "the peak is mu_s N, that of Brown-McPhee below": (
            forces["Brown-McPhee"].max() < 0.9997 * MU["mu_s"] < 0.9999 * MU["mu_s"] < peak.max()
        ),
        "at ten times its velocity 10 % above mu_d N, Brown-McPhee 0.8 %": (
            abs(tail(tuned) - 0.10) < 0.005 and abs(tail(brown) - 0.008) < 5e-4
        ),
    }
    return figure, difference["self-tuning, equal peak"], numbers, claims


def on_curve(law: Law, v: np.ndarray) -> np.ndarray:
    """F/N of a law without states at the velocities v [m/s]."""
    speed = ca.SX.sym("v")
    return ca.Function("F", [speed], [law.force(speed, 1.0)])(v[None]).full()[0]


def tail(law: Law) -> float:
    """Excess of the force at 10 v_t over its limit, relative to the limit."""
    return float(on_curve(law, np.array([10 * V_T]))[0] / MU["mu_d"] - 1)


SYMBOLS = {"B": "B", "v_t": "v_t", "mu_s": "\\mu_s", "mu_d": "\\mu_d"}


@plate("1", within=3e-10)
def fig_10_sensitivity(quick: bool) -> Drawn:
    """Sensitivity of the friction force to the parameters of the law.

    The symbol in the paper's caption is lost; here are all parameters, of both laws. A curve shows
    p dF/dp / (mu_s N): by how much the force changes where a parameter changes by its own size.

    Compared: derivatives by CasADi with central differences; the self-tuning law with Brown-McPhee.

    Distance: largest difference of the derivatives, relative to mu_s N.

    Refuted: that only Brown-McPhee is sensitive to a parameter of velocity. The law depends on B
    and v by their product alone, so B dF/dB = v dF/dv, as v_t dF/dv_t = -v dF/dv there. The largest
    values are 0.47 and 0.41 with mu_d = 2/3 mu_s, and within 40 % of each other for ratios from 0.3
    to 0.9. mu_d acts through C, whose slope by mu_d / mu_s grows without bound as that tends to 1.
    """
    v = np.linspace(-0.1, 0.1, 201 if quick else 2001)
    laws: dict[str, tuple[Law, tuple[str, ...]]] = {
        "self-tuning": (
            SelfTuning.from_peak_velocity(V_T, **MU),
            ("B", "mu_s", "mu_d"),
        ),
        "Brown-McPhee": (BrownMcPhee(v_t=V_T, **MU), ("v_t", "mu_s", "mu_d")),
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
    return figure, max(errors), numbers, claims


def ratio_of_largest(ratio: float) -> float:
    """The largest v dF/dv of the self-tuning law over that of Brown-McPhee, at mu_d / mu_s."""
    v, mu = np.linspace(-0.1, 0.1, 401), {**MU, "mu_d": ratio * MU["mu_s"]}
    laws = (SelfTuning.from_peak_velocity(V_T, **mu), BrownMcPhee(v_t=V_T, **mu))
    one, other = (largest(by_its_speed(law, v)) for law in laws)
    return one / other


def by_its_speed(law: Law, v: np.ndarray) -> np.ndarray:
    """The velocity times dF/dv, over mu_s N, at the velocities v [m/s]."""
    speed = ca.SX.sym("v")
    slope = ca.Function("slope", [speed], [ca.jacobian(law.force(speed, 1.0), speed)])
    return v * slope(v[None]).full()[0] / MU["mu_s"]


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
    return dF(v[None], value).full()[0] * value / MU["mu_s"], differences * value / MU["mu_s"]
