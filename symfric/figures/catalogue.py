"""All figures by name, and several laws under the same excitation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol, TypeVar

from symfric.figures.data import NORMAL_FORCE, Curve, FigureData, Scales, check_any, scales
from symfric.figures.pushing import break_away, drift, stiction
from symfric.figures.sliding import (
    dwell,
    hysteresis,
    lag,
    profile,
    steady_state,
    sweep_b,
    sweep_c,
    sweep_e,
    transition,
    velocity_step,
)
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, distinct
from symfric.foundation.status import SolveError
from symfric.integrator import Input, simulate
from symfric.laws import AnyLaw, Law, Population, any_from_text, law_name, steady_inputs
from symfric.laws.base.law import check_law
from symfric.model.kinds import ENERGY
from symfric.results.kinds import main
from symfric.results.trajectory import Trajectory
from symfric.scenes import ALL_SCENES


class MakeFigure(Protocol):
    """Function that makes a figure of a law."""

    def __call__(self, law: AnyLaw, N: float = ..., given: Scales | None = None) -> FigureData:
        """Return the figure of `law` under `N` [N], with its own magnitudes or those `given`."""
        ...


FIGURES: dict[str, MakeFigure] = {
    "profile": profile,
    "sweep_b": sweep_b,
    "sweep_c": sweep_c,
    "sweep_e": sweep_e,
    "hysteresis": hysteresis,
    "lag": lag,
    "transition": transition,
    "velocity_step": velocity_step,
    "stiction": stiction,
    "dwell": dwell,
    "drift": drift,
    "break_away": break_away,
    "steady_state": steady_state,
}
"""Every figure by the name the command line uses."""


def figure(law: AnyLaw, name: str, N: float = NORMAL_FORCE) -> FigureData:
    """Return the figure `name` of `law` under the normal force `N` [N], with the excitation of the
    papers.

    The functions of the same names take more options.

    Raises:
        ValueError: unknown name (the closest one is offered), a law that cannot show it, something
            else than a law and a name.
        SolveError: a simulation behind it failed.
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
"""Signals of a kind that are drawn at most, of energies the sum; all of them are columns."""


def in_scene(law: AnyLaw, scene: str) -> Trajectory:
    """Return the run of `scene` with `law`, over the time that shows what it is about.

    Raises:
        ValueError: a population of contacts, a law that the scene refuses.
        SolveError: the simulation failed.
    """
    if isinstance(law, Population):
        raise ValueError(
            f"{scene} with {law_name(law)}: expected a law with equations, got a population of "
            "random contacts; it has figures"
        )
    check_law(scene, law)
    kind = ALL_SCENES[scene]
    inputs: dict[str, Input] = {name: given.function for name, given in kind.inputs.items()}
    return simulate(kind(law).model(), kind.t_end, u=inputs)


def scene_figure(scene: str, runs: Mapping[str, Trajectory]) -> FigureData:
    """Return the signals that `runs` (legend entry -> run of `scene`) share.

    Columns t [s] and the shared signals; a curve for each run. Drawn are positions, friction and
    energy or power.
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
    """Overlay `laws` on the excitation of one `scenario`.

    Args:
        laws: laws or their names, or legend entry -> law.
        scenario: a figure (profile, hysteresis, lag, ...), or a scene (rabinowicz, drive, ...). All
            laws get the amplitudes that the figure takes from the first one, so put the law whose
            scales matter first.
        N: normal force [N] of a figure; a scene has its own.

    Returns:
        One curve per law and case, each under the name of its law. Laws that cannot show it, or
        whose simulation failed, are left out, and `note` says why.

    Raises:
        ValueError: no law, unknown scenario, no law that can show it.
        SolveError: the simulations of all failed.
    """
    check_names("compare: scenario", [scenario], [*FIGURES, *ALL_SCENES])
    named = _named(laws)
    first = next(iter(named.values()))
    if scenario in ALL_SCENES:
        able, note = _able(named, lambda law: in_scene(law, scenario))
        return replace(scene_figure(scenario, able), note=note)
    given = scales(first, N)
    able, note = _able(named, lambda law: FIGURES[scenario](law, N, given))
    shown = [data.named(name) for name, data in able.items()]
    title = _title([named[name] for name in able], shown)
    curves = tuple(curve for one in shown for curve in one.curves)
    said = "; ".join(text for text in (shown[0].note, note) if text)
    return replace(shown[0], title=title, curves=curves, note=said)


Result = TypeVar("Result")


def _able(
    laws: Mapping[str, AnyLaw], make: Callable[[AnyLaw], Result]
) -> tuple[dict[str, Result], str]:
    """Results of `make` for each law that can, and a note which were left out and why.

    Raises:
        ValueError, SolveError: those of the first law, where none can.
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
    """Return the expectation alone of an error message."""
    start = text.find("expected ")
    return text[max(start, 0) :].split("; ")[0].split(", got ")[0]


def _title(laws: Sequence[AnyLaw], shown: Sequence[FigureData]) -> str:
    """Return the title of the first, with the further inputs of all that say theirs."""
    inputs = [steady_inputs(law) for law in laws]
    said = [text for text, data in zip(inputs, shown, strict=True) if data.title.endswith(text)]
    return shown[0].title.removesuffix(inputs[0]) + "".join(dict.fromkeys(said))


def _named(laws: Sequence[AnyLaw | str] | Mapping[str, AnyLaw]) -> dict[str, AnyLaw]:
    """Return the laws by legend entry; laws of one kind are numbered."""
    if isinstance(laws, Mapping):
        found = dict(laws)
    else:
        given = checks.many("compare", laws, "laws or their names, such as ['lugre', 'gms']")
        each = [any_from_text(law) if isinstance(law, str) else law for law in given]
        for law in each:
            check_any("compare", law)
        names = [name for (name,) in distinct([[law_name(law)] for law in each])]
        found = dict(zip(names, each, strict=True))
    if not found:
        raise ValueError("compare: expected at least one law, got none")
    for law in found.values():
        check_any("compare", law)
    return found
