"""Damaged and hostile files run no code and are refused in one sentence."""

import random
import resource
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from hostile import audit, hostile, nothing_runs
from phases import solve_once, there_and_back

import ocp
from identification import Fit, InverseDynamics, load_fit, synthetic_drive_data
from ocp.transcription.schemes import Legendre
from symfric import load_ensemble, load_run
from symfric.integrator import simulate, simulate_many
from symfric.laws import LuGre
from symfric.scenes import rabinowicz

MOST = 3e8
"""Memory [bytes] by which a process may grow; files are below a megabyte and promise up to 2^63."""


@dataclass(frozen=True)
class Kind:
    """A kind of file: a good one, what reads it, and what a user asks of it."""

    good: bytes
    read: Callable[[Path], Any]
    use: Callable[[Any], object]


def _saved(thing: Any, folder: Path) -> bytes:
    thing.save(folder / "good.npz")
    return (folder / "good.npz").read_bytes()


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> list[Kind]:
    folder = tmp_path_factory.mktemp("good")
    model = rabinowicz(LuGre(), free=["mu_s"])
    run = simulate(model, 1.0, samples=11, sensitivities=["mu_s"])
    many = simulate_many(rabinowicz(LuGre(), free=["m"]), 0.2, p={"m": [1.0, 2.0]}, backend="vm")
    data = synthetic_drive_data(seed=1, rate=250.0)
    fit = Fit(InverseDynamics(), "coulomb", data, starts=1)
    solved = solve_once(there_and_back(), [3, 3], Legendre(2))
    solved = replace(solved, verification=ocp.verify(solved))
    return [
        Kind(
            _saved(run, folder), load_run, lambda r: (r.signals, r.at([0.3]), r.to_dict(), str(r))
        ),
        Kind(_saved(many, folder), load_ensemble, lambda r: (dict(r.signals), repr(r))),
        Kind(_saved(fit.solve(throw=False), folder), load_fit, str),
        Kind(_saved(solved, folder), ocp.load, lambda s: (str(s), s.to_dict())),
    ]


def _campaign(kinds: list[Kind], seed: int, files: int, folder: Path) -> int:
    """Read hostile files of all kinds and return how many were refused; the others load."""
    dice, refused, path = random.Random(seed), 0, folder / "hostile.npz"
    sys.addaudithook(audit)
    for kind in kinds:  # so that all modules are imported
        path.write_bytes(kind.good)
        kind.use(kind.read(path))
    before = _memory()
    for number in range(files):
        kind = kinds[number % len(kinds)]
        path.write_bytes(hostile(kind.good, dice))
        seen = list[str]()
        try:
            with nothing_runs(seen):
                loaded = kind.read(path)
        except ValueError as error:
            refused += 1
            assert len(str(error).splitlines()) == 1
        except BaseException as error:
            error.add_note(f"seed {seed}, file {number}")
            raise
        else:
            kind.use(loaded)
        assert not seen, (seed, number, seen)
    assert _memory() - before < MOST
    return refused


def _memory() -> float:
    """Largest memory of this process so far [bytes]."""
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def test_hostile_files_end_in_a_sentence(kinds: list[Kind], tmp_path: Path) -> None:
    assert _campaign(kinds, 1, 60, tmp_path) > 40


@pytest.mark.slow
def test_ten_thousand_hostile_files(kinds: list[Kind], tmp_path: Path) -> None:
    for seed in range(2, 7):
        assert _campaign(kinds, seed, 2000, tmp_path) > 1400
