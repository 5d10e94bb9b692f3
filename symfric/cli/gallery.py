"""`symfric gallery`: the figures of the papers, computed again."""

from itertools import groupby
from pathlib import Path
from re import split
from textwrap import shorten
from typing import Annotated

import typer

from symfric.cli import completions, output
from symfric.cli.options import WorkersOption, argument, option
from symfric.foundation.files import make_folder
from symfric.gallery import chosen, short
from symfric.gallery.plate import about
from symfric.gallery.rendering import Gallery, render

INTERRUPTED = 130
"""Exit status after Ctrl-C, as of all commands."""


def gallery(
    names: Annotated[
        list[str] | None,
        argument("NAME", "A figure, or a paper; all if none is given.", completions.plates),
    ] = None,
    out: Annotated[Path, option("--out DIR", "Where pictures and numbers go.")] = Path("gallery"),
    quick: Annotated[bool, option("--quick", "At reduced size, a second a figure.")] = False,
    workers: WorkersOption = None,
    listed: Annotated[bool, option("--list", "List the figures and compute none.")] = False,
) -> None:
    """Compute the figures of the papers again.

    Beside each: what is compared, how far we are, which observation is reproduced, which
    explanation refuted, and what the text leaves open. Writes a picture and a JSON file of its
    numbers for every figure, and index.html with all of them.
    Ctrl-C keeps what is done. A figure that fails is told, the others go on, and the exit status
    is 1; it is 130 after Ctrl-C.

    Example: symfric gallery --list

    Example: symfric gallery self_tuning selection/fig_02 --out figures
    """
    asked = tuple(names or ())
    if listed:
        return show_list(chosen(asked))
    if workers is not None and workers < 1:
        raise ValueError(f"gallery: expected --workers >= 1, got {workers}")
    chosen(asked)
    make_folder(out)
    with output.progress(f"{len(chosen(asked))} figures") as tell:
        done = render(out, asked, quick=quick, workers=workers, progress=tell)
    show_gallery(done)
    took = f"{len(done.records)} of {len(done.asked)} figures in {done.seconds:.0f} s"
    output.note(f"{took}, {'at reduced size, ' if quick else ''}wrote {out / 'index.html'}")
    if done.left:
        raise typer.Exit(INTERRUPTED)
    if done.failures:
        raise typer.Exit(1)
    return None


def show_list(names: tuple[str, ...]) -> None:
    """Print what there is."""
    told = [(short(name), about(name)) for name in names]
    papers = dict.fromkeys(said["paper"] for _, said in told)
    for paper in papers:
        output.show(f"\n{paper}")
        rows = [(name, said["title"]) for name, said in told if said["paper"] == paper]
        output.show_table(["figure", "what it shows"], rows)


def show_gallery(done: Gallery) -> None:
    """Print what is compared, how far we are, and what failed."""
    for folder, names in groupby(done.records, lambda name: name.partition("/")[0]):
        records = {name: done.records[name] for name in names}
        paper = next(iter(records.values()))["paper"]
        output.show(f"{folder}: {paper}")
        rows = [
            (
                short(name).partition("/")[2],
                brief(r["compared"]),
                r["how_far"],
                f"{r['seconds']:.1f}",
            )
            for name, r in records.items()
        ]
        output.show_table(["figure", "what is compared", "how far", "s"], rows)
        output.show()
    for name, why in done.failures.items():
        output.note(f"symfric: {name} failed, {why}")
    if done.left:
        output.note(f"symfric: {done.left} of {len(done.asked)} figures were not computed")


def brief(text: str) -> str:
    """The first sentence or clause, cut to two lines of the table."""
    return shorten(split(r"(?<!\.)[.;:](?: |$)", text)[0], 84, placeholder=" ...")
