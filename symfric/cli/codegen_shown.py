"""What `symfric codegen` prints: how the C compares with CasADi, and what it needs."""

from collections.abc import Sequence

from symfric.cli import output
from symfric.codegen import Generated, Verification
from symfric.codegen.proof.verify import Check
from symfric.embedded import Measured


def show_verification(verification: Verification) -> None:
    """Print how the C compares with CasADi, one row a floating point type."""
    compiler = f" ({verification.compiler})" if verification.compiler else ""
    output.show(f"{verification.name}: {verification.status}{compiler}")
    if verification.checks:
        output.show_table(
            ["type", "steps", "warnings", "against CasADi", "error", "of", "foreign symbols"],
            [
                (
                    check.real,
                    check.steps,
                    len(check.warnings),
                    compared(check),
                    f"{check.error:.2g}",
                    check.worst or "-",
                    ", ".join(check.foreign or ()) or "none",
                )
                for check in verification.checks
            ],
        )
    for check in verification.checks:
        if check.ties:
            output.show(
                f"{check.real}: in {check.ties} of {check.steps} steps a mode ties and rounding "
                "decides it, in CasADi as in C"
            )


def compared(check: Check) -> str:
    """How the C compares with CasADi, in words."""
    return "differs" if check.ulp is None and not check.near else bits(check.ulp)


def bits(ulp: int | None) -> str:
    """How near the C in double is to CasADi, in words."""
    if ulp is None:
        return "within rounding"
    return "bit for bit equal" if ulp == 0 else f"{ulp} ulp apart"


def show_sizes(generated: Generated, measured: Sequence[Measured]) -> None:
    """Print what the C needs here, by size and -fstack-usage, and on other cores, by QEMU."""
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
        head = ["type", "built by, for", "code [B]", "stack [B]", "instructions", "at most"]
        output.show_table(head, rows)
    for core, status in dict.fromkeys((m.core, m.status) for m in measured if not m.ok):
        output.show(f"{core}: {status}")
