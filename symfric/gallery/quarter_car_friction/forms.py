"""Figures 8, 13 and 14: forms and parts of the friction."""

from itertools import pairwise

import casadi as ca
import numpy as np

from symfric import QuarterCarSimple, Trajectory
from symfric.foundation.numeric import Array
from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import QUIET, line
from symfric.gallery.plate import Drawn, plate
from symfric.gallery.quarter_car_friction import rig
from symfric.gallery.quarter_car_friction.rig import as_printed, driven
from symfric.gallery.shared import look
from symfric.results.signals import integral_between

END, VISCOUS = 10.0, 0.02
"""End of the curve [Stribeck velocities], and its viscous slope [F_C per Stribeck velocity]."""


@plate("1", within=1e-6)
def fig_08_break_points(quick: bool) -> Drawn:
    """Conventional friction models: Tustin's model, and models with break points.

    The figure has no numbers. Here a Stribeck curve of 1.5 F_C at rest, with a viscous part of 2 %
    of F_C per Stribeck velocity, is approximated up to ten Stribeck velocities by Coulomb and
    viscous friction, which the paper calls Tustin's model, and by straight pieces between break
    points.

    Compared: the largest error of four pieces on a curve of exponent 1 with that of chords of an
    exponential in closed form.

    Distance: relative difference of these errors.

    Reproduced: the Stribeck effect with one or more break points gives a better approximation at
    low velocities. One break point leaves less than half the error of Tustin's model, two leave
    less, and each further point less again; this holds for static levels of 1.2 to 3 F_C and
    exponents of 1 and 2.
    """
    v = np.linspace(0.0, END, 20_001 if quick else 200_001)
    figure, (axis,) = panels(1, NARROW, 2.8)
    axis.plot(v, stribeck(v, 1.5, 2.0), color=QUIET, linewidth=3.0, label="Stribeck curve")
    axis.plot(v, 1 + VISCOUS * v, **line(1), label="Coulomb and viscous")
    for k, points in enumerate((1, 3), start=2):
        at = knots(v, points + 1, 1.5, 2.0)
        axis.plot(
            at, stribeck(at, 1.5, 2.0), marker=".", **line(k), label=f"break points: {points}"
        )
    axis.set(xlabel="velocity / Stribeck velocity [1]", ylabel="friction / F_C [1]")
    axis.legend(fontsize="small")

    numbers, better = dict[str, float](), list[bool]()
    for level in (1.2, 1.5, 3.0):
        for delta in (1.0, 2.0):
            left = [level - 1, *(error(v, n, level, delta) for n in (2, 3, 5, 9))]
            better.append(left[1] < 0.5 * left[0] and all(np.diff(left) < 0))
            if (level, delta) == (1.5, 2.0):
                numbers |= {
                    f"largest error over F_C, break points: {n} [1]": e
                    for n, e in zip((0, 1, 2, 4, 8), left, strict=True)
                }
    exact = 0.5 * max(chord(a, b) for a, b in pairwise(knots(v, 4, 1.5, 1.0).tolist()))
    numbers["largest error of four pieces, exponent of 1, over F_C [1]"] = error(v, 4, 1.5, 1.0)
    claims = {"each break point makes it better, the first by half": all(better)}
    return figure, abs(error(v, 4, 1.5, 1.0) / exact - 1), numbers, claims


def stribeck(v: Array, level: float, delta: float) -> Array:
    """Return F/F_C at velocities in Stribeck velocities, with the static `level` at rest."""
    return 1 + (level - 1) * np.exp(-(v**delta)) + VISCOUS * v


def curvature(v: Array, level: float, delta: float) -> Array:
    """Return the second derivative of the curve, for exponents of 1 and 2."""
    inner = 4 * v**2 - 2 if delta == 2.0 else 1.0
    return (level - 1) * inner * np.exp(-(v**delta))


def knots(v: Array, pieces: int, level: float, delta: float) -> Array:
    """Return ends of pieces with equal shares of int sqrt|F''| dv, so that errors are equal."""
    density = np.sqrt(np.abs(curvature(v, level, delta)))
    share = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)])
    return np.interp(np.linspace(0.0, share[-1], pieces + 1), share, v)


def error(v: Array, pieces: int, level: float, delta: float) -> float:
    """Return the largest distance of straight pieces from the curve."""
    at, F = knots(v, pieces, level, delta), stribeck(v, level, delta)
    return float(np.abs(np.interp(v, at, stribeck(at, level, delta)) - F).max())


def chord(a: float, b: float) -> float:
    """Return the largest distance of exp(-v) from its chord between a and b."""
    slope = (np.exp(-a) - np.exp(-b)) / (b - a)
    v = -np.log(slope)
    return float(np.exp(-a) - slope * (v - a) - np.exp(-v))


