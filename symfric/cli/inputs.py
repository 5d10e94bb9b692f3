"""Inputs of a scene from the command line: a number, or a column of a CSV file."""

from pathlib import Path

from symfric import Linear
from symfric.foundation import checks
from symfric.foundation.tables import Column, read_table
from symfric.integrator import Input


def input_from_text(name: str, text: str, unit: str) -> Input:
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
        {"t": Column(("t", "time"), "s", assumed=True), column: Column(names, unit, assumed=True)},
    )
    try:
        return Linear(table.columns["t"], table.columns[column])
    except ValueError as error:
        raise ValueError(f"read '{path.name}': {error}") from None
