"""Several laws under the same excitation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from symfric.figures.catalogue import FIGURES
from symfric.figures.data import FigureData
from symfric.figures.requirements import check_any
from symfric.figures.scales import NORMAL_FORCE, scales
from symfric.figures.scene import in_scene, scene_figure
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, distinct
from symfric.foundation.status import SolveError
from symfric.laws import AnyLaw, any_from_text, law_name, steady_inputs
from symfric.scenes import ALL_SCENES


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
    """What `make` makes of each law that can, and a note which were left out and why.

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
    """What was expected, without who was asked and what there is instead."""
    start = text.find("expected ")
    return text[max(start, 0) :].split("; ")[0].split(", got ")[0]


def _title(laws: Sequence[AnyLaw], shown: Sequence[FigureData]) -> str:
    """The title of the first, with the further inputs of all that say theirs."""
    inputs = [steady_inputs(law) for law in laws]
    said = [text for text, data in zip(inputs, shown, strict=True) if data.title.endswith(text)]
    return shown[0].title.removesuffix(inputs[0]) + "".join(dict.fromkeys(said))


def _named(laws: Sequence[AnyLaw | str] | Mapping[str, AnyLaw]) -> dict[str, AnyLaw]:
    """The laws by legend entry; laws of one kind are numbered."""
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
