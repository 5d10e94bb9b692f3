"""Friction from nine typical files of recorders, each read in at most five lines.

One shaft is simulated, J = 0.01 kg m^2 with Stribeck friction of 0.3 and 0.2 N m, and written in
different formats: rotary units, columns separated by spaces without a header, decimal commas below
title lines, structs of MATLAB, a vector without times, a staircase of speeds, and two recorders
with clocks that differ by 0.8137 s.

    python examples/identify_raw_files.py [OUT]
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.io import savemat

from identification import Dataset, Fit, InverseDynamics, Points, synthetic_drive_data
from symfric.laws import Stribeck

LAW = Stribeck(mu_s=0.3, mu_d=0.2, v_s=1.0, v_eps=0.005, sigma_2=0.01)
SHIFT = 0.8137


def write(folder: Path) -> None:
    """Write nine files of one motion at 1 kHz."""
    data = synthetic_drive_data(
        LAW, turning=True, m=0.01, offset=0.0, speeds=(0.5, 1.5, 5.0, 10.0),
        position_noise=1e-6, force_noise=1e-3, dwell=0.4,
    )  # fmt: skip
    t, x, tau = (data[0][key] for key in ("t", "x", "force"))
    table = np.column_stack([t, x, tau])
    np.savetxt(folder / "spaces.txt", table, fmt="%.9f")
    np.savetxt(
        folder / "unnamed.csv", table, "%.9f", ",", header="time,position,torque", comments=""
    )
    degrees = np.column_stack([1e3 * t, np.rad2deg(x), 1e3 * tau])
    lines = ["Recorder 7;rig 3", "", "Zeit;Winkel;Moment", "ms;deg;mN m"]
    lines += [";".join(f"{y:.7f}" for y in row).replace(".", ",") for row in degrees]
    (folder / "commas.csv").write_text("\n".join(lines))
    halves = (table[:4000], table[4000:])
    runs = [dict(zip(("time", "q", "tau"), half.T, strict=True)) for half in halves]
    savemat(folder / "struct.mat", {"rig": {"runs": np.array(runs, dtype=object)}})
    savemat(folder / "matrix.mat", {"log": table.T})
    np.savez(folder / "no_time.npz", y=x, u=tau)
    units = {"torque": "N m", "turns": "rev"}
    Dataset.of(t=t, torque=tau, turns=x / 2 / np.pi, units=units).to_csv(folder / "motor.csv")
    fine = np.arange(t[0], t[-1], 7e-4)
    Dataset.of(t=fine - SHIFT, x=np.interp(fine, t, x), units="rad").to_csv(folder / "bench.csv")
    v = np.geomspace(0.1, 10, 15)
    v, hold = np.concatenate([-v[::-1], v]), np.ones(50)
    F = np.sign(v) * (0.2 + 0.1 * np.exp(-(v**2))) + 0.01 * v
    np.savetxt(folder / "sweep.csv", np.column_stack([v * 30 / np.pi, F]), delimiter=";")
    stairs = np.column_stack([0.02 * np.arange(1500), np.kron(v, hold), np.kron(F, hold)])
    np.savetxt(folder / "stairs.tsv", stairs, delimiter="\t", header="time\tomega\ttorque")


def read(at: Path) -> dict[str, Callable[[], Dataset]]:
    """Read each file."""
    names, units = ["t", "x", "force"], "rad, N m"
    german = {"t": "Zeit", "x": "Winkel", "force": "Moment"}
    return {
        "columns of spaces": lambda: Dataset.read(at / "spaces.txt", columns=names, units=units),
        "header without units": lambda: Dataset.read(at / "unnamed.csv", units=units),
        "decimal commas, row of units": lambda: Dataset.read(at / "commas.csv", columns=german),
        "vector of structs": lambda: Dataset.read(at / "struct.mat", units=units),
        "matrix on its side": lambda: Dataset.read(at / "matrix.mat", columns=names, units=units),
        "vectors without times": lambda: Dataset.read(
            at / "no_time.npz", columns={"x": "y", "force": "u"}, units=units, step=1e-3
        ),
        "two recorders": lambda: Dataset.read(at / "motor.csv").merged(
            Dataset.read(at / "bench.csv"), on=("turns", "x")
        ),
        "points in rpm": lambda: Dataset.read(
            at / "sweep.csv", columns=["v", "F"], units="rpm, N m", points=True
        ),
        "staircase of speeds": lambda: Dataset.read(at / "stairs.tsv", units="rad/s, N m"),
    }


def main(out: Path) -> None:
    """Write, read, check and fit; print every file with the true values."""
    out.mkdir(parents=True, exist_ok=True)
    write(out)
    result = Table("file", "records", "found in the data", "mu_s", "mu_d", "v_s", "sigma_2")
    result.add_row("truth", "", "", "0.3", "0.2", "1", "0.01")
    for name, data in ((name, reader()) for name, reader in read(out).items()):
        kind = InverseDynamics() if "x" in data[0] else Points(F=list(data[0].signals)[-1])
        fit = Fit(kind, "stribeck", data).solve()
        told = [f"{fit.values[p]:.4g}" for p in ("mu_s", "mu_d", "v_s", "sigma_2")]
        result.add_row(name, str(len(data)), ", ".join(data.check().kinds) or "nothing", *told)
        if name == "two recorders":
            fit.plot(out / "identify_raw_files.png")
    Console(width=120).print(result)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
