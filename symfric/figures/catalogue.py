"""Figures by name, and comparisons of several laws under the same excitation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from symfric.figures import pushing, sliding  # noqa: F401  # pyright: ignore[reportUnusedImport]  (they fill FIGURES)
from symfric.figures.data import FIGURES, Curve, FigureData, check_any
from symfric.figures.motion import NORMAL_FORCE, scales
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, distinct
from symfric.foundation.status import SolveError
from symfric.integrator import Input, Trajectory, simulate
from symfric.laws import AnyLaw, Law, Population, any_from_text, law_name, steady_inputs
from symfric.laws.base.law import require_law
from symfric.model.kinds import ENERGY
from symfric.results.kinds import main
from symfric.scenes import ALL_SCENES


def figure(law: AnyLaw, name: str, N: float = NORMAL_FORCE) -> FigureData:
    """Return the figure `name` of `law` at the normal force `N` [N].

    The function of the same name has further options.

    Raises:
        ValueError: unknown name (the message suggests the closest), a law that cannot show this
            behaviour, or arguments that are not a law and a name.
        SolveError: a simulation failed.
    """
    if isinstance(law, str) and isinstance(name, Law | Population):
        raise ValueError(
            f"figure: expected a law and then the name of a figure, got {law!r} and then a law; "
            f"write figure(law, {law!r})"
        )
    check_any("figure", law)
    checks.check_names("figure", [checks.text("figure: name", name)], FIGURES)
    return FIGURES[name](law, N)


PANELS = 2
"""Largest number of drawn signals of a kind; of energies only the sum is drawn."""


def in_scene(law: AnyLaw, scene: str) -> Trajectory:
    """Return the run of `scene` with `law` over its default time.

    Raises:
        ValueError: a population of contacts, or a law that the scene rejects.
        SolveError: the simulation failed.
    """
    if isinstance(law, Population):
        raise ValueError(
            f"{scene} with {law_name(law)}: expected a law with equations, got a population of "
            "random contacts; it has figures"
        )
    require_law(scene, law)
    kind = ALL_SCENES[scene]
    inputs: dict[str, Input] = {name: given.function for name, given in kind.inputs.items()}
    return simulate(kind(law).model(), kind.t_end, u=inputs)


def scene_figure(scene: str, runs: Mapping[str, Trajectory]) -> FigureData:
    """Return the figure of the common signals of `runs` of a scene, given by legend entry.

    The columns are t [s] and the common signals, and there is one curve per run. Positions,
    friction, and energy or power are drawn.
    """
    first = next(iter(runs.values()))
    shared = {n: u for n, u in first.units.items() if all(n in run.units for run in runs.values())}
    groups = main(first.model, shared)
    drawn = [
        name
        for group in groups
        for name in (list(group.names)[-1:] if group.title == ENERGY else [*group.names][:PANELS])
    ]
    return FigureData(
        scene,
        scene,
        {"t": "s"} | shared,
        tuple(("t", name) for name in drawn or [*shared][: 2 * PANELS]),
        tuple(
            Curve(label, "", {"t": run.t} | {name: run[name] for name in shared})
            for label, run in runs.items()
        ),
    )


def compare(
    laws: Sequence[AnyLaw | str] | Mapping[str, AnyLaw],
    scenario: str = "profile",
    N: float = NORMAL_FORCE,
) -> FigureData:
    """Compare `laws` under the same excitation.

    Args:
        laws: laws or names of laws; or laws by legend entry.
        scenario: name of a figure (profile, hysteresis, lag, ...) or of a scene (rabinowicz,
            drive, ...). The first law determines the amplitudes of a figure.
        N: normal force [N] of a figure; a scene has its own normal force.

    Returns:
        Figure with one curve per law and case, labelled with the name of the law. `note` lists the
        laws that are omitted, because they cannot show the behaviour or their simulation failed.

    Raises:
        ValueError: no law, unknown scenario, or no law that can show the behaviour.
        SolveError: all simulations failed.
    """
    check_names("compare: scenario", [scenario], [*FIGURES, *ALL_SCENES])
    named = _named(laws)
    first = next(iter(named.values()))
    if scenario in ALL_SCENES:
        able, note = _able(named, lambda law: in_scene(law, scenario))
        return replace(scene_figure(scenario, able), note=note)
    given = scales(first, N)
    return together(named, lambda law: FIGURES[scenario](law, N, given))


def together(laws: Mapping[str, AnyLaw], make: Callable[[AnyLaw], FigureData]) -> FigureData:
    """Return one figure of `laws`, given by legend entry; its note lists those that `make` rejects.

    The title is that of the first law, completed by the further inputs of all laws.

    Raises:
        ValueError, SolveError: the error of the first law, if all laws failed.
    """
    able, note = _able(laws, make)
    shown = [data.named(name) for name, data in able.items()]
    inputs = [steady_inputs(laws[name]) for name in able]
    named = [text for text, data in zip(inputs, shown, strict=True) if data.title.endswith(text)]
    title = shown[0].title.removesuffix(inputs[0]) + "".join(dict.fromkeys(named))
    curves = tuple(curve for one in shown for curve in one.curves)
    notes = "; ".join(text for text in (shown[0].note, note) if text)
    return replace(shown[0], title=title, curves=curves, note=notes)


Result = TypeVar("Result")


def _able(
    laws: Mapping[str, AnyLaw], make: Callable[[AnyLaw], Result]
) -> tuple[dict[str, Result], str]:
    """Return the results of `make` by law, and a note on the laws for which it failed.

    Raises:
        ValueError, SolveError: the error of the first law, if all laws failed.
    """
    made: dict[str, Result] = {}
    refused: dict[str, ValueError | SolveError] = {}
    for name, law in laws.items():
        try:
            made[name] = make(law)
        except (ValueError, SolveError) as error:
            refused[name] = error
    if not made:
        raise next(iter(refused.values()))
    reasons: dict[str, list[str]] = {}
    for name, error in refused.items():
        reasons.setdefault(_reason(str(error)), []).append(name)
    return made, "; ".join(f"without {', '.join(who)}: {why}" for why, who in reasons.items())


def _reason(text: str) -> str:
    """Return the part of an error message that states what was expected."""
    start = text.find("expected ")
    return text[max(start, 0) :].split("; ")[0].split(", got ")[0]


def _named(laws: Sequence[AnyLaw | str] | Mapping[str, AnyLaw]) -> dict[str, AnyLaw]:
    """Return the laws by legend entry; laws of the same name are numbered."""
    if isinstance(laws, Mapping):
        names, every = [*laws], [*laws.values()]
    else:
        names, given = [], checks.many("compare", laws, "laws or names, such as ['lugre', 'gms']")
        every = [any_from_text(law) if isinstance(law, str) else law for law in given]
    if not every:
        raise ValueError("compare: expected at least one law, got none")
    for law in every:
        check_any("compare", law)
    names = names or [name for (name,) in distinct([[law_name(law)] for law in every])]
    return dict(zip(names, every, strict=True))
