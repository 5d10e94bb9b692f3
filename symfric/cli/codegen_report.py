"""Printed results of `symfric codegen`."""

from collections.abc import Sequence
from textwrap import fill
from typing import Any

from symfric.cli import output
from symfric.codegen import Generated, Verification
from symfric.codegen.verification import Check
from symfric.embedded import Measured


def report(
    law: str,
    generated: Generated,
    verification: Verification,
    measured: Sequence[Measured],
    json: str | None,
) -> None:
    """Print or write the verification and the sizes, and print the file names."""
    content = {
        "law": law,
        "files": [str(path) for path in generated.files],
        "manifest": dict(generated.manifest),
        "verification": verification.to_dict(),
        "cores": [m.to_dict() for m in measured],
    }
    output.emit_json(content, json)
    if json != "-":
        show_verification(verification)
        show_sizes(generated, measured)
    names = "  ".join(str(path.relative_to(generated.folder)) for path in generated.files)
    output.note(f"wrote {len(generated.files)} files into {generated.folder}:")
    indent: Any = dict.fromkeys(("initial_indent", "subsequent_indent"), "  ")
    output.note(fill(names, 78, break_long_words=False, break_on_hyphens=False, **indent))
    output.say_written(json)


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


def show_sizes(generated: Generated, measured: Sequence[Measured]) -> None:
    """Print memory on this machine (from `size`, -fstack-usage) and cost on other cores (QEMU)."""
    rows: list[tuple[str | float, ...]] = []
    for real in generated.reals:
        found = generated.manifest["real"][real].get("measured")
        if found is not None:
            stack = max(found["stack"].values(), default="-")
            rows.append((real, found["compiler"], found["text"] or "-", stack, "-", "-"))
    for m in measured:
        cells = (m.text, m.stack, m.average, m.maximum) if m.ok else ("-", "-", "-", "-")
        numbers = (f"{x:.0f}" if isinstance(x, float) else x for x in cells)
        rows.append((m.real, m.core, *numbers))
    if rows:
        head = ["type", "compiler or core", "code [B]", "stack [B]", "average instructions",
                "most instructions"]  # fmt: skip
        output.show_table(head, rows)
    for core, status in dict.fromkeys((m.core, m.status) for m in measured if not m.ok):
        output.show(f"{core}: {status}")
