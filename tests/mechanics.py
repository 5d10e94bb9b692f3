"""Mechanisms in minimal coordinates, written out in plain Python and NumPy.

Nothing here imports symfric, so that a mistake cannot stand on both sides of a comparison.
"""

from collections.abc import Callable
from math import cos, pi, sin, sqrt, tanh

import numpy as np

from symfric.foundation.numeric import Array

Rates = Callable[[float, Array], list[float]]
EPS = 1e-4
"""Smoothing of |f| in the reference data [N]."""


def pendulum_period(w0: float, amplitude: float) -> float:
    """Period of phi'' = -w0^2 sin(phi), by the arithmetic-geometric mean."""
    a, b = 1.0, cos(amplitude / 2)
    while abs(a - b) > 1e-15:
        a, b = (a + b) / 2, sqrt(a * b)
    return 2 * pi / (w0 * a)


def brown_mcphee(v: float, mu_s: float, mu_d: float, v_t: float) -> float:
    """Coefficient of friction."""
    x = v / v_t
    return mu_d * tanh(4 * x) + (mu_s - mu_d) * x / (x * x / 4 + 0.75) ** 2


def size(*f: float) -> float:
    """Smooth length of a force."""
    return sqrt(sum(x * x for x in f) + EPS * EPS) - EPS


def newton(residual: Callable[[Array], Array], x: Array) -> Array:
    """Root by Newton's method with differences."""
    for _ in range(40):
        r = residual(x)
        h = 1e-7 * (1 + np.abs(x))
        J = np.column_stack(
            [(residual(x + np.eye(x.size)[i] * h[i]) - r) / h[i] for i in range(x.size)]
        )
        step = np.linalg.solve(J, r)
        x = x - step
        if np.abs(step / (1 + np.abs(x))).max() < 1e-12:
            break
    return x


def double_pendulum(m: float, L: float, g: float) -> Rates:
    """Two equal slender rods; angles from hanging, both absolute, in textbook form."""

    def rates(t: float, y: Array) -> list[float]:
        a, b, wa, wb = y
        c = cos(a - b)
        M = m * L * L * np.array([[4 / 3, c / 2], [c / 2, 1 / 3]])
        s = m * L * L * sin(a - b) / 2
        right = np.array(
            [-s * wb * wb - 1.5 * m * g * L * sin(a), s * wa * wa - 0.5 * m * g * L * sin(b)]
        )
        return [wa, wb, *np.linalg.solve(M, right)]

    return rates


def pendulum_box(
    m_box: float, m: float, L: float, R: float, g: float, mu: Callable[[float], float]
) -> Rates:
    """Box and point mass; y = (x, phi, x', phi'). Reactions and accelerations by Newton."""
    last = np.array([0.0, 0.0, (m_box + m) * g, m * g])

    def rates(t: float, y: Array) -> list[float]:
        _, phi, v, w = y

        def residual(u: Array) -> Array:
            ax, alpha, ground, hinge = u
            # acceleration of the mass at (x + L sin phi, -L cos phi)
            mx = ax + L * (alpha * cos(phi) - w * w * sin(phi))
            mz = L * (alpha * sin(phi) + w * w * cos(phi))
            hx, hz = m * mx, m * (mz + g)  # what the hinge does to the mass
            torque = R * hinge * mu(R * w)
            return np.array(
                [
                    m_box * ax + hx + ground * mu(v),
                    # moment about the mass: the hinge force acts at -L (sin, -cos)
                    hx * L * cos(phi) + hz * L * sin(phi) + torque,
                    ground - size(m_box * g + hz),
                    hinge - size(hx, hz),
                ]
            )

        last[:] = newton(residual, last)
        return [v, w, last[0], last[1]]

    return rates


def four_mass(mu: Callable[[float], float], g: float = 9.8) -> Rates:
    """The four sliders in the angle of the first rod and x4; y = (theta, x4, rates)."""
    last = np.zeros(3)

    def rates(t: float, y: Array) -> list[float]:
        th, x4, w, v4 = y
        x1, y2 = 5 * cos(th), 5 * sin(th)
        z3 = sqrt(49 - y2 * y2)
        v1, v2 = -y2 * w, x1 * w
        v3 = -y2 * v2 / z3

        def residual(u: Array) -> Array:
            alpha, l5, l6 = u
            a1, a2 = -y2 * alpha - x1 * w * w, x1 * alpha - y2 * w * w
            a3 = -(v2 * v2 + y2 * a2 + v3 * v3) / z3
            N1 = size(l5 * y2) + size(2 * g)
            N2 = size(l5 * x1) + size(l6 * z3 - 2 * g)
            N3 = size(l6 * y2)
            return np.array(
                [
                    2 * a1 + 2 * (x1 - 3) - 10 * (x4 - x1 - 1) + l5 * x1 + N1 * mu(v1),
                    2 * a2 + 2 * (y2 - 4) + (l5 + l6) * y2 + N2 * mu(v2),
                    6 * (a3 + g) + 2 * (z3 - 3) + l6 * z3 + N3 * mu(v3),
                ]
            )

        last[:] = newton(residual, last)
        a4 = (-10 * (x4 - x1 - 1) - size(6 * g) * mu(v4)) / 6
        return [w, v4, last[0], a4]

    return rates


