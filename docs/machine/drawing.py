"""Pictures of laws and scenes, drawn by several processes at once and kept while code stays."""

import os
import shutil
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from docs.machine.pages import DOCS
from docs.machine.stamp import code_hash, digest, is_fresh, stamped

MADE = DOCS / "made"
"""Pictures that the build makes; nothing of it is in the repository."""


def draw_all(
    room: str, names: Iterable[str], draw: Callable[[str, Path], None], say: Callable[[str], None]
) -> list[str]:
    """Let `draw(name, folder)` draw each of `names` into a folder; sentences about what failed."""
    folder, names = MADE / room, list(names)
    key = digest([code_hash(), room, *names])
    if is_fresh(folder, key) and all((folder / f"{name}.png").exists() for name in names):
        return []
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    say(f"drawing {len(names)} pictures of {room}")
    workers = min(os.cpu_count() or 1, len(names))
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        failed = [f for f in pool.map(partial(_drawn, draw, folder), names) if f]
    if not failed:
        stamped(folder, key)
    return failed


def _drawn(draw: Callable[[str, Path], None], folder: Path, name: str) -> str:
    try:
        draw(name, folder)
    except Exception as error:  # noqa: BLE001  (one picture that fails leaves the others)
        return f"{folder.name} '{name}': {type(error).__name__}: {error}"
    return ""


def law(name: str, folder: Path) -> None:
    """The picture of a law that `symfric laws NAME --plot` draws, and a small one."""
    from symfric import any_from_text  # noqa: PLC0415  (in the process that draws)
    from symfric.figures.pictures import plot_laws  # noqa: PLC0415

    chosen = any_from_text(name)
    plot_laws({name: chosen}, path=folder / f"{name}.png")
    small(chosen, folder / f"{name}_small.png")


def small(law: Any, path: Path) -> None:
    """Force in steady sliding around rest, without numbers."""
    import numpy as np  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    from symfric.figures.pictures import window  # noqa: PLC0415
    from symfric.laws import steady_force  # noqa: PLC0415

    edge = window(law, 1.0)
    v = np.linspace(-edge, edge, 1001)
    figure = Figure(figsize=(2.2, 1.4), layout="constrained")
    axis = figure.add_subplot()
    axis.plot(v, steady_force(law, v, 1.0), linewidth=2)
    axis.axhline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axis.axvline(0.0, color="0.7", linewidth=0.8, zorder=0)
    axis.set_xticks([])
    axis.set_yticks([])
    figure.savefig(path, dpi=110)
