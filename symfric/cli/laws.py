"""`symfric laws`: list the friction laws, or show one in full."""

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from inspect import getdoc
from pathlib import Path
from typing import Any

from symfric import ALL_LAWS, parameters
from symfric.cli import options as opt
from symfric.cli import output
from symfric.cli.app import TEXTS
from symfric.cli.options import Strings
from symfric.figures import FIGURES, FigureData, compare
from symfric.figures.data import parts, phenomena
from symfric.figures.motion import NORMAL_FORCE
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, options
from symfric.laws import PHENOMENA, POPULATIONS, AnyLaw, Population, check_law
from symfric.laws.catalogue import ALIASES
from symfric.laws.composed.populations import cost
from symfric.scenes import ALL_SCENES


def laws(
    name: str | None = None,
    settings: Strings = None,
    plot: Path | None = None,
    figure: str | None = None,
    others: Strings = None,
    normal_force: float | None = None,
    check: bool = False,
    json: str | None = None,
) -> None:
    """List the friction laws, or show one in full.

    A law in full has its equation, limits, source, parameters with units and bounds, and a picture.
    --figure and --compare show the behaviour of laws instead, computed as in the papers; --figure
    also accepts scenes such as rabinowicz. --set then applies to every law, and --set gms.C=10 to
    the law gms only. --check checks a law, such as FILE.py:NAME, numerically.

    Example: symfric laws gms --figure hysteresis --compare lugre --plot loops.png
    """
    opt.check_outputs(json, picture=plot)
    if normal_force is not None:
        checks.number("--normal-force", normal_force, unit="N", above=0.0)
    if not name and (figure is not None or others):
        raise ValueError("--figure, --compare: expected the name of a law before it, got none")
    if not name and settings:
        raise ValueError("--set: expected the name of a law before it, got none")
    if name and (figure is not None or others):
        scenario = "profile" if figure is None else figure
        check_names("--figure", [scenario], [*FIGURES, *ALL_SCENES])
        names = [name, *(others or ())]
        load = NORMAL_FORCE if normal_force is None else normal_force
        with output.progress(f"{scenario} of {', '.join(names)}"):
            data = compare(laws_with(names, settings), scenario, load)
        show = partial(show_figure, data)
        return output.finish(data.to_dict(), json, show, (plot, data.plot))
    texts = opt.assignments("--set", settings)
    if check:
        if not name:
            raise ValueError("--check: expected the name of a law before it, got none")
        report = check_law(opt.with_settings(opt.named_law(name), name, texts))
        content = {"law": name, "remarks": [one._asdict() for one in report.remarks]}
        show = partial(output.show_table, ["check", "result", "finding"], report.remarks)
        return output.finish(content, json, show)
    every = [name] if name else [*ALL_LAWS, *POPULATIONS]
    chosen = {text: opt.with_settings(opt.any_named_law(text), text, texts) for text in every}
    if plot:
        from symfric.figures.pictures import plot_catalogue, plot_laws  # noqa: PLC0415  (slow to import)

        draw = plot_laws if name else plot_catalogue
        draw(chosen, 1.0 if normal_force is None else normal_force, plot)
    described = [{"name": text, **to_dict(law)} for text, law in chosen.items()]
    show = partial(show_law, name, chosen[name]) if name else partial(show_list, chosen)
    content = described[0] if name else {"laws": described}
    return output.finish(content, json, show, (plot, None))


def laws_with(texts: Sequence[str], settings: Strings) -> list[AnyLaw]:
    """Return the laws `texts`, all with the parameters and options of `--set`.

    `LAW.NAME=VALUE` sets the parameter of one law only.

    Raises:
        ValueError: a name that one of the laws does not have.
    """
    made = {text: opt.any_named_law(text) for text in texts}
    chosen: dict[str, dict[str, str]] = {text: {} for text in texts}
    lacking: list[str] = []
    given = opt.assignments("--set", settings)
    for name in sorted(given, key=lambda name: "." in name):  # settings of one law come last
        only, _, own = name.rpartition(".")
        check_names(f"--set {name}", [only] if only else [], texts)
        for text in [only] if only else texts:
            chosen[text][own] = given[name]
            if not only and own not in {*parameters(made[text]), *options(made[text])}:
                lacking.append(f"{own}, which {text} does not have")
    if lacking and len(texts) > 1:
        raise ValueError(
            f"--set: expected what {' and '.join(texts)} all have, got {'; '.join(lacking)}; "
            f"--set {texts[0]}.NAME=VALUE is for one law"
        )
    return [opt.with_settings(made[text], text, chosen[text]) for text in texts]


