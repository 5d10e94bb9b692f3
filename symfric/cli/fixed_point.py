"""`symfric codegen --real fixed`: write a law with integers, compare and measure it."""

from collections.abc import Sequence
from pathlib import Path

import typer

from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.options import Strings
from symfric.codegen.fixed.generated import COUNT, compare, fixed_point, random_inputs
from symfric.embedded.measure import measure_fixed
from symfric.foundation import checks
from symfric.foundation.programs import find_compiler
from symfric.laws import Law

FIXED = "fixed"
OPTIONS = ("--out", "--law", "--fit", "--settings", "--accept", "--ranges", "--step-size", "--name",
           "--real", "--core", "--compiler", "--json", "--fold")  # fmt: skip
"""Options of `symfric codegen` that apply to fixed point."""


def write_fixed(
    out: Path, law: Law, given: Sequence[str], ranges: Strings, h: float | None,
    name: str | None, cores: Strings, compiler: str | None, json: str | None,
) -> None:  # fmt: skip
    """Write a law in fixed point, compare it with CasADi, and measure it on cores.

    Raises:
        ValueError: options `given` other than `OPTIONS`, ranges that are not LOW:HIGH, or errors of
            `fixed_point`.
    """
    if others := [option for option in given if option not in OPTIONS]:
        raise ValueError(f"--real fixed: expected none of {', '.join(others)}; it is for laws")
    ends: dict[str, tuple[float, float]] = {}
    for variable, text in opt.assignments("--range", ranges).items():
        low, _, high = text.partition(":")
        where = f"--range {variable}=LOW:HIGH"
        ends[variable] = checks.parsed(where, low), checks.parsed(where, high)
    made = fixed_point(law, out, ends, name=name, h=h)
    found = find_compiler(compiler) if compiler else find_compiler()
    errors, warnings = (
        ({}, []) if found is None else compare(made, found, random_inputs(made, COUNT))
    )
    measured = [measure_fixed(made, core) for core in cores or ()]
    content = {
        "law": made.model.name, "files": [*map(str, made.files)], "bits": dict(made.bits),
        "proven": dict(made.errors), "measured": errors, "warnings": warnings,
        "cores": [m.to_dict() for m in measured],
    }  # fmt: skip
    output.emit_json(content, json)
    if json != "-":
        units = {v.name: v.unit for v in made.model.states}
        units |= {n: o.unit for n, o in made.model.outputs.items()}
        output.show_table(
            ["result", "proven error", f"largest in {COUNT} steps", "bits of fraction"],
            [(f"{n} [{units[n]}]", f"{e:.2g}", f"{errors.get(n, float('nan')):.2g}", made.bits[n])
             for n, e in made.errors.items()],
            f"{made.model.name}: integers of 32 bits against CasADi",
        )  # fmt: skip
        for m in measured:
            cost = f"{m.average:.0f} instructions per step, {m.maximum:.0f} at most, {m.text:.0f} B"
            output.show(f"{m.core}: {cost if m.ok else m.status}")
    output.note(f"wrote {' and '.join(map(str, made.files))}")
    output.say_written(json)
    if found is None or warnings or any(e > made.errors[n] for n, e in errors.items()):
        raise typer.Exit(1)
