"""Laws with internal states."""

from symfric.laws.base import Law
from symfric.laws.dynamic.dahl import Dahl as Dahl
from symfric.laws.dynamic.elasto_plastic import ElastoPlastic as ElastoPlastic
from symfric.laws.dynamic.gms import GMS as GMS
from symfric.laws.dynamic.gms import Element as Element
from symfric.laws.dynamic.lugre import LuGre as LuGre
from symfric.laws.dynamic.lugre import LuGreNormalised as LuGreNormalised
from symfric.laws.dynamic.lugre import LuGrePassive as LuGrePassive
from symfric.laws.dynamic.maxwell_slip import MaxwellSlip as MaxwellSlip
from symfric.laws.dynamic.maxwell_slip import Slider as Slider

DYNAMIC_LAWS: dict[str, type[Law]] = {
    "dahl": Dahl,
    "lugre": LuGre,
    "lugre_normalised": LuGreNormalised,
    "lugre_passive": LuGrePassive,
    "elasto_plastic": ElastoPlastic,
    "maxwell_slip": MaxwellSlip,
    "gms": GMS,
}
"""Every law with states that stands alone, by name."""
