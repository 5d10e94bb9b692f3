"""The style sheet of a page: light and dark by the reader's setting, black on white in print."""

from collections.abc import Sequence
from pathlib import Path

from symfric.foundation.style import COLOURS, dash


def _lighter(colour: str) -> str:
    """Half way to white, to be seen on dark paper."""
    return "#" + "".join(f"{(int(colour[k : k + 2], 16) + 255) // 2:02x}" for k in (1, 3, 5))


def _dashes(k: int) -> str:
    pattern = dash(k)
    return "none" if isinstance(pattern, str) else " ".join(f"{1.2 * x:.3g}" for x in pattern[1])


def _runs(colours: Sequence[str]) -> str:
    """Classes run0, run1, ...: the colours and dashes that pictures give to simulations."""
    return "\n".join(
        f"svg .run{k} {{ stroke: {colour}; stroke-dasharray: {_dashes(k)}; }}"
        for k, colour in enumerate(colours)
    )


STYLE = f"""{Path(__file__).with_name("page.css").read_text("utf-8")}{_runs(COLOURS)}
@media screen and (prefers-color-scheme: dark) {{ {_runs([_lighter(c) for c in COLOURS])} }}
"""
