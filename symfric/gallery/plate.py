"""Plates: recomputed figures of papers, with their distances from the papers."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, wraps
from importlib import import_module
from inspect import cleandoc
from math import isfinite
from pathlib import Path
from textwrap import wrap
from typing import Any, final

from matplotlib.figure import Figure

from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown, TextTable

VERDICTS = {
    "Reproduced": "observation reproduced",
    "Refuted": "explanation refuted",
    "Undecided": "not decidable from the text",
}
"""Section of a docstring -> kind of verdict on the paper; a figure has at least one verdict."""
SECTIONS = ("Compared", "Distance", *VERDICTS)
"""Sections of the docstring of a figure."""
SCRIPT = re.compile(r"fig_(\d+)(?:_(\d+))?_\w+")
"""Pattern of the name of a function that computes a figure."""

Drawn = tuple[Figure, float, Mapping[str, float], Mapping[str, Any]]
"""Picture, distance, numbers and claims, see `plate_of`."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Plate(Showing):
    """Recomputed figure of a paper.

    The texts are from the docstrings of its function and of its folder.

    Attributes:
        paper: authors and title.
        note: assumptions and reconstructions for all figures of the paper; may be empty.
        figure: number, such as "Figure 7".
        title: title of the figure.
        text: further text; may be empty.
        compared: compared quantities.
        measure: definition of `distance`.
        verdicts: kind of `VERDICTS` -> statements of this kind with their evidence; empty at
            reduced size, since verdicts require the full size.
        distance: distance from the paper or the reference, in `unit`; at most `within`.
        unit: SI unit, "1" for a ratio.
        within: largest distance of a figure that counts as recomputed.
        picture: figure created without pyplot.
        numbers: name with unit, such as "period [s]" -> value; the evidence of the verdicts.
        checked: statements that have been checked with these numbers and hold.
        quick: True at reduced size.
    """

    paper: str
    note: str
    figure: str
    title: str
    text: str
    compared: str
    measure: str
    verdicts: Mapping[str, str]
    distance: float
    unit: str
    within: float
    picture: Figure
    numbers: Mapping[str, float]
    checked: tuple[str, ...] = ()
    quick: bool = False

    @property
    def how_far(self) -> str:
        """Distance with its unit and its bound."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.distance:.2g}{unit} (at most {self.within:.2g}{unit})"

    def shown(self) -> Shown:
        """Return the figure, compared quantities, distance, and numbers."""
        rows = tuple((name, f"{value:.6g}") for name, value in self.numbers.items())
        texts = (
            self.paper,
            f"compared: {self.compared}",
            f"distance: {self.how_far}; {self.measure}",
            *(f"{kind}: {text}" for kind, text in self.verdicts.items()),
            *(f"checked: {'; '.join(self.checked)}" for _ in self.checked[:1]),
        )
        lines = tuple(line for text in texts for line in wrap(text, 98, subsequent_indent="  "))
        table = TextTable(("number", "value"), rows, numbers=(1,), rest="... {n} more")
        return Shown(f"{self.figure}: {self.title}", lines, table)

    def thumbnail(self) -> Figure:
        """Return the picture."""
        return self.picture

    def to_dict(self) -> dict[str, Any]:
        """Return all fields except the picture as plain data."""
        fields = {n: v for n, v in vars(self).items() if n != "picture"}
        return fields | {"how_far": self.how_far, "checked": [*self.checked]}


def plate(
    unit: str, within: float | tuple[float, float], like: object = None
) -> Callable[[Callable[[bool], Drawn]], Callable[..., Plate]]:
    """Return a decorator that makes a function `fig_07_what_it_shows(quick)` return a `Plate`.

    Args:
        unit: unit of the distance; "1" for a ratio.
        within: see `plate_of`; a pair for reduced and full size.
        like: function with a docstring that several figures share; the sections of a figure are
            appended to those of `like`.
    """
    bounds = within if isinstance(within, tuple) else (within, within)

    def decorated(draw: Callable[[bool], Drawn]) -> Callable[..., Plate]:
        @wraps(draw)
        def computed(quick: bool = False) -> Plate:
            return plate_of(computed, *draw(quick), unit, within=bounds[not quick], quick=quick)

        shared, own = sections(like.__doc__ if like else ""), sections(draw.__doc__)
        parts = {name: f"{shared.get(name, '')} {own.get(name, '')}".strip() for name in SECTIONS}
        texts = (own["title"], own["text"], shared["text"])
        named = (f"{name}: {part}" for name, part in parts.items() if part)
        computed.__doc__ = "\n\n".join(filter(None, (*texts, *named)))
        return computed

    return decorated


def plate_of(
    function: Callable[..., object],
    picture: Figure,
    distance: float,
    numbers: Mapping[str, float],
    claims: Mapping[str, Any],
    unit: str,
    *,
    within: float,
    quick: bool,
) -> Plate:
    """Return the plate of a function, with the texts of its docstring.

    Args:
        function: function that draws the figure; its folder names the paper.
        picture: figure.
        distance: distance from the paper or the reference.
        numbers: evidence of the verdicts, by names with units.
        claims: statement -> True if it holds for the numbers. At reduced size the plate has no
            other statements.
        unit: unit of the distance; "1" for a ratio.
        within: largest distance of a figure that counts as recomputed; for the error of two
            integrations, four times that on one machine, since steps depend on rounding.
        quick: True at reduced size.

    Raises:
        ValueError: a missing section of the docstring, numbers without a unit or not finite, a
            distance above its bound, or an untrue claim.
    """
    folder, name = function.__module__.rpartition(".")[0], function.__name__
    where = f"gallery '{folder.rpartition('.')[2]}/{name}'"
    texts = sections(function.__doc__)
    missing = [name for name in ("title", "Compared", "Distance") if not texts.get(name)]
    missing += [" or ".join(VERDICTS)] * (not texts.keys() & VERDICTS.keys())
    if missing:
        raise ValueError(f"{where}: expected a docstring with {', '.join(missing)}, got none")
    odd = [name for name, v in {"distance": distance, **numbers}.items() if not isfinite(v)]
    if odd:
        raise ValueError(f"{where}: expected finite numbers, got {', '.join(odd)}")
    bare = [name for name in numbers if not re.search(r" \[[^\]]+\]$", name)]
    if bare:
        raise ValueError(f"{where}: expected numbers with units, got {', '.join(bare)}")
    untrue = [f"'{sentence}'" for sentence, holds in claims.items() if not holds]
    if distance > within:
        untrue.append(f"a distance within {within:.2g} {unit}, {distance:.3g}")
    if untrue:
        raise ValueError(
            f"{where}: expected numbers that support its text, got others for "
            f"{', '.join(untrue)}; correct the text, or find the change that caused it"
        )
    return Plate(
        **about_paper(folder),
        figure=figure_of(name),
        title=texts["title"],
        text="" if quick else texts["text"],
        compared=texts["Compared"],
        measure=texts["Distance"],
        verdicts={} if quick else {v: texts[k] for k, v in VERDICTS.items() if k in texts},
        distance=float(distance),
        unit=unit,
        within=float(within),
        picture=picture,
        numbers={name: float(value) for name, value in numbers.items()},
        checked=tuple(claims),
        quick=quick,
    )


def sections(doc: str | None) -> dict[str, str]:
    """Return the parts of a docstring: "title" (first line), "text", and each of `SECTIONS`."""
    title, _, rest = cleandoc(doc or "").partition("\n")
    found = {"title": title.rstrip("."), "text": ""}
    at = "text"
    for paragraph in re.split(r"\n\s*\n|\n(?=[A-Z][a-z]+:)", rest):
        name, colon, body = paragraph.strip().partition(":")
        at, body = (name, body) if colon and name in SECTIONS else (at, paragraph)
        found[at] = f"{found.get(at, '')}\n\n{' '.join(body.split())}".strip()
    return found


def figure_of(name: str) -> str:
    """Return the number of a figure: fig_07_... is Figure 7, fig_3_2_... is Figure 3.2."""
    match = SCRIPT.fullmatch(name)
    if match is None:
        raise ValueError(f"gallery: expected a function fig_07_what_it_shows, got {name}")
    return "Figure " + ".".join(str(int(part)) for part in match.groups() if part)


def about_paper(folder: str) -> dict[str, str]:
    """Return the first paragraph of the docstring of a folder, "paper", and the rest, "note"."""
    paper, _, note = cleandoc(import_module(folder).__doc__ or "").partition("\n\n")
    return {"paper": " ".join(paper.split()).rstrip("."), "note": " ".join(note.split())}


@cache
def scripts() -> dict[str, str]:
    """Return name -> module of every figure; a name is, e.g., self_tuning/fig_07_shape_factor."""
    found = {
        f"{path.parent.name}/{name}": f"symfric.gallery.{path.parent.name}.{path.stem}"
        for path in Path(__file__).parent.glob("*/*.py")
        for name in re.findall(r"^def (fig_\w+)\(", path.read_text("utf-8"), re.M)
    }
    return dict(sorted(found.items()))


def script(name: str) -> Callable[..., Plate]:
    """Return the function that computes the figure `name`; only its module is imported."""
    return getattr(import_module(scripts()[name]), name.rpartition("/")[2])


def plates() -> dict[str, Callable[..., Plate]]:
    """Return every figure of the gallery: name -> function (quick=False) that computes it.

    With `quick`, a function takes about a second: runs are shorter or coarser, or have fewer laws.
    """
    return {name: script(name) for name in scripts()}


def short(name: str) -> str:
    """Return a name without the description of the figure, such as self_tuning/fig_07."""
    return re.sub(r"(fig_\d+(?:_\d+(?=_))?)_.*", r"\1", name)


def chosen(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the figures that begin with one of `names`, in the order of the gallery; () is all.

    A figure without its paper, such as fig_07 or fig_7, selects this figure of every paper.

    Raises:
        ValueError: a name with which no figure begins.
    """
    known, names = [*scripts()], tuple(name.rstrip("/") for name in names)
    found = {name: [one for one in known if begins(one, name)] for name in names}
    wrong = [name for name, hits in found.items() if not hits]
    folders = dict.fromkeys(name.partition("/")[0] for name in known)
    check_names("gallery", wrong, [*folders, *map(short, known)])
    wanted = {hit for hits in found.values() for hit in hits} or {*known}
    return tuple(name for name in known if name in wanted)


def begins(name: str, start: str) -> bool:
    """Return True if a name begins with `start`; fig_7 selects fig_07, but not fig_70."""
    full = re.sub(r"fig_(\d)(?=_[^\d]|$)", r"fig_0\1", start)
    return any(
        f"{one}/".startswith((f"{begin}_", f"{begin}/"))
        for one in (name, name.rpartition("/")[2])
        for begin in (start, full)
    )


def about(name: str) -> dict[str, str]:
    """Return the texts of a figure, without computing it: paper, figure, title, sections."""
    figure, texts = figure_of(name.rpartition("/")[2]), sections(script(name).__doc__)
    return about_paper(scripts()[name].rpartition(".")[0]) | {"figure": figure} | texts
