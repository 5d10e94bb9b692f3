"""Friction of a measured drive from one record, validated by another one with force pulses.

EMPS is a positioning stage with a ball screw whose position controller is known (A. Janot,
M. Gautier, M. Brunot, Nonlinear System Identification Benchmarks 2019). The drive is simulated
under that controller, and the residuals of position and force are minimised. The law is chosen by
its error in the half of the record that is not fitted, as is a fit of its smoothing velocity. A
second fit compares positions under the measured force alone, in windows of 2 s.

Without the data in ../shared/data/EMPS a record is simulated.

    python examples/identify_emps.py [OUT]
"""

import sys
from pathlib import Path

import numpy as np

from identification import ClosedLoop, Dataset, Fit, Fitted, Shooting, synthetic_drive_data
from identification.residuals.initial import local, noise_of
from identification.residuals.shots import sampled_motion
from symfric import Asymmetric, Coulomb, Sum, Viscous
from symfric.foundation.panels import grid, save
from symfric.foundation.style import line

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "data" / "EMPS"
WIDTHS = {"coulomb+viscous": "v_eps", "asymmetric(coulomb+viscous)": "v_eps_pos v_eps_neg"}


def records() -> tuple[Dataset, Dataset]:
    """The measured records, or two simulated ones."""
    files = [FOLDER / name for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")]
    if all(file.is_file() for file in files):
        first, second = (Dataset.read(str(file)) for file in files)
        return first, second
    print("no EMPS data in ../shared/data: simulated records")
    law = Asymmetric(Sum((Coulomb(20.0), Viscous(160.0))), Sum((Coulomb(22.0), Viscous(240.0))))
    return synthetic_drive_data(law), synthetic_drive_data(law, speeds=(0.05, 0.1), seed=1)


def relative(fit: Fitted, data: Dataset) -> dict[str, float]:
    """Signal -> root mean square error under the controller over that of the signal [%]."""
    left = fit.validate(data)
    return {s: 100 * e.rms / np.sqrt(np.mean(data[0][s] ** 2)) for (_, s), e in left.items()}


def closed_loop(data: Dataset) -> Fitted:
    """Fit the law that predicts the second half best to the whole record."""
    first, second = data.split(0.5)
    best, chosen = np.inf, ("", [""])
    for law, widths in WIDTHS.items():
        for free in ([], widths.split()):
            half = Fit(ClosedLoop(), law, first, free=free, starts=1).solve(throw=False)
            error = relative(half, second)["force"]
            print(f"  {law}{', widths fitted' * bool(free)}: {error:.2f} % of the force left out")
            if error < best:
                best, chosen = error, (law, free)
    return Fit(ClosedLoop(), chosen[0], data, free=chosen[1], starts=1).solve(throw=False)


def free_run(fit: Fitted, data: Dataset) -> np.ndarray:
    """Error [m] of the position under the measured force alone, from the measured start."""
    record = data[0]
    t, x = record.time, record["x"]
    begin = local(t, x, 0, noise_of(x))
    p = np.array([v.start for v in fit.model.p], dtype=float)
    start = np.array([begin.value, begin.rate])
    motion = sampled_motion(fit.model, t, record["force"], p, start, hold="held")
    return np.full(t.size, np.nan) if isinstance(motion, str) else motion.states[:, 0] - x


def main(out: Path) -> None:
    """Fit, validate and draw."""
    data, other = records()
    loop = closed_loop(data)
    print(loop)
    for name, where in (("fitted", data), ("other", other)):
        error = relative(loop, where)
        print(f"closed loop, {name} record: x {error['x']:.5f} %, force {error['force']:.2f} %")
    kind = Shooting(["x"], windows=2.0, interpolation="hold", every=10, engine="sampled")
    windows = Fit(kind, loop.name, data, starts=1).solve(throw=False)
    print(*[f"  {text}" for text in windows.verdict.sentences], sep="\n")
    figure, (axes,) = grid(1, 2, 9.0, 3.0, sharey=True)
    for ax, name, where in zip(axes, ("fitted", "other"), (data, other), strict=True):
        for k, (label, fit) in enumerate((("closed loop", loop), ("windows of 2 s", windows))):
            error = 1e3 * free_run(fit, where)
            ax.plot(where[0].time, error, label=label, **line(k))
            rms = np.sqrt(np.mean(error[20:] ** 2))
            print(f"open loop, {name} record, fitted by {label}: {rms:.2f} mm")
        ax.set(xlabel="t [s]", title=f"{name} record")
    axes[0].set_ylabel("error of the free run [mm]")
    axes[0].legend()
    save(figure, out / "identify_emps.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
