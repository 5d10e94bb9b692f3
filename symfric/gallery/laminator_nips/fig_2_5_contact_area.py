"""Contact area and pressure of a sphere on a plane, over the load.

Equation 2.1, a = [W r/2 (1/E_1 + 1/E_2)]^(1/3), and rough spheres: asperities on the sphere, and
asperities on those. Areas, pressures and loads are over those of one load.

Compared: the exponents of the area, by quadrature of Hertz's pressure over the contact, each ring
of which loads the asperities of the next size, with 2/3, 8/9 and 26/27.

Distance: largest difference of an exponent.

Reproduced: the area grows faster than the pressure, W^(2/3) and W^(1/3), as W^(8/9) with asperities
on the sphere, and as W^(26/27) with asperities on those.

Refuted: the constant of equation 2.1. Hertz has a^3 = 3/4 W r (1 - nu^2) (1/E_1 + 1/E_2) for equal
Poisson's ratios nu, so that the radius is 4 ... 14 % larger for any of them from 0.5 to 0. The
exponents do not depend on it.
"""

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.panels import NARROW, panels
from symfric.foundation.style import line
from symfric.gallery.plate import Plate, plate_of

Array = NDArray[np.float64]
EXPONENTS = (2 / 3, 8 / 9, 26 / 27)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def plate(quick: bool = False) -> Plate:
    """Load spheres that are smooth, rough, and rough on their asperities."""
    W = np.geomspace(1e-3, 1.0, 7 if quick else 61)
    areas = [area(W, generation) / area(np.ones(1), generation) for generation in range(3)]
    found = [float(np.polyfit(np.log(W), np.log(A), 1)[0]) for A in areas]

    figure, (axis,) = panels(1, NARROW, 2.8)
    names = ("area, smooth sphere", "area, asperities on it", "area, asperities on those")
    for k, (A, name) in enumerate(zip(areas, names, strict=True)):
        axis.plot(W, A, **line(k), label=name)
    axis.plot(W, W / areas[0], **line(4), label="pressure, smooth sphere")
    axis.set_xlabel("load [1]")
    axis.set_ylabel("area and pressure [1]")
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
    return plate_of(__name__, figure, far, "1", numbers, claims, within=1e-12, quick=quick)


def area(W: Array, generation: int) -> Array:
    """Area of contact of a sphere with `generation` sizes of asperities on it, up to a factor.

    Rings rho = a sqrt(1 - s^2) of equal pressure p = p_0 s, each with asperities of the load p.
    """
    a = np.cbrt(W)  # over the radius that a load of 1 has
    if generation == 0:
        return np.pi * a**2
    s = (NODES + 1) / 2
    peak = 1.5 * W / (np.pi * a**2)
    rings = area((peak[:, None] * s).ravel(), generation - 1).reshape(W.size, s.size)
    return 2 * np.pi * a**2 * ((rings * s) @ (WEIGHTS / 2))


def sinking() -> float:
    """Depth of the centre under Hertz's pressure by Boussinesq, over a^2/r; all else is 1.

    u(0) = (1/E) int p(rho)/(pi rho) 2 pi rho d rho, and a^3 = 3 W r / (4 E).
    """
    a = np.cbrt(0.75)
    theta = (NODES + 1) * np.pi / 4
    p = 1.5 / (np.pi * a**2) * np.cos(theta)
    return float(2 * (p * a * np.cos(theta)) @ (WEIGHTS * np.pi / 4) / a**2)