def slider_crank(mu: Callable[[float], float], R: float = 0.1, a: float = 0.1) -> Rates:
    """Haug's slider-crank in the crank angle; y = (theta, omega). Friction in the bearing."""
    last = np.zeros(3)
    m_crank, m_slider, J, r, length, g = 0.5, 5.0, 0.2, 0.08, 0.3, 9.8

    def rates(t: float, y: Array) -> list[float]:
        th, w = y
        c, s = cos(th), sin(th)
        py, pz = 0.1 - r * s, 0.1 + r * c
        x = sqrt(length * length - py * py - pz * pz)
        # x^2 + py^2 + pz^2 = const, twice differentiated
        dy, dz = -r * c, -r * s
        dx = -(py * dy + pz * dz) / x
        bend = -(dx * dx + dy * dy + py * (r * s) + dz * dz + pz * (-r * c)) / x

        def residual(u: Array) -> Array:
            alpha, lam, N = u
            f = lam * np.array([-x, py, pz])  # force on the crank's pin, from the slider's end
            arm = np.array([0.0, -r * s, r * c])
            moment = np.cross(arm, f)
            # the bearing holds the crank: minus force and weight, minus moments across x
            F, T = -f - np.array([0.0, 0.0, -m_crank * g]), -moment
            axes = np.array([[0.0, -s, c], [0.0, -c, -s]])  # x' and y' of the bearing frame
            fx2, fy2 = -(axes[1] @ T) / a, (axes[0] @ T) / a
            pressed = size(-(axes[0] @ F) - fx2, -(axes[1] @ F) - fy2) + size(fx2, fy2)
            return np.array(
                [
                    J * alpha - moment[0] + R * N * mu(R * w),
                    m_slider * (dx * alpha + bend * w * w) - lam * x,
                    N - pressed - size(F[0]),
                ]
            )

        last[:] = newton(residual, last)
        return [w, last[0]]

    return rates


def rocker_angle(crank: float, coupler: float, rocker: float, base: float, theta: float) -> float:
    """Angle of the rocker of a four-bar linkage, open branch, by Freudenstein's equation."""
    k1, k2 = base / crank, base / rocker
    k3 = (crank**2 - coupler**2 + rocker**2 + base**2) / (2 * crank * rocker)
    a = cos(theta) - k1 - k2 * cos(theta) + k3
    b = -2 * sin(theta)
    c = k1 - (k2 + 1) * cos(theta) + k3
    return 2 * np.arctan2(-b - sqrt(b * b - 4 * a * c), 2 * a)


def four_bar_with_friction(
    lengths: tuple[float, float, float, float],
    density: float,
    radius: float,
    mu: Callable[[float], float],
    angles: tuple[float, float, float],
    rates: tuple[float, float, float],
    g: float,
) -> tuple[Array, Array]:
    """Forces in the four pins of a four-bar linkage [N] and angular accelerations of its links.

    Newton and Euler for each link by itself, with both components of all pins as unknowns: 9
    accelerations, 8 forces, and N = |force| in each pin by iteration.

    Args:
        lengths: crank, coupler, rocker, distance of the fixed pins.
        mu: coefficient of friction at a sliding velocity.
        angles, rates: of crank, coupler, rocker against x, turning x towards z.
    """
    ahead = [np.array([cos(a), sin(a)]) for a in angles]
    # pins: place on the first link, on the second (None: the ground), as a part of their lengths
    pins = ((0, 0.0, None, 0.0), (1, 0.0, 0, 1.0), (1, 1.0, 2, 1.0), (2, 0.0, None, 0.0))

    def arm(link: int, part: float) -> Array:
        return (part - 0.5) * lengths[link] * ahead[link]

    def spin(link: int | None) -> float:
        return 0.0 if link is None else rates[link]

    N = np.zeros(4)
    x = np.zeros(17)
    for _ in range(200):
        A, b = np.zeros((17, 17)), np.zeros(17)
        for i in range(3):
            m = density * lengths[i]
            A[3 * i, 3 * i] = A[3 * i + 1, 3 * i + 1] = m
            A[3 * i + 2, 3 * i + 2] = m * lengths[i] ** 2 / 12
            b[3 * i + 1] = -m * g
        for k, (one, part, other, far) in enumerate(pins):
            slip = radius * (spin(one) - spin(other))
            moment = -radius * mu(slip) * N[k]
            for link, at, sign in ((one, part, 1.0), (other, far, -1.0)):
                if link is None:
                    continue
                r, column = arm(link, at), 9 + 2 * k
                A[3 * link, column] -= sign
                A[3 * link + 1, column + 1] -= sign
                A[3 * link + 2, column : column + 2] -= sign * np.array([-r[1], r[0]])
                b[3 * link + 2] += sign * moment
                # acceleration of the pin: a + alpha x r - w^2 r
                row = 9 + 2 * k
                A[row, 3 * link] = A[row + 1, 3 * link + 1] = sign
                A[row : row + 2, 3 * link + 2] = sign * np.array([-r[1], r[0]])
                b[row : row + 2] += sign * rates[link] ** 2 * r
        x = np.linalg.solve(A, b)
        N = np.array([size(*f) for f in x[9:].reshape(4, 2)])
    return N, x[[2, 5, 8]]
