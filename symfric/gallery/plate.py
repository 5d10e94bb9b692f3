"""A plate: one figure of a paper computed again, and how far we are from it."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from inspect import cleandoc
from math import isfinite
from pathlib import Path
from sys import modules
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
"""Section of a docstring -> kind of verdict on what the paper says; a script has one at least."""
SECTIONS = ("Compared", "Distance", *VERDICTS)
"""What the docstring of a script says under these words."""
SCRIPT = re.compile(r"fig_(\d+)(?:_(\d+))?_\w+")


@final
@dataclass(frozen=True, eq=False, repr=False)
class Plate(Showing):
    """One figure of a paper, computed again.

    The texts are said once, in the docstrings of the script and of its folder.

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
        distance: how far we are, in `unit`; computed by the script, and `within` at most.
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
        told = (
            self.paper,
            f"compared: {self.compared}",
            f"how far: {self.how_far}; {self.measure}",
            *(f"{kind}: {text}" for kind, text in self.verdicts.items()),
            *(f"checked: {'; '.join(self.checked)}" for _ in self.checked[:1]),
        )
        lines = tuple(line for text in told for line in wrap(text, 98, subsequent_indent="  "))
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


def plate_of(
    script: str,
    picture: Figure,
    distance: float,
    unit: str,
    numbers: Mapping[str, float],
    claims: Mapping[str, Any],
    *,
    within: float,
    quick: bool,
) -> Plate:
    """The plate of a script, its texts taken from the docstrings.

    Args:
        script: `__name__` of the script; its folder names the paper.
        picture: the figure.
        distance: how far we are.
        unit: of the distance; "1" for a ratio.
        numbers: what the verdicts stand on.
        claims: sentence -> whether the numbers bear it out. At reduced size these sentences are
            all that is said; a plate whose text is untrue is not drawn.
        within: the largest distance of a figure that is computed again; for the error of two
            integrations four times what one machine gave, since steps depend on rounding.
        quick: whether it is computed at reduced size.

    Raises:
        ValueError: a docstring without one of its sections, numbers that are not finite, a distance
            beyond its bound, a claim that does not hold.
    """
    said = sections(modules[script].__doc__ or "")
    missing = [name for name in ("title", "Compared", "Distance") if not said.get(name)]
    missing += [" or ".join(VERDICTS)] * (not said.keys() & VERDICTS.keys())
    if missing:
        raise ValueError(
            f"gallery '{script}': expected a docstring with {', '.join(missing)}, got none"
        )
    odd = [name for name, v in {"distance": distance, **numbers}.items() if not isfinite(v)]
    if odd:
        raise ValueError(f"gallery '{script}': expected finite numbers, got {', '.join(odd)}")
    untrue = [f"'{sentence}'" for sentence, holds in claims.items() if not holds]
    if distance > within:
        untrue.append(f"a distance within {within:.2g} {unit}, {distance:.3g}")
    if untrue:
        raise ValueError(
            f"gallery '{script}': expected numbers that bear out its text, got others for "
            f"{', '.join(untrue)}; correct the text, or find what has changed"
        )
    folder, _, name = script.rpartition(".")
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
    """The figure that a script is named after: fig_07_... is Figure 7, fig_3_2_... Figure 3.2."""
    match = SCRIPT.fullmatch(name)
    if match is None:
        raise ValueError(f"gallery: expected a script named fig_07_what_it_shows, got {name}")
    return "Figure " + ".".join(str(int(part)) for part in match.groups() if part)


def paper_of(folder: str) -> str:
    """Authors and title: the first paragraph of the folder's docstring."""
    doc = cleandoc(import_module(folder).__doc__ or "")
    return " ".join(doc.split("\n\n")[0].split()).rstrip(".")


def note_of(folder: str) -> str:
    """What was invented for all figures of a paper: what follows in the folder's docstring."""
    _, _, rest = cleandoc(import_module(folder).__doc__ or "").partition("\n\n")
    return " ".join(rest.split())


@cache
def scripts() -> dict[str, str]:
    """Name of every plate, such as self_tuning/fig_07_shape_factor -> its module."""
    here = Path(__file__).parent
    found = [path for path in sorted(here.glob("*/fig_*.py")) if SCRIPT.fullmatch(path.stem)]
    return {
        f"{path.parent.name}/{path.stem}": f"symfric.gallery.{path.parent.name}.{path.stem}"
        for path in found
    }


def plates() -> dict[str, Callable[..., Plate]]:
    """Every figure of the gallery: name -> function `plate(quick=False)` that computes it.

    With `quick` it is computed in a second at most: shorter, coarser, or with fewer laws.
    """
    return {name: import_module(module).plate for name, module in scripts().items()}


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
    """Those that begin with `start`; fig_7 is fig_07."""
    full = re.sub(r"fig_(\d)(?=_[^\d]|$)", r"fig_0\1", start)
    return [name for name in known if name == start or begins(name, start) or begins(name, full)]


def begins(name: str, start: str) -> bool:
    """Whether `start` is the first words of a plate's name; fig_1 does not begin fig_10."""
    stem = name.rpartition("/")[2]
    return any(f"{one}/".startswith((f"{start}_", f"{start}/")) for one in (name, stem))


def about(name: str) -> dict[str, str]:
    """What the docstrings say of a plate, without computing it: paper, figure, title, sections."""
    module = scripts()[name]
    folder, _, stem = module.rpartition(".")
    said = sections(import_module(module).__doc__ or "")
    return {"paper": paper_of(folder), "note": note_of(folder), "figure": figure_of(stem)} | said
