"""Generated code against its goals: instructions on a core, robustness, FMUs, compensators."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from math import log10
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from symfric.bench.codegen_section import Section
from symfric.foundation.parameters import check_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SECTIONS = ("cores", "fuzz", "fmu", "compensation")
"""Modules `symfric.bench.codegen_<section>`, each with `measure(quick) -> Section`. Where a tool is
absent the section has no rows, and a note that says which."""
Tell = Callable[[str, float], None]


@final
@dataclass(frozen=True, eq=False)
class CodegenBenchmark:
    """What was measured, section by section."""

    sections: Mapping[str, Section] = field(default_factory=dict[str, Section])

    def to_dict(self) -> dict[str, Any]:
        """Tables, goals and notes of every section."""
        return {name: section.to_dict() for name, section in self.sections.items()}

    def plot(self, path: str | Path) -> "Figure":
        """How far each number is from its goal; right of the line it is worse."""
        from symfric.bench.pictures import plot_goals  # noqa: PLC0415  (matplotlib is slow)

        goals = [g for s in self.sections.values() for g in s.goals if g.value > 0 and g.goal > 0]
        side = {"<=": 1.0, ">=": -1.0}
        return plot_goals(
            [goal.what for goal in goals],
            [side[goal.better] * log10(goal.value / goal.goal) for goal in goals],
            [goal.met for goal in goals],
            path,
        )


def bench_codegen(
    *, quick: bool = False, sections: tuple[str, ...] = SECTIONS, progress: Tell | None = None
) -> CodegenBenchmark:
    """Measure `sections`; `quick` leaves out the slow others. Ctrl-C leaves what there is.

    Raises:
        ValueError: an unknown section.
    """
    check_names("bench codegen: sections", sections, SECTIONS)
    found: dict[str, Section] = {}
    try:
        for k, section in enumerate(sections):
            if progress is not None:
                progress(section, k / len(sections))
            found[section] = import_module(f"symfric.bench.codegen_{section}").measure(quick)
    except KeyboardInterrupt:
        if not found:
            raise
    return CodegenBenchmark(found)
