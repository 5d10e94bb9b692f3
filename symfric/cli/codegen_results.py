"""Results of `symfric codegen`: tables; laws with integers; predictive controllers."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from textwrap import fill
from typing import Any

import typer

from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.options import Strings
from symfric.codegen import Check, Generated, Proof, Verification
from symfric.codegen.fixed.generated import COUNT, compare, fixed_point, random_inputs
from symfric.codegen.guards import TOP
from symfric.embedded import BlockMeasurement, StepError
from symfric.embedded.measure import REGIMES, measure_fixed
from symfric.foundation import checks
from symfric.foundation.parameters import check_names
from symfric.foundation.programs import find_compiler
from symfric.laws import Law

FIXED = "fixed"
OF_LAWS = ("--out", "--law", "--set", "--accept", "--range", "--step-size", "--name", "--real",
           "--core", "--compiler", "--json", "--fold")  # fmt: skip
"""Options that apply to fixed point."""
REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}
"""Value of --real -> floating-point types."""
OF_CONTROLLERS = ("--out", "--mpc", "--set", "--step-size", "--real", "--core", "--json")
"""Options that apply to a controller."""
STEP = 0.01
"""Default time between cycles [s] of a controller of a problem."""


def write_fixed(
    out: Path, law: Law, given: Sequence[str], ranges: Strings, h: float | None,
    name: str | None, cores: Strings, compiler: str | None, json: str | None,
) -> None:  # fmt: skip
    """Write a law in fixed point, compare it with CasADi, and measure it on cores.

    Raises:
        ValueError: options `given` other than `OF_LAWS`, ranges that are not LOW:HIGH, or errors of
            `fixed_point`.
    """
    if others := [o for o in given if o.startswith("--") and o not in OF_LAWS]:
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


def write_controllers(
    out: Path, text: str, given: Sequence[str], settings: Strings, step: float | None,
    real: str | None, cores: Strings, json: str | None,
) -> None:  # fmt: skip
    """Write the controller of FILE.py[:NAME] in each type, verify it, and measure it on cores.

    Raises:
        ValueError: options `given` other than `OF_CONTROLLERS`; a file without a problem or
            controller, or a step size for a controller, which has its own.
    """
    from ocp import Controller, Problem  # noqa: PLC0415  (slow to import)
    from ocp.mpc.target import measure_controller  # noqa: PLC0415  (slow to import)

    check_names("--real", [real or "both"], REALS)
    if others := [option for option in given if option not in OF_CONTROLLERS]:
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


def report(
    law: str,
    generated: Generated,
    verification: Verification,
    measured: Sequence[BlockMeasurement],
    proofs: Sequence[Proof],
    errors: Sequence[StepError],
    json: str | None,
) -> None:
    """Print or write all results, and print the file names."""
    content = {
        "law": law,
        "files": [str(path) for path in generated.files],
        "manifest": dict(generated.manifest),
        "verification": verification.to_dict(),
        "cores": [m.to_dict() for m in measured],
        "proofs": [asdict(found) for found in proofs],
        "step_errors": [asdict(found) for found in errors],
    }
    output.emit_json(content, json)
    if json != "-":
        show_verification(verification)
        show_step_errors(errors)
        show_sizes(generated, measured)
        for found in proofs:
            output.show(f"{found.real}: {contract(found)}")
    names = "  ".join(str(path.relative_to(generated.folder)) for path in generated.files)
    output.note(f"wrote {len(generated.files)} files into {generated.folder}:")
    indent: Any = dict.fromkeys(("initial_indent", "subsequent_indent"), "  ")
    output.note(fill(names, 78, break_long_words=False, break_on_hyphens=False, **indent))
    output.say_written(json)


def show_step_errors(errors: Sequence[StepError]) -> None:
    """Print the errors of fixed steps, one row per step size."""
    if errors:
        output.show(f"errors of fixed steps over {errors[0].duration:g} s of the scene:")
        output.show_table(
            ["step [s]", "largest error / peak", "state"],
            [(f"{e.h:g}", f"{e.error:.2g}", e.state) for e in errors],
        )


def contract(proof: Proof) -> str:
    """Return what is proved, with the ranges of limited outputs, or why it is not."""
    if not proof.ok:
        return proof.status
    known = [
        f"; {name} within {low:g} ... {high:g}"
        for name, (low, high) in proof.ranges.items() if max(-low, high) < TOP
    ]  # fmt: skip
    text = f"{proof.status} for all bits of states, inputs and parameters: no undefined operation"
    return f"{text}, finite outputs{''.join(known)}"


def show_verification(verification: Verification) -> None:
    """Print the comparison of the C with CasADi, one row per floating point type."""
    compiler = f" ({verification.compiler})" if verification.compiler else ""
    output.show(f"{verification.name}: {verification.status}{compiler}")
    rows = [
        (check.real, check.steps, len(check.warnings), compared(check), f"{check.error:.2g}",
         check.worst or "-", ", ".join(check.foreign or ()) or "none")
        for check in verification.checks
    ]  # fmt: skip
    if rows:
        output.show_table(
            ["type", "steps", "warnings", "against CasADi", "error", "output", "foreign"], rows
        )
    for check in verification.checks:
        if check.ties:
            output.show(
                f"{check.real}: in {check.ties} of {check.steps} steps rounding decides a mode, "
                "in CasADi as in C"
            )


def compared(check: Check) -> str:
    """Return a description of the comparison: distance in double precision, or within rounding."""
    if check.ulp is None:
        return "within rounding" if check.near else "differs"
    return "bit for bit equal" if check.ulp == 0 else f"{check.ulp} ulp apart"


def show_sizes(generated: Generated, measured: Sequence[BlockMeasurement]) -> None:
    """Print memory on this machine (from `size`, -fstack-usage) and cost on other cores (QEMU)."""
    rows: list[tuple[str | float, ...]] = []
    for real in generated.reals:
        found = generated.manifest["real"][real].get("measured")
        if found is not None:
            stack = max(found["stack"].values(), default="-")
            rows.append((real, found["compiler"], found["text"] or "-", stack))
    rows += [(m.real, m.core, f"{m.text:.0f}", f"{m.stack:.0f}") for m in measured if m.ok]
    if rows:
        output.show_table(["type", "compiler or core", "code [B]", "stack [B]"], rows)
    for core, status in dict.fromkeys((m.core, m.status) for m in measured if not m.ok):
        output.show(f"{core}: {status}")
    if counted := [m for m in measured if m.ok]:
        output.show("instructions per step (mean in mixed motion and by regime; maximum):")
        names = [name for name in REGIMES if name in counted[0].regimes]
        head = ["type", "core", "mixed", *names, "maximum"]
        output.show_table(head, [
            (m.real, m.core, *(f"{x:.0f}" for x in (m.average, *m.regimes.values(), m.maximum)))
            for m in counted
        ])  # fmt: skip
