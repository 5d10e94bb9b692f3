"""A mode is a whole number in every result: signals, extremes, tables, files and ensembles."""

from pathlib import Path

import numpy as np
import pytest

from symfric import ExactCoulomb, Model, rabinowicz, simulate, simulate_many
from symfric.laws import MaxwellSlip
from symfric.model.kinds import MODE
from symfric.scenes import FourMass

MODEL: dict[str, Model] = {
    "exact": rabinowicz(ExactCoulomb()),
    "maxwell": rabinowicz(MaxwellSlip(form="event")),
    "loops": FourMass(ExactCoulomb()).model(),
}


def modes(model: Model) -> list[str]:
    return [v.name for v in model.x if v.kind == MODE]


def whole(values: object) -> bool:
    return set(np.unique(np.asarray(values, dtype=float))) <= {-1.0, 0.0, 1.0}


@pytest.mark.parametrize("name", MODEL)
def test_modes_of_a_run_are_whole_numbers_everywhere(name: str, tmp_path: Path) -> None:
    model = MODEL[name]
    run = simulate(model, 3.0 if name == "loops" else 8.0, rtol=1e-6)
    direction = name == "loops" and "x1_loop_direction" not in modes(model)
    assert modes(model) and not direction, "the law has modes"
    between = run.at(np.linspace(*run.span, 3001))
    looked = [run.at_looks(mode) for mode in modes(model)]
    assert any(np.unique(values).size > 1 for values in looked), "one of them jumps"
    for mode, seen in zip(modes(model), looked, strict=True):
        for values in (run[mode], run.signals[mode], between[mode], run.extremes[mode], seen):
            assert whole(values), mode
        assert whole(run.final[mode])
    table = str(run).splitlines()
    for mode in modes(model):
        (row,) = [line for line in table if line.split()[:1] == [mode]]
        assert {float(x) for x in row.split()[2:]} <= {-1.0, 0.0, 1.0}
        assert "-0 " not in row
    file = tmp_path / "run.csv"
    run.to_csv(file)
    head, *rows = file.read_text().splitlines()
    columns = [i for i, title in enumerate(head.split(",")) if title.split(" ")[0] in modes(model)]
    assert len(columns) == len(modes(model))
    assert whole([[row.split(",")[i] for i in columns] for row in rows])


def test_what_error_control_adds_to_a_mode_is_there_in_the_states() -> None:
    """Without it the rounding would have nothing to do."""
    run = simulate(MODEL["exact"], 8.0, method="dopri5", rtol=1e-6)
    mode = MODEL["exact"].x[2]
    raw = run.of(mode.symbol, run.looks)
    assert 0 < np.abs(raw - np.round(raw)).max() < 1e-3


@pytest.mark.parametrize("times", [None, np.linspace(0.0, 8.0, 41)])
def test_modes_of_an_ensemble_are_whole_numbers(times: np.ndarray | None) -> None:
    starts, how = {"x": np.linspace(0.0, 0.3, 3)}, {"method": "dopri5", "backend": "vm"}
    study = simulate_many(MODEL["exact"], 8.0, t_eval=times, x0=starts, **how)
    assert whole(study.signals["mode"])
    assert whole(study.extremes["mode"])
