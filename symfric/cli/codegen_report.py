"""Tables of `symfric codegen`: verification, sizes and proofs."""

from collections.abc import Sequence
from dataclasses import asdict
from textwrap import fill
from typing import Any

from symfric.cli import output
from symfric.codegen import Check, Generated, Proof, Verification
from symfric.codegen.guards import TOP
from symfric.embedded import BlockMeasurement, StepError
from symfric.embedded.measure import REGIMES


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
