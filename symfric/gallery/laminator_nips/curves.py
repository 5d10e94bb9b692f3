"""Figures 2.5, 3.2 and 3.3: contact area and steady curves."""

from dataclasses import replace

import numpy as np
from scipy.optimize import root_scalar

from symfric import LuGre, simulate
from symfric.foundation.numeric import Array
from symfric.foundation.panels import NARROW, legend_below, panels
from symfric.foundation.style import line
from symfric.gallery.laminator_nips.studies import PRINTED, curve
from symfric.gallery.plate import Drawn, plate
from symfric.scenes import Prescribed

EXPONENTS = (2 / 3, 8 / 9, 26 / 27)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


@plate("1", within=1e-12)
def fig_2_5_contact_area(quick: bool) -> Drawn:
    """Contact area and pressure of a sphere on a plane, over the load.

    Equation 2.1, a = [W r/2 (1/E_1 + 1/E_2)]^(1/3), and rough spheres: asperities on the sphere,
    and asperities on those. Areas, pressures and loads are relative to those at one load.

    Compared: the exponents of the area with 2/3, 8/9 and 26/27, by quadrature of Hertz's pressure
    over the contact, each ring of which loads the asperities of the next size.

    Distance: largest difference of an exponent.

    Reproduced: the area grows faster than the pressure, W^(2/3) and W^(1/3), as W^(8/9) with
    asperities on the sphere, and as W^(26/27) with asperities on those.

    Refuted: the constant of equation 2.1. Hertz's formula is a^3 = 3/4 W r (1 - nu^2) (1/E_1 +
    1/E_2) for equal Poisson's ratios nu, so the radius is 4 ... 14 % larger for ratios from 0.5 to
    0. The exponents do not depend on the constant.
    """
    W = np.geomspace(1e-3, 1.0, 7 if quick else 61)
    areas = [area(W, generation) / area(np.ones(1), generation) for generation in range(3)]
    found = [float(np.polyfit(np.log(W), np.log(A), 1)[0]) for A in areas]

    figure, (axis,) = panels(1, NARROW, 2.8)
    names = ("area, smooth sphere", "area, asperities on it", "area, asperities on those")
    for k, (A, name) in enumerate(zip(areas, names, strict=True)):
        axis.plot(W, A, **line(k), label=name)
    axis.plot(W, W / areas[0], **line(4), label="pressure, smooth sphere")
    axis.set(xlabel="load [1]", ylabel="area and pressure [1]")
    axis.legend(fontsize="small")

    constants = [(0.75 * (1 - nu**2) / 0.5) ** (1 / 3) for nu in (0.5, 0.3, 0.0)]
    numbers = {f"exponent of the {n} [1]": e for n, e in zip(names, found, strict=True)}
    pressure = 1 - found[0]
    numbers["exponent of the pressure, smooth sphere [1]"] = pressure
    for nu, c in zip((0.5, 0.3, 0.0), constants, strict=True):
        numbers[f"radius by Hertz over that of equation 2.1, nu = {nu:g} [1]"] = c
    numbers["centre sinks by Boussinesq, over a^2/r of the sphere [1]"] = sinks = sinking()
    claims = {
        "the area grows faster than the pressure": found[0] > pressure > 0.3,
        "Hertz's radius is 4 ... 14 % larger than that of equation 2.1": (
            np.allclose([constants[0], constants[-1]], [1.04, 1.145], atol=0.001)
        ),
        "it makes the surfaces fit": abs(sinks - 1) < 1e-12,
    }
    far = max(abs(one / other - 1) for one, other in zip(found, EXPONENTS, strict=True))
    return figure, far, numbers, claims


def area(W: Array, generation: int) -> Array:
    """Return the contact area, up to a factor, of a sphere with `generation` sizes of asperities.

    Rings rho = a sqrt(1 - s^2) have equal pressure p = p_0 s, and asperities of the load p.
    """
    a = np.cbrt(W)  # relative to the radius at a load of 1
    if generation == 0:
        return np.pi * a**2
    s = (NODES + 1) / 2
    peak = 1.5 * W / (np.pi * a**2)
    rings = area((peak[:, None] * s).ravel(), generation - 1).reshape(W.size, s.size)
    return 2 * np.pi * a**2 * ((rings * s) @ (WEIGHTS / 2))


def sinking() -> float:
    """Return the depth of the centre under Hertz's pressure by Boussinesq, relative to a^2/r.

    u(0) = (1/E) int p(rho)/(pi rho) 2 pi rho d rho, a^3 = 3 W r / (4 E), and W = r = E = 1.
    """
    a = np.cbrt(0.75)
    theta = (NODES + 1) * np.pi / 4
    p = 1.5 / (np.pi * a**2) * np.cos(theta)
    return float(2 * (p * a * np.cos(theta)) @ (WEIGHTS * np.pi / 4) / a**2)


