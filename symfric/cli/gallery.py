"""`symfric gallery`: the figures of the papers, computed again."""

from pathlib import Path
from re import split
from typing import Annotated

import typer

from symfric.cli import output
from symfric.cli.options import check_folder
from symfric.gallery import chosen, short
from symfric.gallery.plate import about
from symfric.gallery.rendering import Gallery, render


def gallery(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME]...", help="A figure, or a paper; all if none is given."),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Where pictures and numbers go.")
    ] = Path("gallery"),
    quick: Annotated[
        bool, typer.Option("--quick", help="At reduced size, a second a figure.")
    ] = False,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", help="Processes; default one a core.")
    ] = None,
    listed: Annotated[
        bool, typer.Option("--list", help="List the figures and compute none.")
    ] = False,
) -> None:
    """Compute the figures of the papers again.

    Beside each: what is compared, how far we are, and what was refuted by what evidence. Writes a
    picture and a JSON file of its numbers for every figure, and index.html with all of them.
    Ctrl-C keeps what is done. A figure that fails is told, the others go on, and the exit status
    is 1.

    Example: symfric gallery --list

    Example: symfric gallery self_tuning selection/fig_02 --out figures
    """
    asked = tuple(names or ())
    if listed:
        return show_list(chosen(asked))
    if workers is not None and workers < 1:
        raise ValueError(f"gallery: expected --workers >= 1, got {workers}")
    chosen(asked)
    check_folder(out)
    with output.progress(f"{len(chosen(asked))} figures") as tell:
        done = render(out, asked, quick=quick, workers=workers, progress=tell)
    show_gallery(done)
    output.say_written(out / "index.html")
    if not done.passed:
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
    output.show_table(
        ["figure", "what is compared", "how far", "s"],
        [
            (short(name), first_sentence(r["compared"]), r["how_far"], f"{r['seconds']:.1f}")
            for name, r in done.records.items()
        ],
    )
    for name, why in done.failures.items():
        output.note(f"symfric: {name} failed, {why}")
    left = len(done.asked) - len(done.records) - len(done.failures)
    if left:
        output.note(f"symfric: interrupted, {left} of {len(done.asked)} figures were not computed")


def first_sentence(text: str) -> str:
    """Up to the first full stop, colon or semicolon."""
    return split(r"(?<!\.)[.;:](?: |$)", text)[0]
