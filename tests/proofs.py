"""What `verify` must say of generated C."""

from pathlib import Path

from symfric.codegen import Block, generate, verify


def prove(block: Block, folder: Path) -> None:
    """Bit for bit in double, and near in float."""
    found = verify(generate(block, folder, kit=False))
    double, single = found.checks
    assert (double.ulp, double.warnings, single.warnings) == (0, (), ()), found.table()
    assert found.ok, found.table()