@plate("1", within=2e-9)
def fig_3_2_stribeck_and_viscous_part(quick: bool) -> Drawn:
    """Steady LuGre friction: the Stribeck part, the viscous part, and their sum.

    The parameters of the figure are not given; the figure uses those of the pilot study.

    Compared: the force of the dynamic LuGre law after some time at a constant speed, simulated,
    with equation 3.5.

    Distance: largest difference for any speed, relative to F_s.

    Reproduced: the viscous part raises the level and is the linear tail.

    Refuted: that friction keeps a stable value beyond a plateau, which according to the thesis
    begins at 6.5 mm/s. In its law the tail of the pilot study rises from there by a tenth, reaches
    F_s again, within half a percent, at 500 mm/min, the end of the data, and is above it at the 650
    mm/min of the machine.
    """
    law = PRINTED["pilot"]
    v = np.linspace(1e-6, 650 / 60e3, 400)
    viscous = float(law.sigma_2) * v
    figure, (axis,) = panels(1, NARROW, 2.8)
    total = curve(law, v)
    parts = {"Stribeck part": total - viscous, "viscous part": viscous, "sum": total}
    for k, (name, force) in enumerate(parts.items()):
        axis.plot(v, force, **line(k), label=name)

    speeds = np.array([30.0, 300.0] if quick else [10.0, 30.0, 60.0, 130.0, 300.0, 500.0]) / 60e3
    steady = np.array([after_a_while(speed) for speed in speeds.tolist()])
    axis.plot(speeds, steady, "o", color="k", label="dynamic LuGre law")
    axis.set(xlabel="velocity [m/s]", ylabel="friction force [N]")
    legend_below(figure, axis, 2)

    far = float(np.abs(steady - curve(law, speeds)).max()) / float(law.F_S)
    plateau, end, machine = curve(law, np.array([6.5e-3, 500 / 60e3, 650 / 60e3])).tolist()
    numbers = {
        "static force F_s [N]": float(law.F_S),
        "force at 6.5 mm/s, where the thesis sees a plateau [N]": plateau,
        "force at 500 mm/min, the end of the data [N]": end,
        "force at 650 mm/min, the end of the machine's range [N]": machine,
    }
    static = float(law.F_S)
    claims = {
        "the tail reaches F_s at the end of the data": abs(end / static - 1) < 0.005,
        "and is above it at the end of the machine's range": machine > 1.1 * static,
        "it rises by a tenth from the plateau to the end of the data": end > 1.1 * plateau,
    }
    return figure, far, numbers, claims


def after_a_while(speed: float) -> float:
    """Return the force [N] of the dynamic law of the pilot study after sliding by 1 mm."""
    sled = Prescribed.preset("laminator_pilot", LuGre(sigma_0=1e5, sigma_1=30.0))
    run = simulate(sled.model(), 1e-3 / speed, u={"v": speed}, samples=2)
    return float(run["friction"][-1])


SIGMA_2 = (0.0, 60.0, 120.0, 230.0, 400.0)  # N s/m


@plate("1", within=(0.01, 0.0002))
def fig_3_3_viscous_friction(quick: bool) -> Drawn:
    """Steady LuGre friction for several viscous coefficients.

    The values of the figure are not given; those used lie between the values of the two studies.

    Compared: the speed of least force, from the roots of the derivative, with the minima of the
    curves.

    Distance: largest difference, relative to v_s.

    Reproduced: the viscous friction raises the curve. Without it there is no minimum; the larger
    sigma_2, the higher the minimum and the lower its speed. Above a value that follows from the
    steepest slope of the Stribeck part, six times that of the pilot study, the force rises
    throughout.
    """
    pilot = PRINTED["pilot"]
    v_s, fall = float(pilot.v_s), float(pilot.F_S) - float(pilot.F_C)
    v = np.linspace(1e-6, 500 / 60e3, 400 if quick else 40_000)

    def slope(speed: float, viscous: float = 0.0) -> float:
        """Return the slope of the curve [N s/m]."""
        falling = 2 * fall * speed / v_s**2 * float(np.exp(-((speed / v_s) ** 2)))
        return viscous - falling

    figure, (axis,) = panels(1, NARROW, 2.8)
    steepest = -slope(v_s / np.sqrt(2))
    numbers = {"sigma_2 beyond which nothing falls [N s/m]": steepest}
    far, lowest = 0.0, list[tuple[float, float]]()
    for k, sigma_2 in enumerate(SIGMA_2):
        force = curve(replace(pilot, sigma_2=sigma_2), v)
        axis.plot(v, force, **line(k), label=f"{sigma_2:g} N s/m")
        if sigma_2 > 0:
            root = root_scalar(slope, args=(sigma_2,), bracket=[v_s / np.sqrt(2), v[-1]])
            least = float(root.root)
            numbers[f"speed of least force, sigma_2 = {sigma_2:g} N s/m [m/s]"] = least
            lowest.append((least, float(force.min())))
            far = max(far, abs(float(v[np.argmin(force)]) - least) / v_s)
    axis.set(xlabel="velocity [m/s]", ylabel="friction force [N]")
    axis.legend(
        title="viscous friction", loc="upper left", bbox_to_anchor=(0.2, 1), fontsize="small"
    )
    claims = {
        "the larger sigma_2, the slower the minimum": all(np.diff([at for at, _ in lowest]) < 0),
        "and the higher": all(np.diff([force for _, force in lowest]) > 0),
        "nothing falls from six times the sigma_2 of the pilot study on": (
            abs(steepest / (6 * float(pilot.sigma_2)) - 1) < 0.01
        ),
    }
    return figure, far, numbers, claims
