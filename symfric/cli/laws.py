"""`symfric laws`: list the friction laws, or show one in full."""

from dataclasses import asdict
from functools import partial
from inspect import getdoc
from pathlib import Path
from typing import Annotated, Any

from symfric import ALL_LAWS, parameters
from symfric.cli import completions, output
from symfric.cli import options as opt
from symfric.cli.options import argument, option
from symfric.figures import FIGURES, FigureData, compare
from symfric.figures.data import parts, phenomena
from symfric.figures.motion import NORMAL_FORCE
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, options
from symfric.laws import PHENOMENA, POPULATIONS, AnyLaw, Population
from symfric.laws.catalogue import ALIASES
from symfric.laws.composed.populations import cost
from symfric.scenes import ALL_SCENES


def laws(
    name: Annotated[
        str | None, argument("NAME", "One law, such as lugre.", completions.all_laws)
    ] = None,
    settings: opt.SetOption = None,
    plot: opt.PlotOption = None,
    figure: Annotated[
        str | None,
        option("--figure FIGURE", f"Behaviour: {', '.join(FIGURES)}.", completions.figures),
    ] = None,
    others: Annotated[
        list[str] | None,
        option("--compare LAW", "Overlay another law; may be repeated.", completions.all_laws),
    ] = None,
    normal_force: Annotated[
        float | None,
        option("--normal-force NUMBER", "Normal force [N]; default 1, and 7.848 for --figure."),
    ] = None,
    json: opt.JsonOption = None,
) -> None:
    """List the friction laws, or show one in full.

    In full: equation, limits, source, parameters with units and bounds, and a picture. --figure
    and --compare show its behaviour instead, computed as in the papers; --figure also accepts
    scenes such as rabinowicz. --set then applies to every law, and --set gms.C=10 to one of them.

    Example: symfric laws gms --figure hysteresis --compare lugre --plot loops.png
    """
    opt.check_outputs(json, picture=plot)
    if normal_force is not None:
        checks.number("--normal-force", normal_force, unit="N", above=0.0)
    if figure is not None or others:
        behaviour(name, settings, figure, others or [], normal_force, plot, json)
        return
    every = [name] if name else [*ALL_LAWS, *POPULATIONS]
    chosen = {text: opt.any_with(text, settings if name else None) for text in every}
    if settings and not name:
        raise ValueError("--set: expected the name of a law before it, got none")
    if plot:
        from symfric.figures.pictures import plot_catalogue, plot_laws  # noqa: PLC0415  (matplotlib is slow)

        draw = plot_laws if name else plot_catalogue
        load = 1.0 if normal_force is None else normal_force
        draw(chosen, load, plot)
    described = [{"name": text, **to_dict(law)} for text, law in chosen.items()]
    show = partial(show_law, name, chosen[name]) if name else partial(show_list, chosen)
    output.finish(described[0] if name else {"laws": described}, json, show, plot)


def behaviour(
    name: str | None,
    settings: list[str] | None,
    figure: str | None,
    others: list[str],
    normal_force: float | None,
    plot: Path | None,
    json: str | None,
) -> None:
    """Compute a figure of one or several laws; write, draw or summarise it."""
    if not name:
        raise ValueError("--figure, --compare: expected the name of a law before it, got none")
    scenario = "profile" if figure is None else figure
    check_names("--figure", [scenario], [*FIGURES, *ALL_SCENES])
    load = NORMAL_FORCE if normal_force is None else normal_force
    chosen = opt.all_with([name, *others], settings)
    with output.progress(f"{scenario} of {', '.join([name, *others])}"):
        data = compare(chosen, scenario, load)
    if plot:
        data.plot(plot)
    output.finish(data.to_dict(), json, partial(show_figure, data), plot)


def show_figure(data: FigureData) -> None:
    """Print the range of every column that is drawn, for each curve."""
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
    return {
        "title": title(law),
        "phenomena": {code: PHENOMENA[code] for code in phenomena(law)},
        "states": {state.name: state.unit for state in law.states},
        "smoothness": law.facts.smoothness,
        "confidence": law.facts.confidence,
        "checked": law.facts.checked,
        "source": law.facts.source,
        "warnings": list(law.warnings()),
        "odd": law.facts.odd,
        "load": law.facts.load,
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
    """Return the quantity whose cost in instructions is reported."""
    return "a step of one contact" if isinstance(law, Population) else "force and rate"


def title(law: AnyLaw) -> str:
    """Return the first line of the docstring."""
    return (getdoc(type(law)) or "").partition("\n")[0].removesuffix(".")


def show_list(chosen: dict[str, AnyLaw]) -> None:
    """Print all laws, one per line, and the meaning of the codes."""
    output.show_table(
        ["law", "shows", "z", "value", "slope", "formula"],
        [
            (
                name,
                " ".join(phenomena(law)),
                f"{len(law.states)} {law.facts.smoothness.split()[0].removesuffix('-valued')}",
                cost(law).value,
                cost(law).gradient,
                law.facts.confidence,
            )
            for name, law in chosen.items()
        ],
    )
    codes = "\n".join(f"  {code:<3} {meaning}" for code, meaning in PHENOMENA.items())
    others = ", ".join(f"{alias} = {name}" for alias, name in ALIASES.items())
    output.show(
        f"\nshows:\n{codes}\n"
        "z: number of states, then smoothness (set: set-valued)\n"
        "value, slope: CasADi instructions for force and rate, and for their derivatives\n"
        "formula: verification of the formula; unverified: written from memory\n"
        "symfric laws NAME shows equation, parameters and more;\n"
        f"symfric laws NAME --figure draws {', '.join(FIGURES)}.\n"
        f"Other names: {others}.\n"
        "Sums are written coulomb+viscous, wrappers asymmetric(lugre), load_dependent(lugre),\n"
        "lagged(stribeck), temperature_dependent(lugre)."
    )


def show_law(name: str, law: AnyLaw) -> None:
    """Print docstring, properties and parameters of one law."""
    for part in parts(law):
        output.show_doc(getdoc(part) or "")
    shown = ", ".join(PHENOMENA[code] for code in phenomena(law))
    output.show(
        f"{name} shows {shown}.\n"
        f"Smoothness: {law.facts.smoothness}.\nFormula: {law.facts.formula}.\n"
        f"Cost: {cost(law).value} CasADi instructions for {costs(law)}, "
        f"{cost(law).gradient} for their derivatives.\n"
    )
    for warning in law.warnings():
        output.show(f"Warning: {warning}.\n")
    if law.inputs:
        output.show_table(
            ["input", "unit", "meaning"], [(i.name, i.unit, i.doc) for i in law.inputs]
        )
        output.show()
    if options(law):
        output.show_table(
            ["option", "value", "choices", "meaning"],
            [(o.name, o.value, ", ".join(o.choices), o.doc) for o in options(law).values()],
        )
        output.show()
    output.show_table(
        ["parameter", "value", "unit", "lower", "upper", "meaning"],
        [
            (p.name, float(p.value), p.unit, p.lower, p.upper, p.doc)
            for p in parameters(law).values()
        ],
        digits=output.EXACT,
    )
