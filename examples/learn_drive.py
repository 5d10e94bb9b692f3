"""Policy search for a drive with stick-slip, with the interface of Gymnasium.

    mass 0.8 kg on a surface with LuGre friction, force of up to 3 N, held for 20 ms at a time;
    reward - |error| - 1e-3 force^2, 1 s an episode, a new start, target and mass for each

With friction, the mass of a PD controller stops before its target. A random search finds the four
gains of `policy`; all candidates of a round, with eight episodes each, run in one batch of plants.

    python examples/learn_drive.py [OUT]
"""

import sys
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric import LuGre, drive, stepper
from symfric.foundation.panels import grid, save
from symfric.foundation.style import COLOURS

Array = NDArray[np.float64]
DT, STEPS, CANDIDATES, EPISODES, ROUNDS = 0.02, 50, 32, 8, 15


@final
class StickSlipDrive:
    """Observations (error [m], velocity [m/s], integral of the error [m s]); actions in -1 ... 1.

    `envs` drives run together, as in a Gymnasium vector environment; arrays have a row for each.
    """

    def __init__(self, envs: int) -> None:
        model = drive(LuGre(sigma_0=1e4, sigma_1=50.0), free=["m"])
        self.envs, self.plant = envs, stepper(model, DT, rtol=1e-5, batch=envs)

    def reset(self, seed: int) -> tuple[Array, dict[str, Any]]:
        """Draw starts, targets and masses from a seed."""
        rng = np.random.default_rng(seed)
        mass, start = rng.uniform(0.7, 0.9, self.envs), rng.uniform(-0.05, 0.05, self.envs)
        self.target, self.integral, self.count = rng.uniform(-0.05, 0.05, self.envs), 0.0, 0
        return self._observed(self.plant.reset({"x": start}, {"m": mass})), {"mass": mass}

    def step(self, action: Array) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """Hold forces of 3 N `action`; return observation, reward, terminated, truncated, info."""
        force, self.count = 3.0 * np.clip(action, -1.0, 1.0), self.count + 1
        seen = self._observed(self.plant.step(force[:, None]))
        reward = -np.abs(seen[:, 0]) - 1e-3 * force**2
        late = np.full(self.envs, self.count == STEPS)
        return seen, reward, np.zeros_like(late), late, {"t": self.plant.t}

    def _observed(self, x: Array) -> Array:
        error = self.target - x[:, 0]
        self.integral = self.integral + DT * error
        return np.column_stack([error, x[:, 1], self.integral])


def policy(k: Array, seen: Array) -> Array:
    """Return the action: linear, plus a term with the sign of the error."""
    return (k * np.hstack([seen, seen[:, :1] / (np.abs(seen[:, :1]) + 2e-3)])).sum(axis=1)


def episode(env: StickSlipDrive, k: Array, seed: int) -> tuple[Array, Array]:
    """Return the reward of an episode and the errors of each drive, shape (steps, drives)."""
    seen, _ = env.reset(seed)
    total, errors = np.zeros(env.envs), [seen[:, 0]]
    while len(errors) <= STEPS:
        seen, reward, *_ = env.step(policy(k, seen))
        total, errors = total + reward, [*errors, seen[:, 0]]
    return total, np.array(errors)


def main(out: Path) -> None:
    """Search, print and draw rewards and errors."""
    env, rng = StickSlipDrive(CANDIDATES * EPISODES), np.random.default_rng(0)
    best, spread = np.array([5.0, -1.0, 0.0, 0.0]), np.array([20.0, 2.0, 20.0, 0.5])
    before, learnt = episode(env, np.tile(best, (env.envs, 1)), 99), list[float]()
    for k in range(ROUNDS):
        tried = best + spread * rng.normal(size=(CANDIDATES, 4)) * 0.9**k
        tried[0] = best
        score = episode(env, np.repeat(tried, EPISODES, axis=0), k)[0].reshape(CANDIDATES, -1)
        best = tried[np.argmax(score.mean(axis=1))]
        learnt.append(score.mean(axis=1).max())
    after = episode(env, np.tile(best, (env.envs, 1)), 99)
    figure, ((left, middle, right),) = grid(1, 3, width=10, height=3)
    left.plot(learnt, "o-")
    left.set(xlabel="round", ylabel="best reward")
    for axes, title, (total, errors) in ((middle, "before", before), (right, "after", after)):
        last = 1e3 * np.median(np.abs(errors[-1]))
        print(f"{title}: reward {total.mean():.2f}, median error after 1 s {last:.2f} mm")
        axes.plot(DT * np.arange(STEPS + 1), 1e3 * errors[:, :40], color=COLOURS[0], alpha=0.3)
        axes.set(xlabel="t [s]", ylabel="error [mm]", title=title, ylim=(-100, 100))
    save(figure, out / "learn_drive.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
