"""Every example runs as it stands, headless, from anywhere, and leaves pictures."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))


def period_is_between_those_of_two_laws(printed: str, folder: Path) -> None:
    """Exact Coulomb friction has 6.069995 s."""
    rows = [line.split("│")[1:3] for line in printed.splitlines() if "│" in line]
    period = {name.strip(): float(value) for name, value in rows}
    assert period["LuGre"] < 6.069995 < period["Brown-McPhee"]
    assert period["Brown-McPhee"] - period["LuGre"] < 0.2


def drive_has_learnt_to_stop(printed: str, folder: Path) -> None:
    (_, before), (_, after) = (re.findall(r"(-?\d+\.\d+)", line) for line in printed.splitlines())
    assert float(before) > 20.0
    assert float(after) < 0.5


def drives_get_there_and_the_c_is_verified(printed: str, folder: Path) -> None:
    """Errors below 2 mm under three laws, no failure hidden."""
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in printed.splitlines()]
    rows = [row for row in rows if row]
    assert len(rows) == 3
    assert all(float(row[1].removesuffix(" mm")) < 2.0 for row in rows)
    assert all(row[-1] == "0" for row in rows)
    assert "C: verified" in printed
    assert {path.name for path in (folder / "c").iterdir()} == {"drive_mpc.c", "drive_mpc.h"}


def motion_is_verified(printed: str, folder: Path) -> None:
    """Every solution was simulated, and does what it was asked to."""
    assert "False" not in printed
    assert "True" in printed


def out_and_back_is_the_motion_known_on_paper(printed: str, folder: Path) -> None:
    motion_is_verified(printed, folder)
    assert re.findall(r"slip.", printed) == ["slip+", "slip-"]
    found, exact = map(float, re.findall(r"J = ([\d.]+) .* exact ([\d.]+);", printed)[0])
    assert abs(found - exact) < 1e-3 * exact


def friction_of_each_joint_is_found(printed: str, folder: Path) -> None:
    """Coefficients and payload to 2 %; viscosities hardly matter there."""
    pairs = re.findall(r"^(mu_\w+|payload): ([\d.]+), put in ([\d.]+)", printed, re.M)
    assert len(pairs) == 4
    for name, found, true in pairs:
        assert abs(float(found) / float(true) - 1) < 0.02, name


def told(printed: str, name: str) -> tuple[float, float]:
    """Value and standard error of a parameter in the table of a fit."""
    number = r"(-?[\d.]+(?:e[-+]?\d+)?)"
    value, error = re.findall(rf"^{name} +{number} .*? {number} \(", printed, re.MULTILINE)[-1]
    return float(value), float(error)


def friction_of_the_swings_is_found(printed: str, folder: Path) -> None:
    for name, truth in {"w": 6.1, "c": 0.05, "d": 0.02, "e": 0.03}.items():
        value, error = told(printed, name)
        assert abs(value - truth) < max(5 * error, 0.01 * truth)
    (off,) = re.findall(r"off by ([\d.]+) mrad", printed)
    assert float(off) < 0.6  # a line over the root of 12 is 0.44 mrad


def drive_is_found_in_its_loop(printed: str, folder: Path) -> None:
    """Of the measured drive what the best simulation reaches; of a simulated one the noise."""
    error = re.findall(r"closed loop, other record: x ([\d.]+) %, force ([\d.]+) %", printed)
    measured = "simulated records" not in printed
    assert float(error[0][0]) <= (1.4e-3 if measured else 1e-3)
    assert float(error[0][1]) <= (4.65 if measured else 3.0)
    assert printed.count(" mm\n") == 4


def friction_is_found_in_every_file(printed: str, folder: Path) -> None:
    """Nine formats, one law: every parameter to 3 %, and nothing wrong with the data."""
    rows = [[c.strip() for c in line.split("│")[1:-1]] for line in printed.splitlines()]
    truth, *found = [row for row in rows if row]
    assert len(found) == 9
    for row in found:
        assert row[2] == "nothing", row
        for value, true in zip(row[3:], truth[3:], strict=True):
            assert abs(float(value) / float(true) - 1) < 0.03, row


def memory_explains_more_than_a_bristle(printed: str, folder: Path) -> None:
    """On the second half of the measured record, or of the one that GMS made up."""
    left = dict(re.findall(r"(LuGre|GMS): ([\d.]+) N m on the second half", printed))
    assert float(left["GMS"]) < float(left["LuGre"]) < 0.06


def elements_say_what_another_path_does(printed: str, folder: Path) -> None:
    (share,) = re.findall(r"another path: ([\d.]+) of the noise", printed)
    assert float(share) < 0.5


def optimised_motion_tells_more(printed: str, folder: Path) -> None:
    """Every parameter more surely than by the best sine of the same limits."""
    rows = [line for line in printed.splitlines() if "best sine" in line or "optimised" in line]
    sine, best = ([float(x) for x in re.findall(r"\d+\.\d+", row)] for row in rows)
    assert len(sine) == len(best) == 5
    assert all(b < s for s, b in zip(sine[:4], best[:4], strict=True))
    assert best[4] > sine[4] + 0.3
    assert "SOLVED" in printed or "ACCEPTABLE" in printed


def each_term_makes_the_arm_truer(printed: str, folder: Path) -> None:
    """Friction known beforehand takes nine tenths of what is left, in float."""
    assert "C: verified" in printed
    rms = [float(x) for x in re.findall(r"([\d.]+) mrad", printed)]
    assert rms == sorted(rms, reverse=True)
    assert rms[3] < 0.1 * rms[2]


def compensated_drives_err_less_and_rest(printed: str, folder: Path) -> None:
    """Five times less error on friction that the compensator does not know, and no hunting."""
    assert "C: verified" in printed
    found = re.findall(
        r"RMS error ([\d.]+) times smaller, hunting ([\d.]+) um .*, (.+) um", printed
    )
    assert len(found) == 3
    for smaller, before, after in found:
        assert float(smaller) > 5.0
        assert float(before) > 1000.0
        assert float(after) < 1.0


def unit_does_what_python_does(printed: str, folder: Path) -> None:
    """A jump of the force every millisecond costs one attempt a sample."""
    attempts, difference = re.findall(r"1 kHz: ([\d.]+) .* - Python ([\d.e+-]+) m", printed)[0]
    assert float(attempts) < 1.1
    assert float(difference) < 1e-9
    assert (folder / "drive.fmu").is_file()


def opti_lands_within_a_micrometre(printed: str, folder: Path) -> None:
    iterations, cost, miss = re.findall(
        r"(\d+) iter.* J = ([\d.]+) .*\n.*: ([-+][\d.]+) um,", printed
    )[0]
    assert int(iterations) <= 15
    assert abs(float(cost) - 1.114) < 1e-3
    assert abs(float(miss)) < 1.0


LONG = (
    "arm_to_a_place",
    "co_design",
    "compensate_drive",
    "crank_start_up",
    "identify_arm",
    "identify_emps",
    "identify_excitation",
    "identify_franka",
    "identify_gms",
    "identify_pendulum",
    "identify_raw_files",
    "quarter_car_profile",
    "robot_feed_forward",
    "swing_up",
    "through_a_spring",
)
"""Whole solves of several seconds; `tests/examples/test_motions.py` looks at their problems."""

SAYS = dict.fromkeys(LONG, motion_is_verified) | {
    "identify_emps": drive_is_found_in_its_loop,
    "identify_franka": memory_explains_more_than_a_bristle,
    "identify_gms": elements_say_what_another_path_does,
    "identify_excitation": optimised_motion_tells_more,
    "identify_arm": friction_of_each_joint_is_found,
    "identify_pendulum": friction_of_the_swings_is_found,
    "identify_raw_files": friction_is_found_in_every_file,
    "out_and_back": out_and_back_is_the_motion_known_on_paper,
    "compensate_drive": compensated_drives_err_less_and_rest,
    "mpc_drive": drives_get_there_and_the_c_is_verified,
    "learn_drive": drive_has_learnt_to_stop,
    "drive_unit": unit_does_what_python_does,
    "robot_feed_forward": each_term_makes_the_arm_truer,
    "rabinowicz": period_is_between_those_of_two_laws,
    "opti_lugre": opti_lands_within_a_micrometre,
}


def test_every_check_belongs_to_an_example() -> None:
    assert SAYS.keys() <= {path.stem for path in EXAMPLES}


RUN = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem in LONG))
    for path in EXAMPLES
]


@pytest.mark.parametrize("example", RUN)
def test_example_runs_and_leaves_a_picture(example: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(example), "results"],
        cwd=tmp_path,
        env=os.environ | {"MPLBACKEND": "Agg"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    pictures = list((tmp_path / "results").glob("*.png"))
    assert pictures
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)
    if example.stem in SAYS:
        SAYS[example.stem](done.stdout, tmp_path / "results")


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_short(example: Path) -> None:
    assert len(example.read_text(encoding="utf-8").splitlines()) <= 100