def show_figure(data: FigureData) -> None:
    """Print the range of each column in the plot, for each curve."""
    drawn = list(dict.fromkeys(column for panel in data.panels for column in panel))
    rows = [
        (curve.label, name, data.units[name], float(curve[name].min()), float(curve[name].max()))
        for curve in data.curves
        for name in drawn
    ]
    output.show_table(["curve", "column", "unit", "least", "greatest"], rows, data.title)
    if data.note:
        output.show(f"{data.note}.")


def to_dict(law: AnyLaw) -> dict[str, Any]:
    """Return the content of `--json` for one law."""
    facts = law.facts
    return {
        "title": (getdoc(type(law)) or "").partition("\n")[0].removesuffix("."),
        "phenomena": {code: PHENOMENA[code] for code in phenomena(law)},
        "states": {state.name: state.unit for state in law.states},
        "smoothness": facts.smoothness,
        "confidence": facts.confidence,
        "checked": facts.checked,
        "source": facts.source,
        "warnings": list(law.warnings()),
        "odd": facts.odd,
        "load": facts.load,
        "instructions": asdict(cost(law)),
        "inputs": {i.name: {"unit": i.unit, "doc": i.doc} for i in law.inputs},
        "options": {o.name: asdict(o) for o in options(law).values()},
        "parameters": {
            p.name: {n: getattr(p, n) for n in ("value", "unit", "role", "lower", "upper", "doc")}
            for p in parameters(law).values()
        },
        "doc": "\n\n".join(getdoc(part) or "" for part in parts(law)),
    }


def costs(law: AnyLaw) -> str:
    """Return the name of the quantity whose cost in instructions is reported."""
    return "a step of one contact" if isinstance(law, Population) else "force and rate"


def show_list(chosen: dict[str, AnyLaw]) -> None:
    """Print all laws, one per line, and the meaning of the codes."""
    rows: list[tuple[str | float, ...]] = []
    for name, law in chosen.items():
        states = f"{len(law.states)} {law.facts.smoothness.split()[0].removesuffix('-valued')}"
        spent = cost(law).value, cost(law).gradient
        rows.append((name, " ".join(phenomena(law)), states, *spent, law.facts.confidence))
    output.show_table(["law", "shows", "z", "value", "slope", "formula"], rows)
    codes = "\n".join(f"  {code:<3} {meaning}" for code, meaning in PHENOMENA.items())
    others = ", ".join(f"{alias} = {name}" for alias, name in ALIASES.items())
    output.show(
        TEXTS["legends"]["laws"].format(codes=codes, figures=", ".join(FIGURES), others=others)
    )


def show_law(name: str, law: AnyLaw) -> None:
    """Print the docstring, the properties and the parameters of one law."""
    for part in parts(law):
        output.show_doc(getdoc(part) or "")
    output.show(
        f"Phenomena: {', '.join(PHENOMENA[code] for code in phenomena(law)) or 'not stated'}.\n"
        f"Smoothness: {law.facts.smoothness}.\nFormula: {law.facts.formula}.\n"
        f"Cost: {cost(law).value} CasADi instructions for {costs(law)}, "
        f"{cost(law).gradient} for their derivatives.\n"
    )
    for warning in law.warnings():
        output.show(f"Warning: {warning}.\n")
    choices = [(o.name, o.value, ", ".join(o.choices), o.doc) for o in options(law).values()]
    output.show_part(["input", "unit", "meaning"], [(i.name, i.unit, i.doc) for i in law.inputs])
    output.show_part(["option", "value", "choices", "meaning"], choices)
    output.show_table(
        ["parameter", "value", "unit", "lower", "upper", "meaning"],
        [
            (p.name, float(p.value), p.unit, p.lower, p.upper, p.doc)
            for p in parameters(law).values()
        ],
        digits=output.EXACT,
    )
