"""Every example runs unchanged, headless, from anywhere, and writes pictures."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
NUMBER = r"(-?[\d.]+(?:e[-+]?\d+)?)"


def numbers(pattern: str, printed: str) -> np.ndarray:
    """Numbers of the groups of `pattern`, a row for each match."""
    return np.array([np.ravel(found) for found in re.findall(pattern, printed, re.M)], float)


def table(printed: str) -> list[list[str]]:
    """Cells of the rows of a printed table."""
    return [[c.strip() for c in r.split("│")[1:-1]] for r in printed.splitlines() if "│" in r]


def motion_is_verified(printed: str) -> bool:
    """Every solution was simulated, and is accepted."""
    return "False" not in printed and "True" in printed


def mpc_drive(printed: str) -> bool:
    """Errors below 2 mm under three laws, no failure hidden."""
    rows = table(printed)
    near = all(float(row[1].removesuffix(" mm")) < 2.0 and row[-1] == "0" for row in rows)
    return near and len(rows) == 3 and "C: verified" in printed


def hardware_in_the_loop(printed: str) -> bool:
    """Cycles of some microseconds, and errors of the plant below those of the controller."""
    if "expected Linux" in printed:
        return True
    cycle, error, plant = (
        numbers(rf"{what}: ([\d.]+) u[ms]", printed).item()
        for what in ("cycle", "tracking error after 0.5 s", "error of the plant")
    )
    return 0 < cycle < 1000 and 0.1 < error < 500 and plant < 0.1


def out_and_back(printed: str) -> bool:
    ((found, exact),) = numbers(r"J = ([\d.]+) .* exact ([\d.]+);", printed)
    known = abs(found - exact) < 1e-3 * exact
    return known and re.findall(r"slip.", printed) == ["slip+", "slip-"]


def identify_arm(printed: str) -> bool:
    """Coefficients and payload to 2 %; viscosities hardly matter there."""
    found, true = numbers(r"^(?:mu_\w+|payload): ([\d.]+), put in ([\d.]+)", printed).T
    return found.size == 4 and bool((np.abs(found / true - 1) < 0.02).all())


def identify_pendulum(printed: str) -> bool:
    """Within five standard errors; a line over the root of 12 is 0.44 mrad."""
    for name, truth in {"w": 6.1, "c": 0.05, "d": 0.02, "e": 0.03}.items():
        value, error = numbers(rf"^{name} +{NUMBER} .*? {NUMBER} \(", printed)[-1]
        assert abs(value - truth) < max(5 * error, 0.01 * truth)
    return numbers(r"off by ([\d.]+) mrad", printed).item() < 0.6


def identify_emps(printed: str) -> bool:
    """Of the measured drive what the best simulation reaches; of a simulated one the noise."""
    most = (1e-3, 3.0) if "simulated records" in printed else (1.4e-3, 4.65)
    error = numbers(r"closed loop, other record: x ([\d.]+) %, force ([\d.]+) %", printed)[0]
    return bool((error <= most).all()) and printed.count(" mm\n") == 4


def identify_raw_files(printed: str) -> bool:
    """Nine formats, one law: every parameter to 3 %, and no finding in the data."""
    truth, *found = table(printed)
    ratios = np.array([row[3:] for row in found], float) / np.array(truth[3:], float)
    assert [row[2] for row in found] == ["nothing"] * 9
    return bool((np.abs(ratios - 1) < 0.03).all())


def identify_franka(printed: str) -> bool:
    """On the second half of the measured record, or of one simulated with GMS."""
    left = dict(re.findall(r"(LuGre|GMS): ([\d.]+) N m on the second half", printed))
    return float(left["GMS"]) < float(left["LuGre"]) < 0.06


def identify_excitation(printed: str) -> bool:
    """Every parameter with a smaller error than by the best sine within the same limits."""
    rows = [line for line in printed.splitlines() if "best sine" in line or "optimised" in line]
    sine, best = (numbers(r"(\d+\.\d+)", row).ravel() for row in rows)
    better = bool((best[:4] < sine[:4]).all()) and best[4] > sine[4] + 0.3
    return better and ("SOLVED" in printed or "ACCEPTABLE" in printed)


def robot_feed_forward(printed: str) -> bool:
    """Friction known beforehand removes nine tenths of the error that is left, in float."""
    rms = numbers(r"([\d.]+) mrad", printed).ravel()
    return "C: verified" in printed and (np.diff(rms) <= 0).all() and rms[3] < 0.1 * rms[2]


def compensate_drive(printed: str) -> bool:
    """Five times less error on friction that the compensator does not know, and no hunting."""
    pattern = r"RMS error ([\d.]+) times smaller, hunting ([\d.]+) um .*, (.+) um"
    smaller, before, after = numbers(pattern, printed).T
    assert (smaller.size, smaller.min() > 5.0) == (3, True)
    return "C: verified" in printed and before.min() > 1000.0 and after.max() < 1.0


def adapt_drive(printed: str) -> bool:
    """Within 1.5 times the error with the true levels, in Python and in C; fixed levels are not."""
    ratios = numbers(r"(?:squares|filter|all in C): ([\d.]+)", printed).ravel()
    fixed = numbers(r"fixed levels:? (?:RMS error )?([\d.]+)", printed).ravel()
    return ratios.size == 3 and ratios.max() < 1.5 and fixed.size == 2 and fixed.min() > 3.0


def rabinowicz(printed: str) -> bool:
    """Exact Coulomb friction has a period of 6.069995 s."""
    period = {row[0]: float(row[1]) for row in table(printed)}
    exact = period["LuGre"] < 6.069995 < period["Brown-McPhee"]
    return exact and period["Brown-McPhee"] - period["LuGre"] < 0.2


def learn_drive(printed: str) -> bool:
    (_, before), (_, after) = (numbers(r"(-?\d+\.\d+)", line) for line in printed.splitlines())
    return before.item() > 20.0 and after.item() < 0.5


def drive_unit(printed: str) -> bool:
    """A jump of the force every millisecond costs one attempt a sample."""
    attempts, difference = numbers(r"1 kHz: ([\d.]+) .* - Python ([\d.e+-]+) m", printed)[0]
    return attempts < 1.1 and difference < 1e-9


def opti_lugre(printed: str) -> bool:
    pattern = r"(\d+) iter.* J = ([\d.]+) .*\n.*: ([-+][\d.]+) um,"
    iterations, cost, miss = numbers(pattern, printed)[0]
    return iterations <= 15 and abs(cost - 1.114) < 1e-3 and abs(miss) < 1.0


def hunting_drive(printed: str) -> bool:
    """The axis hunts below the fold and rests above it."""
    below, above = numbers(r"N s/m: ([\d.]+) mm", printed).ravel()
    return 10 < below < 30 and above == 0 and "k_d = 9.12344" in printed


def many_machines(printed: str) -> bool:
    return printed.endswith("40000 machines in 4 blocks, 40000 within the range of the bins\n")


LONG = {
    *("adapt_drive", "arm_to_a_place", "co_design", "compensate_drive", "crank_start_up"),
    *("identify_arm", "identify_emps", "identify_excitation", "identify_franka", "identify_gms"),
    *("identify_pendulum", "identify_raw_files", "quarter_car_profile", "robot_feed_forward"),
    *("swing_up", "through_a_spring"),
}
"""Whole solves of several seconds; `tests/examples/test_motions.py` checks their problems."""

SLOW = LONG | {
    *("hardware_in_the_loop", "hunting_drive", "learn_drive", "many_machines", "mpc_drive"),
    *("out_and_back", "press"),
}
CHECKS = dict.fromkeys(LONG, motion_is_verified) | {
    check.__name__: check
    for check in (
        *(mpc_drive, out_and_back, identify_arm, identify_pendulum, identify_emps, opti_lugre),
        *(identify_raw_files, identify_franka, identify_excitation, robot_feed_forward),
        *(adapt_drive, compensate_drive, rabinowicz, learn_drive, drive_unit, hunting_drive),
        *(hardware_in_the_loop, many_machines),
    )
}
CHECKS["out_and_back"] = lambda text: motion_is_verified(text) and out_and_back(text)
CHECKS["identify_gms"] = lambda text: (
    numbers(r"another path: ([\d.]+) of the noise", text).item() < 0.5
)
FILES = {"mpc_drive": {"c/drive_mpc.c", "c/drive_mpc.h"}, "drive_unit": {"drive.fmu"}}


def test_every_check_belongs_to_an_example() -> None:
    assert CHECKS.keys() | FILES.keys() <= {path.stem for path in EXAMPLES}


@pytest.mark.parametrize(
    "example",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem in SLOW))
        for path in EXAMPLES
    ],
)
def test_example_runs_and_leaves_a_picture(example: Path, tmp_path: Path) -> None:
    assert len(example.read_text(encoding="utf-8").splitlines()) <= 100
    done = subprocess.run(
        [sys.executable, "-W", "error", str(example), "results"], cwd=tmp_path,
        env=os.environ | {"MPLBACKEND": "Agg"}, stdin=subprocess.DEVNULL, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    pictures = list((tmp_path / "results").glob("*.png"))
    assert pictures
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)
    assert CHECKS.get(example.stem, bool)(done.stdout)
    assert all((tmp_path / "results" / name).is_file() for name in FILES.get(example.stem, ()))
