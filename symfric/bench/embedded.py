"""Laws and plants on every core: `make embedded`."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

from symfric.bench.codegen_blocks import Case, cases
from symfric.codegen import generate
from symfric.embedded import (
    CORES,
    Absent,
    Measured,
    Tools,
    find_tools,
    measure,
    wrong_on_target,
)

Tell = Callable[[str, float], None]

TARGETS = (*((core, "float") for core in CORES), ("m7", "double"))
"""Core and floating point type; double on a core without an FPU for it is of no use."""


@final
@dataclass(frozen=True, eq=False)
class EmbeddedRow:
    """A block on a core: what it costs, and how many results of its kit's unit test are wrong."""

    measured: Measured
    wrong: int

    @property
    def ok(self) -> bool:
        """Whether it was measured, all numbers are finite, and none is wrong."""
        return self.measured.ok and self.wrong == 0

    def to_dict(self) -> dict[str, Any]:
        """Everything by name."""
        return self.measured.to_dict() | {"wrong": self.wrong}


@final
@dataclass(frozen=True, eq=False)
class EmbeddedBenchmark:
    """What was measured; `advice` says which tools are absent, and where to get them."""

    rows: tuple[EmbeddedRow, ...]
    advice: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Rows as dictionaries."""
        return {"rows": [row.to_dict() for row in self.rows], "skipped": self.advice}


def bench_embedded(*, quick: bool = False, progress: Tell | None = None) -> EmbeddedBenchmark:
    """Measure and test every block on every core; `quick` on the M4F alone.

    Ctrl-C leaves what there is.
    """
    tools = find_tools()
    if isinstance(tools, Absent):
        return EmbeddedBenchmark((), tools.advice)
    known, rows = list(cases()), list[EmbeddedRow]()
    targets = [("m4f", "float")] if quick else TARGETS
    try:
        for k, case in enumerate(known):
            if progress is not None:
                progress(case.name, k / len(known))
            rows += _measured(case, targets, tools)
    except KeyboardInterrupt:
        if not rows:
            raise
    return EmbeddedBenchmark(tuple(rows))


def _measured(
    case: Case, targets: Sequence[tuple[str, str]], tools: Tools
) -> Iterator[EmbeddedRow]:
    block = case.make()
    with TemporaryDirectory(prefix="symfric-") as folder:
        reals = tuple(dict.fromkeys(real for _, real in targets))
        kit = generate(block, Path(folder), real=reals)
        for core, real in targets:
            wrong = wrong_on_target(kit, real, core, tools=tools)
            yield EmbeddedRow(measure(block, real, core, tools=tools), wrong)
