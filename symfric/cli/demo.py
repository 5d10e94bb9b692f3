"""`symfric demo`: simulation, identification, optimal control and generated C in one run."""

import shlex
import tomllib
from pathlib import Path

import typer

from identification.data.synthetic import synthetic_drive_data
from symfric import SolveError, Status
from symfric.cli import output
from symfric.cli.app import INTERRUPTED, main
from symfric.foundation import checks
from symfric.foundation.files import check_folder, write_text
from symfric.foundation.programs import find_compiler

STAGE = Path("..", "shared", "data", "EMPS")
"""Default folder of the records of the EMPS benchmark, next to the working folder."""

INTERVALS = 100
"""Number of intervals of the moves."""

PARTS = tomllib.loads(Path(__file__).with_name("demo.toml").read_text(encoding="utf-8"))
"""Title of a part -> its commands."""


def demo(out: Path = Path("out"), data: Path | None = None) -> None:
    """Simulate, identify, optimise and generate C.

    The results are written to DIR; README.md there lists them with the commands that made them.

    Example: symfric demo --out out
    """
    check_folder(out)
    places = records(out / "identification", data)
    places |= {"out": out.as_posix(), "intervals": str(INTERVALS)}
    moves = Path(__file__).with_name("demo_moves.py").read_text(encoding="utf-8")
    write_text(out / "optimal_move" / "moves.py", moves)
    listed, failed = ["# Results of `symfric demo`"], False
    for title, commands in PARTS.items():
        output.note(f"\n{title}")
        listed += [f"\n## {title}\n"]
        for command in commands:
            words = [word.format(**places) for word in command.split()]
            output.note(f"$ symfric {shlex.join(words)}")
            listed.append(f"    symfric {shlex.join(words)}")
            status = main(words)
            if status == INTERRUPTED:
                raise SolveError("demo: interrupted", Status.INTERRUPTED)
            failed |= bool(status) and (words[0] != "codegen" or find_compiler() is not None)
    files = [path for path in out.rglob("*") if path.is_file() and path.name != "README.md"]
    names = sorted(path.relative_to(out).as_posix() for path in files)
    listed += ["\n## Files\n", *(f"- [{name}]({name})" for name in names), ""]
    listed += [f"![{name}]({name})" for name in names if name.endswith(".png")]
    write_text(out / "README.md", "\n".join([*listed, ""]))
    output.note(f"wrote {out / 'README.md'}, which lists the results")
    if failed:
        raise typer.Exit(1)


def records(folder: Path, data: Path | None) -> dict[str, str]:
    """Return the files for identification and validation, and the laws to identify from them."""
    stage = data or (STAGE if STAGE.is_dir() else None)
    if stage is not None:
        laws = "coulomb+viscous,asymmetric(coulomb+viscous)"
        files = stage / "DATA_EMPS.mat", stage / "DATA_EMPS_PULSES.mat"
        if missing := [file.name for file in files if not file.is_file()]:
            what = "the folder of DATA_EMPS.mat and DATA_EMPS_PULSES.mat"
            raise checks.refused("demo: data", what, str(stage), f"missing: {', '.join(missing)}")
        output.note(f"identification from the measured EMPS stage in {stage}")
    else:
        output.note("no measured record found (--data DIR for the EMPS benchmark), simulating one")
        laws, files = "stribeck", (folder / "record.csv", folder / "validation.csv")
        synthetic_drive_data().to_csv(files[0])
        synthetic_drive_data(seed=1, speeds=(0.003, 0.02, 0.09)).to_csv(files[1])
    return {"record": str(files[0]), "validation": str(files[1]), "laws": laws}
