"""A plate: one figure of a paper computed again, and how far we are from it."""

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
from symfric.foundation.shown import Showing, Shown, Table

VERDICTS = {
    "Reproduced": "observation reproduced",
    "Refuted": "explanation refuted",
    "Undecided": "not decidable from the text",
}
"""Section of a docstring -> kind of verdict on what the paper says; a figure has one at least."""
SECTIONS = ("Compared", "Distance", *VERDICTS)
"""Sections of the docstring of a figure."""
SCRIPT = re.compile(r"fig_(\d+)(?:_(\d+))?_\w+")
"""Name of the function that computes a figure."""

Drawn = tuple[Figure, float, Mapping[str, float], Mapping[str, Any]]
"""Picture, distance, numbers and claims, see `plate_of`."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Plate(Showing):
    """One figure of a paper, computed again.

    The texts stand in the docstrings of its function and of its folder.

    Attributes:
        paper: authors and title.
        note: what was invented or reconstructed for all figures of the paper; may be empty.
        figure: such as "Figure 7".
        title: what it shows.
        text: what else there is to say; may be empty.
        compared: what is compared with what.
        measure: what `distance` measures.
        verdicts: kind of `VERDICTS` -> what falls under it, and by what evidence; empty at reduced
            size, since verdicts rest on the full one.
        distance: how far we are, in `unit`; `within` at most.
        unit: SI, "1" for a ratio.
        within: the largest distance at which the figure counts as computed again.
        picture: made outside pyplot.
        numbers: name with unit, such as "period [s]" -> value; what the verdicts stand on.
        checked: sentences that were checked on these numbers; all of them hold.
        quick: whether it is computed at reduced size.
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
        """The distance with its unit and its bound."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.distance:.2g}{unit} (at most {self.within:.2g}{unit})"

    def shown(self) -> Shown:
        """Figure, what is compared, how far we are, and the numbers."""
        rows = tuple((name, f"{value:.6g}") for name, value in self.numbers.items())
        texts = (
            self.paper,
            f"compared: {self.compared}",
            f"how far: {self.how_far}; {self.measure}",
            *(f"{kind}: {text}" for kind, text in self.verdicts.items()),
            *(f"checked: {'; '.join(self.checked)}" for _ in self.checked[:1]),
        )
        lines = tuple(line for text in texts for line in wrap(text, 98, subsequent_indent="  "))
        table = Table(("number", "value"), rows, numbers=(1,), rest="... {n} more")
        return Shown(f"{self.figure}: {self.title}", lines, table)

    def thumbnail(self) -> Figure:
        """The picture itself."""
        return self.picture

    def to_dict(self) -> dict[str, Any]:
        """Everything but the picture as plain data."""
        texts = ("paper", "note", "figure", "title", "text", "compared", "measure", "quick")
        return {name: getattr(self, name) for name in texts} | {
            "verdicts": dict(self.verdicts),
            "distance": float(self.distance),
            "within": float(self.within),
            "unit": self.unit,
            "how_far": self.how_far,
            "numbers": {name: float(value) for name, value in self.numbers.items()},
            "checked": [*self.checked],
        }


def plate(
    unit: str, within: float | tuple[float, float], like: object = None
) -> Callable[[Callable[[bool], Drawn]], Callable[..., Plate]]:
    """Let a function `fig_07_what_it_shows(quick)` that draws a figure give its `Plate`.

    Args:
        unit: of the distance; "1" for a ratio.
        within: see `plate_of`; a pair for reduced and full size.
        like: whose docstring says what several figures share; each section continues it.
    """
    bounds = within if isinstance(within, tuple) else (within, within)

    def decorated(draw: Callable[[bool], Drawn]) -> Callable[..., Plate]:
        @wraps(draw)
        def computed(quick: bool = False) -> Plate:
            return plate_of(computed, *draw(quick), unit, within=bounds[not quick], quick=quick)

        shared = sections(like.__doc__ or "") if like is not None else {}
        said = sections(draw.__doc__ or "")
        parts = {name: f"{shared.get(name, '')} {said.get(name, '')}".strip() for name in SECTIONS}
        text = (said["title"], said["text"], shared.get("text", ""))
        named = (f"{name}: {part}" for name, part in parts.items() if part)
        computed.__doc__ = "\n\n".join(filter(None, (*text, *named)))
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
    """The plate of a function, its texts taken from its docstring.

    Args:
        function: that draws it; its folder names the paper.
        picture: the figure.
        distance: how far we are.
        numbers: what the verdicts stand on.
        claims: sentence -> whether the numbers bear it out. At reduced size these sentences are
            all that is said; a plate whose text is untrue is not drawn.
        unit: of the distance; "1" for a ratio.
        within: the largest distance of a figure that is computed again; for the error of two
            integrations four times what one machine gave, since steps depend on rounding.
        quick: whether it is computed at reduced size.

    Raises:
        ValueError: a docstring without one of its sections, numbers that are not finite, a distance
            beyond its bound, a claim that does not hold.
    """
    folder, name = function.__module__.rpartition(".")[0], function.__name__
    where = f"gallery '{folder.rpartition('.')[2]}/{name}'"
    said = sections(function.__doc__ or "")
    missing = [name for name in ("title", "Compared", "Distance") if not said.get(name)]
    missing += [" or ".join(VERDICTS)] * (not said.keys() & VERDICTS.keys())
    if missing:
        raise ValueError(f"{where}: expected a docstring with {', '.join(missing)}, got none")
    odd = [name for name, v in {"distance": distance, **numbers}.items() if not isfinite(v)]
    if odd:
        raise ValueError(f"{where}: expected finite numbers, got {', '.join(odd)}")
    untrue = [f"'{sentence}'" for sentence, holds in claims.items() if not holds]
    if distance > within:
        untrue.append(f"a distance within {within:.2g} {unit}, {distance:.3g}")
    if untrue:
        raise ValueError(
            f"{where}: expected numbers that bear out its text, got others for "
            f"{', '.join(untrue)}; correct the text, or find what has changed"
        )
    return Plate(
        paper=paper_of(folder),
        note=note_of(folder),
        figure=figure_of(name),
        title=said["title"],
        text="" if quick else said["text"],
        compared=said["Compared"],
        measure=said["Distance"],
        verdicts={} if quick else {VERDICTS[name]: said[name] for name in VERDICTS if name in said},
        distance=float(distance),
        unit=unit,
        within=float(within),
        picture=picture,
        numbers=dict(numbers),
        checked=tuple(claims),
        quick=quick,
    )


def sections(doc: str) -> dict[str, str]:
    """A docstring in parts: "title" (its first line), "text", and what follows each of SECTIONS."""
    title, _, rest = cleandoc(doc).partition("\n")
    found = {"title": title.rstrip("."), "text": ""}
    at = "text"
    for paragraph in re.split(r"\n\s*\n|\n(?=[A-Z][a-z]+:)", rest):
        name, colon, body = paragraph.strip().partition(":")
        at, body = (name, body) if colon and name in SECTIONS else (at, paragraph)
        found[at] = f"{found.get(at, '')}\n\n{' '.join(body.split())}".strip()
    return found


def figure_of(name: str) -> str:
    """The figure that a function is named after: fig_07_... is Figure 7, fig_3_2_... Figure 3.2."""
    match = SCRIPT.fullmatch(name)
    if match is None:
        raise ValueError(f"gallery: expected a function fig_07_what_it_shows, got {name}")
    return "Figure " + ".".join(str(int(part)) for part in match.groups() if part)


def paper_of(folder: str) -> str:
    """Authors and title: the first paragraph of the folder's docstring."""
    doc = cleandoc(import_module(folder).__doc__ or "")
    return " ".join(doc.split("\n\n")[0].split()).rstrip(".")


