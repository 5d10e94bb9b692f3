"""Predefined machines by name."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, TypeVar, final

from symfric.scenes.base import Scene

if TYPE_CHECKING:
    from symfric.scenes.linkages import MechanismScene

S = TypeVar("S", bound=Scene, covariant=True)


@final
class Catalogue(Mapping[str, type[S]]):
    """Scenes by name; the module of a scene is imported at its first use."""

    def __init__(self, places: Mapping[str, str]) -> None:
        self._places = dict(places)

    def __getitem__(self, name: str) -> type[S]:
        module, kind = self._places[name].split()
        return getattr(import_module(f"symfric.scenes.{module}"), kind)

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def __contains__(self, name: object) -> bool:
        return name in self._places


_MECHANISMS = {
    "pendulum": "linkages Pendulum",
    "double_pendulum": "linkages DoublePendulum",
    "pendulum_box": "linkages PendulumBox",
    "four_mass": "spatial FourMass",
    "slider_crank": "linkages SliderCrank",
    "four_bar": "linkages FourBar",
    "arm": "spatial Arm",
}
MECHANISMS: "Catalogue[MechanismScene]" = Catalogue(_MECHANISMS)
"""Scenes that are mechanisms with friction in their joints, by name."""

ALL_SCENES: Catalogue[Scene] = Catalogue(
    {
        "rabinowicz": "blocks Rabinowicz",
        "drive": "blocks Drive",
        "quarter_car": "rigs QuarterCar",
        "coupled_blocks": "blocks CoupledBlocks",
        "drill_string": "rotating DrillString",
        "clutch": "rotating Clutch",
        "nip": "rotating Nip",
        "prescribed": "rigs Prescribed",
        **_MECHANISMS,
    }
)
"""Scenes by their name on the command line."""
