"""What a campaign draws is the same everywhere, and a file gives it back."""

import json
from pathlib import Path

import pytest

from symfric.stress import Case, Signal, draw
from symfric.stress.cases import Draws
from symfric.stress.problem import problem, signal


def test_draws_are_the_same_in_every_version() -> None:
    rng = Draws(1, 2)
    assert (rng.unit(), rng.decade(-2, 2), rng.pick("abc")) == FIRST


FIRST = (0.08841827389941048, 19.5, "b")


def test_a_case_is_the_same_on_every_machine() -> None:
    assert draw(1, 85).to_dict() == draw(1, 85).to_dict()
    assert draw(1, 85) != draw(2, 85)
    assert json.loads(json.dumps(draw(1, 3).to_dict()))["seed"] == 1


def test_cases_differ_in_everything_that_is_drawn() -> None:
    cases = [draw(1, n) for n in range(150)]
    for name, least in (("scene", 10), ("law", 45), ("method", 6), ("rtol", 7), ("t_end", 100)):
        assert len({getattr(case, name) for case in cases}) >= least, name
    kinds = {s.kind for case in cases for s in case.inputs.values()}
    assert kinds == {"constant", "hold", "linear", "sine", "pulse"}
    for name in ("values", "forms", "free", "x0"):
        assert any(getattr(case, name) for case in cases), name


def test_a_file_gives_the_case_back(tmp_path: Path) -> None:
    for n in range(40):
        draw(3, n).write(tmp_path / "case.json")
        assert Case.read(tmp_path / "case.json") == draw(3, n)
    beside = {"case": draw(3, 4).to_dict(), "verdict": {"kind": "silent"}}
    (tmp_path / "case.json").write_text(json.dumps(beside))
    assert Case.read(tmp_path / "case.json") == draw(3, 4)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "expected JSON of a case"),
        ("[1]", "expected JSON of a case, got something else"),
        ('{"seed": 1}', "case '.*case.json': expected fields among"),
        ('{"case": [1]}', "case '.*case.json': expected JSON of a case, got something else"),
        ('{"seed": 1, "number": 2, "scene": "drive", "law": "dahl", "x": 1}', "expected fields"),
        (
            '{"seed": 1, "number": 2, "scene": "drive", "law": "dahl", "inputs": {"force": 1}}',
            "case '.*case.json': expected what `symfric stress` wrote",
        ),
    ],
)
def test_a_file_of_something_else_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "case.json").write_text(text)
    with pytest.raises(ValueError, match=message):
        Case.read(tmp_path / "case.json")


def test_parameters_given_at_run_time_are_not_in_the_equations() -> None:
    case = Case(1, 0, "rabinowicz", "stribeck", {"mu_s": 0.2, "m": 2.0}, free=("mu_s",))
    ready = problem(case)
    assert [v.name for v in ready.model.p] == ["mu_s"]
    assert ready.p == {"mu_s": 0.2}


def test_an_unknown_signal_is_refused() -> None:
    with pytest.raises(ValueError, match="expected a signal constant, hold"):
        signal(Signal("noise", (1.0, 2.0, 3.0)))
