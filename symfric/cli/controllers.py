"""`symfric codegen --mpc`: write predictive controllers as C, verify and measure them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.options import Strings
from symfric.foundation.parameters import check_names

REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}
"""Value of --real -> floating-point types."""
OPTIONS = ("--out", "--mpc", "--settings", "--step-size", "--real", "--core", "--json")
"""Options of `symfric codegen` that apply to a controller."""
STEP = 0.01
"""Default time between cycles [s] of a controller of a problem."""


def write_controllers(
    out: Path, text: str, given: Sequence[str], settings: Strings, step: float | None,
    real: str | None, cores: Strings, json: str | None,
) -> None:  # fmt: skip
    """Write the controller of FILE.py[:NAME] in each type, verify it, and measure it on cores.

    Raises:
        ValueError: options `given` other than `OPTIONS`; a file without a problem or controller,
            or a step size for a controller, which has its own.
    """
    from ocp import Controller, Problem  # noqa: PLC0415  (slow to import)
    from ocp.mpc.target import measure_controller  # noqa: PLC0415  (slow to import)

    check_names("--real", [real or "both"], REALS)
    if others := [option for option in given if option not in OPTIONS]:
        raise ValueError(
            "codegen --mpc: expected only --out, --set, --step-size, --real, --core and --json in "
            f"addition, got {', '.join(others)}"
        )
    numbers, kinds = opt.numbers("--set", settings), (Problem, Controller)
    made = opt.held_by_file("codegen", text, "problem", numbers, "Problem or Controller", kinds)
    if isinstance(made, Problem):
        made = made.to_mpc(STEP if step is None else step)
    elif step is not None:
        raise ValueError(f"--step-size: expected none with a controller, which has {made.step:g} s")
    rows, content, measured = [], dict[str, Any](files=[], checks=[]), []
    for kind in REALS[real or "both"]:
        files = made.to_c(out, kind)
        check = files.verify()
        content["files"] += map(str, files.files)
        content["checks"].append({"real": kind} | {k: v for k, v in vars(check).items()})
        rows.append((kind, check.status, check.cycles, check.understated, check.bytes))
        measured += [measure_controller(files, core) for core in cores or ()]
    content["cores"] = [m.to_dict() for m in measured]
    output.emit_json(content, json)
    if json != "-":
        head = ["type", "status", "cycles", "true / reported residual", "RAM [B]"]
        output.show_table(head, rows, repr(made).strip("<>"))
        if counted := [m for m in measured if m.ok]:
            output.show_table(
                ["type", "core", "instructions, mean", "maximum", "code [B]", "stack [B]"],
                [(m.real, m.core, *(f"{x:.0f}" for x in (m.average, m.maximum, m.text, m.stack)))
                 for m in counted], "Instructions of a cycle in a loop with disturbances",
            )  # fmt: skip
        for core, status in dict.fromkeys((m.core, m.status) for m in measured if not m.ok):
            output.show(f"{core}: {status}")
    output.note(f"wrote {len(content['files'])} files into {out}")
    output.say_written(json)
    if any(status != "verified" for _, status, *_ in rows):
        raise typer.Exit(1)