@plate("1", within=0.001)
def fig_13_simple_form(quick: bool) -> Drawn:
    """Friction of the simple form, without the Coulomb part, over the velocity of the body.

    Compared: the force along the run with equation 21 with a decreasing exponential.

    Distance: largest difference beyond 1 mm/s, since the law is smooth over 0.01 mm/s, relative to
    C_e.

    Reproduced: there is no hysteresis, as the paper states: the law is a curve.

    Refuted: the sign of its exponent. The printed exponential grows without bound at the speeds of
    the figure, where according to the text the force quickly dips; it decreases for e1 < 0.
    """
    C_e, e_1, sigma_v = (rig.FRICTION[name] for name in ("C_e", "e_1", "sigma_v"))
    law = QuarterCarSimple(C_e=C_e, e_1=e_1, sigma_v=sigma_v, v_eps=1e-5)
    run = rig.ride(law, samples=601 if quick else 6001)
    v, force = run["v_b"], run["friction"]

    figure, (axis,) = panels(1, NARROW, 3.0)
    axis.plot(1e3 * v, force, color=look("quarter_car_simple")["color"], marker=".", markersize=2,
              linewidth=0.6)  # fmt: skip
    axis.set(xlabel="velocity of the body [mm/s]", ylabel="damping friction [N]")

    exact = C_e * np.exp(-np.abs(v) / e_1) * np.sign(v) + sigma_v * v
    moves = np.abs(v) > 1e-3
    fastest = float(np.abs(v).max())
    numbers = {
        "largest speed [m/s]": fastest,
        "transition friction there, falling [N]": C_e * np.exp(-fastest / e_1),
        "transition friction there, as printed [N]": C_e * np.exp(fastest / e_1),
    }
    far = float(np.abs(exact - force)[moves].max()) / C_e
    claims = {
        "the law is a curve": far < 2e-3,
        "with the printed sign its force is beyond all bounds": C_e * np.exp(fastest / e_1) > 1e8,
    }
    return figure, far, numbers, claims


@plate("1", within=4e-5)
def fig_14_two_parts(quick: bool) -> Drawn:
    """Damping and Coulomb friction, separately, over the velocity of the body.

    Compared: the sum of both parts, by equation 12 from the motion alone, with the force of the
    law.

    Distance: largest difference outside the window in which the body sticks, relative to the
    break-away force.

    Reproduced: damping is a curve, and the Coulomb part causes all of the hysteresis, as the paper
    states.

    Refuted: the printed sign of the Coulomb part. It is that of the force of the strut, not that of
    the velocity, although according to the text it is opposite to the velocity. Where both signs
    differ it drives the body, here on 7 % of the path with up to a quarter of a watt, and on 1 ...
    50 % of the path in each of ten choices of the numbers that the paper does not state.

    Undecided: how far damping dominates. Here its work is ten times that of the Coulomb part.
    """
    run = rig.ride(rig.general(), samples=1201 if quick else 6001)
    v = run["v_b"]
    damping = rig.FRICTION["C_e"] * np.exp(-np.abs(v) / rig.FRICTION["e_1"]) * np.sign(v)
    damping += rig.FRICTION["sigma_v"] * v
    printed = as_printed(run, rig.FRICTION["mu"])
    coulomb = np.abs(printed) * np.sign(v)

    moves = np.abs(v) > 1e-3
    figure, (axis,) = panels(1, NARROW, 3.0)
    for force, k, name in ((damping, 0, "damping friction"), (coulomb, 1, "Coulomb friction")):
        axis.plot(1e3 * v[moves], force[moves], ".", color=line(k)["color"], markersize=2.5,
                  label=name)  # fmt: skip
    axis.set(xlabel="velocity of the body [mm/s]", ylabel="friction force [N]")
    axis.legend(markerscale=3)

    far = float(np.abs(damping + coulomb - run["friction"])[moves].max()) / rig.BREAK_AWAY
    power, share = driven(run, rig.FRICTION["mu"])
    whole, ends = run.work("friction", "v_b"), np.array([v[0], v[-1]])
    rubbed = whole - worked(run)
    numbers = {
        "work of damping friction over the road [J]": whole - rubbed,
        "work of Coulomb friction over the road [J]": rubbed,
        "area enclosed by damping friction [N m/s]": abs(float(np.diff(below(ends))[0])),
        "area enclosed by Coulomb friction [N m/s]": abs(run.area("friction", "v_b")),
        "least power of Coulomb friction as printed [W]": power,
        "share of the motion that it drives [1]": share,
    }
    _, _, curve, loop = [*numbers.values()][:4]
    claims = {
        "damping takes ten times the work": whole > 11 * rubbed > 0,
        "the Coulomb part makes the hysteresis": loop > 100 * curve,
        "as printed it drives the body on 7 % of the way": 0.06 < share < 0.08,
        "with up to a quarter of a watt": -0.26 < power < -0.23,
    }
    if not quick:
        parts = [driven(rig.read(k), reading["mu"])[1] for k, reading in enumerate(rig.READINGS)]
        numbers["the same share, least of ten readings [1]"] = min(parts)
        numbers["the same share, greatest [1]"] = max(parts)
        claims["and in each of ten readings on 1 ... 50 % of it"] = (
            0.01 < min(parts) < max(parts) < 0.5
        )
    return figure, far, numbers, claims


def worked(run: Trajectory) -> float:
    """Return the work of damping friction [J]."""
    v = run.model.expression("v_b")
    damping = rig.FRICTION["C_e"] * ca.exp(-ca.fabs(v) / rig.FRICTION["e_1"]) * ca.fabs(v)
    power = damping + rig.FRICTION["sigma_v"] * v**2
    return integral_between(run.step_times, run.of, power, *run.span)


def below(v: np.ndarray) -> np.ndarray:
    """Return the area below the curve of damping friction from 0 to v [N m/s]."""
    e_1, sigma_v = rig.FRICTION["e_1"], rig.FRICTION["sigma_v"]
    return rig.FRICTION["C_e"] * e_1 * (1 - np.exp(-np.abs(v) / e_1)) + sigma_v * v**2 / 2
