"""Several laws under the same excitation."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from symfric.figures.catalogue import FIGURES
from symfric.figures.data import FigureData
from symfric.figures.requirements import check_any
from symfric.figures.scales import NORMAL_FORCE, scales
from symfric.figures.scene import scene_figure
from symfric.foundation import checks
from symfric.foundation.parameters import check_names, distinct
from symfric.laws import AnyLaw, Law, Population, any_from_text, law_name, steady_inputs
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
        One curve per law and case, each under the name of its law.

    Raises:
        ValueError: no law, unknown scenario, a law that cannot show it.
        SolveError: a simulation failed.
    """
    check_names("compare: scenario", [scenario], [*FIGURES, *ALL_SCENES])
    named = _named(laws)
    if scenario in ALL_SCENES:
        references = [name for name, law in named.items() if isinstance(law, Population)]
        if references:
            raise ValueError(
                f"compare: expected laws with equations in the scene {scenario}, got "
                f"{', '.join(references)}, a population of random contacts; it has figures"
            )
        machines = {name: law for name, law in named.items() if isinstance(law, Law)}
        return scene_figure(machines, scenario)
    given = scales(next(iter(named.values())), N)
    shown = [FIGURES[scenario](law, N, given).named(name) for name, law in named.items()]
    title = _title(list(named.values()), shown)
    return replace(
        shown[0], title=title, curves=tuple(curve for one in shown for curve in one.curves)
    )


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
