"""What `verify` must say of generated C."""

from pathlib import Path

from symfric.codegen import Block, generate, verify


def prove(block: Block, folder: Path) -> None:
    """Bit for bit in double; in float near, or off by rounding alone where a mode ties.

    An element of GMS friction that goes back by as much as it came ends at its limit exactly, and
    the last bit says whether it slips.
    """
    found = verify(generate(block, folder, kit=False))
    double, single = found.checks
    assert (double.ulp, double.warnings, single.warnings) == (0, (), ()), found
    assert double.ok, found
    tied = (single.worst or "").startswith("p_") and "by rounding" in single.why
    assert single.ok or tied, found
