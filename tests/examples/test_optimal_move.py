import json
import os
import subprocess
import sys
from pathlib import Path

EXAMPLE = Path(__file__).parents[2] / "examples" / "optimal_move.py"


def test_example_runs_headless_and_leaves_its_results(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLE), str(tmp_path / "new")],
        capture_output=True,
        text=True,
        env=os.environ | {"MPLBACKEND": "Agg"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("SOLVED") == 3
    assert {path.name for path in (tmp_path / "new").iterdir()} == {
        "optimal_moves.png",
        "fastest_move.png",
        "fastest_move.csv",
        "fastest_move.json",
    }
    data = json.loads((tmp_path / "new" / "fastest_move.json").read_text())
    assert abs(data["terminal_miss"]["x"]) < 1e-3


def test_example_is_short() -> None:
    assert len(EXAMPLE.read_text().splitlines()) < 100
