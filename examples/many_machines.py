"""Peak displacement of a hundred million machines whose friction is uncertain.

A block on a belt with Brown-McPhee friction; mu_d, mu_s - mu_d and the speed of the belt are
random. The machines are simulated in blocks. Each block is reduced to counts and extremes over the
speed of the belt, which are a few kilobytes, so neither the memory nor the disk limits the number.
Blocks are stored as they finish, and stored blocks are not repeated. The random numbers of a block
depend on its size and number only, so the result does not depend on the number of workers.

    python examples/many_machines.py OUT --blocks 0:1000 --members 100000   # 10^8, all cores
    python examples/many_machines.py OUT --scheduler tcp://head:8786        # a Dask cluster

`docs/howto/cluster.md` shows Dask, Slurm and Ray.
"""

import argparse
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from symfric import BrownMcPhee, rabinowicz, simulate_many

SPEEDS = np.linspace(0.02, 0.2, 19)  # m/s, edges of the bins
PEAKS = np.linspace(0.0, 3.0, 301)  # m


def block(number: int, members: int) -> dict[str, Any]:
    """Simulate the machines of one block and return counts and extremes over the speed."""
    draw = np.random.default_rng([members, number])
    mu_d, rise = draw.uniform(0.05, 0.15, members), draw.uniform(0.0, 0.1, members)
    speed = draw.uniform(SPEEDS[0], SPEEDS[-1], members)
    model = rabinowicz(BrownMcPhee(), free=["mu_s", "mu_d", "v_belt"])
    p = {"mu_s": mu_d + rise, "mu_d": mu_d, "v_belt": speed}
    peak = simulate_many(model, 20.0, p=p, rtol=1e-5, executor="serial").extremes["x"][1]
    counts = np.histogram2d(speed, peak, (SPEEDS, PEAKS))[0]
    of_bin = np.digitize(speed, SPEEDS[1:-1])
    greatest = np.zeros(len(SPEEDS) - 1)
    np.fmax.at(greatest, of_bin, peak)
    return {"counts": counts.astype(np.int64), "greatest": greatest, "members": np.array(members)}


def run(out: Path, numbers: range, members: int, executor: Executor) -> None:
    """Simulate the blocks that are not stored yet."""
    out.mkdir(parents=True, exist_ok=True)
    paths = {n: out / f"{members}_{n:06d}.npz" for n in numbers}
    left = {executor.submit(block, n, members): n for n in numbers if not paths[n].exists()}
    start = perf_counter()
    for done, future in enumerate(as_completed(left), 1):
        part = paths[left[future]].with_suffix(".part")
        with part.open("wb") as file:
            np.savez_compressed(file, **future.result())
        part.rename(paths[left[future]])
        speed = done * members / (perf_counter() - start)
        print(f"{done} of {len(left)} blocks, {speed:.0f} machines per second", flush=True)


def show(out: Path) -> None:
    """Print and plot the quantiles of the peak over the speed, from all stored blocks."""
    parts: list[Any] = [np.load(path) for path in sorted(out.glob("*.npz"))]
    counts = np.sum([part["counts"] for part in parts], axis=0)
    share = np.cumsum(counts, axis=1) / counts.sum(axis=1, keepdims=True)
    middle = (SPEEDS[1:] + SPEEDS[:-1]) / 2
    figure, axes = plt.subplots(layout="constrained")
    for level in (0.05, 0.5, 0.95):
        quantile = PEAKS[1 + (share >= level).argmax(axis=1)]
        axes.plot(middle, quantile, label=f"{100 * level:g} % of the machines are below")
    axes.plot(middle, np.max([part["greatest"] for part in parts], axis=0), label="largest")
    axes.set(xlabel="speed of the belt [m/s]", ylabel="peak displacement [m]")
    figure.legend(loc="outside upper center", ncols=2)
    figure.savefig(out / "peaks.png")
    total = sum(int(part["members"]) for part in parts)
    print(f"{total} machines in {len(parts)} blocks, {counts.sum()} within the range of the bins")


def main() -> None:
    """Read the command line, simulate and show."""
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--blocks", default="0:4", help="first and one past the last block")
    parser.add_argument("--members", type=int, default=10_000, help="machines per block")
    parser.add_argument("--scheduler", help="address of a Dask scheduler; default: all cores")
    given = parser.parse_args()
    first, last = map(int, given.blocks.split(":"))
    if given.scheduler:
        distributed: Any = import_module("distributed")  # extra: pip install symfric[cluster]
        executor = distributed.Client(given.scheduler).get_executor()
    else:
        executor = ProcessPoolExecutor(mp_context=get_context("spawn"))
    with executor:
        run(given.out, range(first, last), given.members, executor)
    show(given.out)


if __name__ == "__main__":
    main()
