from collections import Counter
from itertools import islice
from pathlib import Path

import pytest

from symfric.bench.file_campaign import campaign
from symfric.bench.identification import files as measured
from symfric.bench.identification import outcome

SOME = {
    "plain": "right",
    "MATLAB struct": "right",
    "MATLAB, cut off": "refused",
    "empty cell": "refused",
}


def test_some_files_end_as_they_should(tmp_path: Path) -> None:
    first = islice(campaign(), 32)
    assert {f.name: outcome(f, tmp_path).kind for f in first if f.name in SOME} == SOME


@pytest.mark.slow
def test_a_hundred_different_files() -> None:
    files = list(campaign())
    names = [file.name for file in files]
    assert len(names) >= 100
    assert not [name for name, count in Counter(names).items() if count > 1]
    assert len({file.content for file in files}) == len(files)
    assert {file.truth for file in files} == {"good", "bad", "hidden"}


@pytest.mark.slow
def test_no_file_is_answered_wrongly_in_silence() -> None:
    rows = list(measured())
    assert all(row.met for row in rows), rows
