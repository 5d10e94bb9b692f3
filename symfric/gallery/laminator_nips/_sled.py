"""The sled of the thesis, pulled by a wire whose end moves at a constant speed V.

Mass m, and stiffness k and damping d of the wire, are not given. With time in sqrt(m/k), force and
speed depend on Z = sqrt(k m) and on the damping ratio d/(2 Z) alone: a wire here is this pair.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from symfric import LuGre, SteadyStateLuGre, simulate
from symfric.gallery.laminator_nips._studies import PRINTED, curve
from symfric.scenes import Rabinowicz

Array = NDArray[np.float64]
WIRES = [(Z, ratio) for Z in (10.0, 30.0, 100.0, 300.0) for ratio in (0.0, 0.05, 0.2, 0.5)]
"""Z [N s/m], such as 0.2 kg on 500 N/m up to 1 kg on 90 kN/m, and damping ratio."""
SPAN = 400.0
"""How long a sled that does not stop is followed [sqrt(m/k)]; the second half counts."""


@cache
def cycle(study: str, wire: tuple[float, float], V: float) -> tuple[Array, Array]:
    """Time [sqrt(m/k)] and force of the wire [N] in one cycle, by hand, with dry friction.

    Rest until the wire pulls with F_s, and slip until the sled stops, every cycle the same. A slack
    wire does not push.
    """
    law, (Z, ratio) = PRINTED[study], wire
    d = 2 * ratio * Z
    begin = float(law.F_S) - d * V  # of the spring

    def rates(_: float, y: Array) -> list[float]:
        pull = max(y[0] + d * (V - y[1]), 0.0)
        return [Z * (V - y[1]), (pull - float(curve(law, np.maximum(y[1], 0.0)))) / Z]

    def stops(_: float, y: Array) -> float:
        return float(y[1])

    stops.terminal, stops.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    late = 1e-6  # after break-away, where the sled could rest for ever
    start = [begin + Z * V * late, V * late**2 / 2]
    run = solve_ivp(rates, (0.0, SPAN), start, method="LSODA", rtol=1e-8, atol=1e-12,
                    events=stops, dense_output=True)  # fmt: skip
    t = np.linspace(0.0 if run.status else SPAN / 2, run.t[-1], 4001)
    spring, w = run.sol(t)
    if run.status:
        rest = np.linspace(0.0, (begin - spring[-1]) / (Z * V), 4001)
        t, w = np.append(t, t[-1] + rest), np.append(w, 0 * rest)
        spring = np.append(spring, spring[-1] + Z * V * rest)
    return t, np.maximum(spring + d * (V - w), 0.0)


def swept(study: str, wire: tuple[float, float], speeds: Array) -> tuple[Array, Array]:
    """Amplitude and mean of the force of the wire [N] at `speeds` [mm/min]."""
    runs = [cycle(study, wire, v) for v in (speeds / 60e3).tolist()]
    means = [np.trapezoid(force, t) / np.ptp(t) for t, force in runs]
    return np.array([np.ptp(force) for _, force in runs]), np.array(means)


def simulated(law: SteadyStateLuGre | LuGre, wire: tuple[float, float], speed: float) -> float:
    """Amplitude [N] at `speed` [mm/min] by `Rabinowicz`: the sled seen from the moving wire end.

    A damper of the wire is viscous friction there, less a constant force: both act on V - w. The
    levels of `LuGre` are those under 1 N. The sled starts from rest, the wire without tension.
    """
    (Z, ratio), V = wire, speed / 60e3
    d, k = 2 * ratio * Z, Z**2  # of 1 kg
    damped = replace(law, sigma_2=float(law.sigma_2) + d)
    soft = 1 / k + (1 / float(law.sigma_0) if isinstance(law, LuGre) else 0.0)
    model = Rabinowicz(damped, m=1.0, k=k, v_belt=V, g=1.0).model()
    run = simulate(model, 60 * soft / V + 200 / Z, x0={"v": V}, rtol=1e-7, samples=20001)
    return float(np.ptp((k * run["x"] + d * run["v"])[10000:]))


def distance(wires: Sequence[tuple[float, float]], width: float) -> float:
    """Largest difference of amplitudes by hand and smooth over `width` [m/s], over F_s - F_c."""
    found = [0.0]
    for (study, law), wire, v in product(PRINTED.items(), wires, (100.0, 200.0)):
        exact = float(swept(study, wire, np.array([v]))[0][0])
        away = simulated(replace(law, v_eps=width), wire, v) - exact
        found.append(abs(away) / float(law.F_S - law.F_C))
    return max(found)


def bristles(study: str, stiffness: float) -> LuGre:
    """The dynamic law with the printed curve and undamped bristles of `stiffness` [N/m]."""
    law = PRINTED[study]
    return LuGre(mu_s=law.F_S, mu_d=law.F_C, v_s=law.v_s, delta=law.delta, sigma_2=law.sigma_2,
                 sigma_0=stiffness, sigma_1=0.0)  # fmt: skip


def pilot(
    wires: Sequence[tuple[float, float]], speeds: Array, quick: bool
) -> tuple[dict[str, float], dict[str, bool]]:
    """Numbers and claims of the sled under the pilot study's curve."""
    shown = curve(PRINTED["pilot"], speeds / 60e3)
    runs = np.array([swept("pilot", wire, speeds) for wire in wires])
    swings, share = runs[:, 0] > 0.1, runs[:, 1] / shown
    last = [float(speeds[swing].max()) for swing in swings]
    error = 100 * np.sqrt(np.mean((runs[:, 1] - shown) ** 2, axis=1)) / shown.mean()
    light = [ratio <= 0.2 for _, ratio in wires]
    low = runs[light, 0][:, speeds <= 100]
    spread = float((np.ptp(low, axis=1) / low.max(axis=1)).max())
    numbers = {"change of amplitude, 10 to 100 mm/min, pilot study, ratio up to 0.2 [1]": spread}
    for name, unit, values in (
        ("last speed with stick-slip", "mm/min", last),
        ("error of the means by stick-slip", "%", error),
        ("mean over the curve", "1", share),
    ):
        numbers[f"{name}, pilot study, least [{unit}]"] = float(np.min(values))
        numbers[f"{name}, pilot study, largest [{unit}]"] = float(np.max(values))
    claims = {
        "lightly damped, it swings as much within a tenth from 10 to 100 mm/min": spread < 0.1
    }
    if not quick:
        stiff = {v for v, (Z, _) in zip(last, wires, strict=True) if Z <= 100}
        claims |= {
            "sticks and slips up to 110 ... 180 mm/min": (min(last), max(last)) == (110, 180),
            "up to 120 or 130 for Z up to 100 N s/m": stiff == {120, 130},
            "the error is 4 ... 9 %": 4 < error.min() < error.max() < 9.5,
            "means are 0.76 to 1.18 of the curve": (
                np.allclose([share.min(), share.max()], [0.76, 1.18], atol=0.005)
            ),
        }
    return numbers, claims
