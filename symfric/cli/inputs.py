"""Inputs of a scene from the command line: a number, or a column of a CSV file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from symfric import Linear, rate_of
from symfric.cli.options import assignments, numbers
from symfric.foundation import checks
from symfric.foundation.parameters import check_names
from symfric.foundation.tables import Column, read_table
from symfric.integrator import Input
from symfric.integrator.equations.inputs import Sampled
from symfric.model import Model
from symfric.scenes import Scene


@final
@dataclass(frozen=True, eq=False)
class Driven:
    """What drives a scene, from where it starts, and until when it runs.

    Attributes:
        signals: inputs by name.
        told: how people write them.
        start: state -> value.
        until: last time [s].
    """

    signals: dict[str, Input]
    told: dict[str, str]
    start: dict[str, float]
    until: float


def driven(
    scene: Scene,
    model: Model,
    texts: Sequence[str] | None,
    x0: Sequence[str] | None,
    t_end: float | None,
) -> Driven:
    """What texts of --input, --x0 and --t-end mean for a scene.

    An input that is not given is that of the scene. The last time is that of the samples, or the
    one that shows the scene. Samples of a state whose rate is an input (`Scene.integrals`) are that
    input, and say where the state starts.

    Raises:
        ValueError: unknown names, an input beside its integral, or what `input_from_text` refuses.
    """
    given, units = assignments("--input", texts), {v.name: v.unit for v in model.u}
    ways = {state: rate for state, rate in scene.integrals.items() if rate in units}
    units |= {v.name: v.unit for v in model.x if v.name in ways}
    check_names(f"--input of {model.name}", given, units)
    signals: dict[str, Input] = {}
    told, start = dict(given), dict[str, float]()
    for name, text in given.items():
        signal = input_from_text(name, text, units[name])
        if name not in ways:
            signals[name] = signal
            continue
        if ways[name] in given:
            raise ValueError(f"--input: expected {name} or its rate {ways[name]}, got both")
        signals[ways[name]] = rate_of(signal)
        start[name] = float(np.asarray(signal.values)[0] if isinstance(signal, Linear) else signal)  # type: ignore[arg-type]
    for name, own in scene.inputs.items():
        if name not in signals:
            signals[name], told[name] = own.function, own.text
    ends = [float(np.max(s.t)) for s in signals.values() if isinstance(s, Sampled)]
    until = max(ends, default=scene.t_end) if t_end is None else t_end
    return Driven(signals, told, start | numbers("--x0", x0), until)


def input_from_text(name: str, text: str, unit: str) -> Linear | float:
    """The input that `text` means: `2.0`, or `FILE.csv:COLUMN` interpolated linearly over time.

    Args:
        name: of the input.
        text: what stands behind the equals sign.
        unit: SI unit of the input.

    Raises:
        ValueError: neither a finite number nor a column of a readable file.
    """
    try:
        value = float(text)
    except ValueError:
        file, colon, column = text.rpartition(":")
        if not colon or not file or not column:
            raise ValueError(
                f"--input {name}: expected a number or FILE.csv:COLUMN, got '{text}'"
            ) from None
        return read_column(Path(file), column, unit)
    return checks.number(f"--input {name}", value)


def read_column(path: Path, column: str, unit: str) -> Linear:
    """Samples of `column` over the column t of a CSV file.

    Units in the header become SI, as in `symfric identify`; without one the column is in SI.

    Raises:
        ValueError: no such column or two, no column t, a unit of something else, a row that holds
            no numbers, times not increasing.
        OSError: the file cannot be read.
    """
    names = (column, column.partition("[")[0].strip())
    table = read_table(
        path,
        {
            "t": Column(("t", "time", "Time"), "s", assumed=True),
            column: Column(names, unit, assumed=True),
        },
    )
    try:
        return Linear(table.columns["t"], table.columns[column])
    except ValueError as error:
        raise ValueError(f"read '{path.name}': {error}") from None
