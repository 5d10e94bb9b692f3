"""Inputs of a scene from the command line: a number, or a column of a CSV file."""

import csv
from pathlib import Path

from symfric import Linear
from symfric.foundation import checks
from symfric.foundation.parameters import check_names
from symfric.integrator import Input


def input_from_text(name: str, text: str) -> Input:
    """The input that `text` means: `2.0`, or `FILE.csv:COLUMN` interpolated linearly over time.

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
        return read_column(Path(file), column)
    return checks.number(f"--input {name}", value)


def read_column(path: Path, column: str) -> Linear:
    """Samples of `column` over the column t of a CSV file whose header may carry units.

    Raises:
        ValueError: no such column, no column t, a row that holds no numbers, times not increasing.
        OSError: the file cannot be read.
    """
    with path.open(newline="", encoding="utf-8-sig") as file:
        header, *rows = [row for row in csv.reader(file) if row] or [[]]
    names = [text.partition("[")[0].strip() for text in header]
    check_names(f"input file '{path}'", ["t", column.partition("[")[0].strip()], names)
    places = names.index("t"), names.index(column.partition("[")[0].strip())
    samples = [
        [_cell(path, line, row, place, names[place]) for place in places]
        for line, row in enumerate(rows, start=2)
    ]
    if not samples:
        raise ValueError(f"input file '{path}': expected rows of numbers, got only a header")
    t, values = zip(*samples, strict=True)
    try:
        return Linear(t, values)
    except ValueError as error:
        raise ValueError(f"input file '{path}': {error}") from None


def _cell(path: Path, line: int, row: list[str], place: int, name: str) -> float:
    text = row[place] if place < len(row) else ""
    return checks.parsed(f"input file '{path}', line {line}, column {name}", text)
