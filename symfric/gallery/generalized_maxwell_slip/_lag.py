"""How the force of a contact answers a velocity that rises and falls."""

import numpy as np

from symfric import GenericAsperity

POINTS = 1600
"""Samples a period."""


def slid(model: GenericAsperity, frequency: float, periods: int) -> tuple[np.ndarray, ...]:
    """Time, velocity, force, its rate and the steady force over the mean period."""
    t = np.arange(periods * POINTS + 1) / POINTS / frequency
    turn = 2 * np.pi * frequency
    x = 250e-6 * t - 240e-6 * np.sin(turn * t) / turn
    F = model.force(t, x, 1.0)[2 * POINTS : -1].reshape(-1, POINTS).mean(axis=0)
    waves = np.fft.rfft(F)
    waves[25:] = 0.0  # what is left beyond is the scatter of the asperities
    rate = np.fft.irfft(1j * turn * np.arange(waves.size) * waves, POINTS)
    t = t[:POINTS]
    v = 250e-6 - 240e-6 * np.cos(turn * t)
    return t, v, np.fft.irfft(waves, POINTS), rate, model.steady_force(v, 1.0)


def explained(X: np.ndarray, rate: np.ndarray) -> tuple[float, float]:
    """The best factor k in rate = k X, and which share of the rate it explains."""
    k = float(X @ rate / (X @ X))
    return k, float(1 - np.sum((rate - k * X) ** 2) / np.sum(rate**2))


def faster(model: GenericAsperity) -> dict[str, float]:
    """What explains the rate of the force where the velocity changes eight times as fast."""
    _, v, force, rate, s = slid(model, 2.0, 4)
    powers = {"C/|v|": 0.0, "|v|^(-1/2)": 0.5, "a constant h": 1.0}
    return {
        f"share of dF/dt explained at 2 Hz by {name} [1]": explained(
            v**power * (1 - force / s), rate
        )[1]
        for name, power in powers.items()
    }