def note_of(folder: str) -> str:
    """Inventions for all figures of a paper: the rest of the folder's docstring."""
    _, _, rest = cleandoc(import_module(folder).__doc__ or "").partition("\n\n")
    return " ".join(rest.split())


@cache
def scripts() -> dict[str, str]:
    """Name of every plate, such as self_tuning/fig_07_shape_factor -> its module."""
    found = {
        f"{path.parent.name}/{name}": f"symfric.gallery.{path.parent.name}.{path.stem}"
        for path in Path(__file__).parent.glob("*/*.py")
        for name in re.findall(r"^def (fig_\w+)\(", path.read_text("utf-8"), re.M)
    }
    return dict(sorted(found.items()))


def script(name: str) -> Callable[..., Plate]:
    """The function that computes the plate `name`, of which only its module is imported."""
    return getattr(import_module(scripts()[name]), name.rpartition("/")[2])


def plates() -> dict[str, Callable[..., Plate]]:
    """Every figure of the gallery: name -> function (quick=False) that computes it.

    With `quick` it is computed in a second at most: shorter, coarser, or with fewer laws.
    """
    return {name: script(name) for name in scripts()}


def short(name: str) -> str:
    """A name without what the figure shows, such as self_tuning/fig_07; `chosen` takes it, too."""
    return re.sub(r"(fig_\d+(?:_\d+(?=_))?)_.*", r"\1", name)


def chosen(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of all plates that begin with one of `names`, in the order of the gallery; () is all.

    A figure without its paper, such as fig_07 or fig_7, is that of every paper that has one.

    Raises:
        ValueError: a name that begins none.
    """
    known, names = [*scripts()], tuple(name.rstrip("/") for name in names)
    found = {name: beginning(known, name) for name in names}
    wrong = [name for name, hits in found.items() if not hits]
    folders = dict.fromkeys(name.partition("/")[0] for name in known)
    check_names("gallery", wrong, [*folders, *map(short, known)])
    wanted = {hit for hits in found.values() for hit in hits} or {*known}
    return tuple(name for name in known if name in wanted)


def beginning(known: list[str], start: str) -> list[str]:
    """Names that begin with `start`; fig_7 is fig_07."""
    full = re.sub(r"fig_(\d)(?=_[^\d]|$)", r"fig_0\1", start)
    return [name for name in known if name == start or begins(name, start) or begins(name, full)]


def begins(name: str, start: str) -> bool:
    """Test for `start` as the first words of a plate's name; fig_1 does not begin fig_10."""
    stem = name.rpartition("/")[2]
    return any(f"{one}/".startswith((f"{start}_", f"{start}/")) for one in (name, stem))


def about(name: str) -> dict[str, str]:
    """Texts of a plate, without computing it: paper, figure, title, sections."""
    folder, said = scripts()[name].rpartition(".")[0], sections(script(name).__doc__ or "")
    figure = figure_of(name.rpartition("/")[2])
    return {"paper": paper_of(folder), "note": note_of(folder), "figure": figure} | said
