"""Laws and plants on every core: `make embedded`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

from symfric.bench.codegen_blocks import cases
from symfric.embedded import CORES, Absent, Measured, find_tools, measure

Tell = Callable[[str, float], None]

TARGETS = (*((core, "float") for core in CORES), ("m7", "double"))
"""Core and floating point type; double on a core without an FPU for it is of no use."""


@final
@dataclass(frozen=True, eq=False)
class EmbeddedBenchmark:
    """What was measured; `advice` says which tools are absent, and where to get them."""

    rows: tuple[Measured, ...]
    advice: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Rows as dictionaries."""
        return {"rows": [row.to_dict() for row in self.rows], "skipped": self.advice}


def bench_embedded(*, quick: bool = False, progress: Tell | None = None) -> EmbeddedBenchmark:
    """Measure every block on every core; `quick` on the M4F alone. Ctrl-C leaves what there is."""
    tools = find_tools()
    if isinstance(tools, Absent):
        return EmbeddedBenchmark((), tools.advice)
    known, rows = list(cases()), list[Measured]()
    targets = [("m4f", "float")] if quick else TARGETS
    try:
        for k, case in enumerate(known):
            if progress is not None:
                progress(case.name, k / len(known))
            block = case.make()
            rows += [measure(block, real, core, tools=tools) for core, real in targets]
    except KeyboardInterrupt:
        if not rows:
            raise
    return EmbeddedBenchmark(tuple(rows))
