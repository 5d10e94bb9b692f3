"""Laws with internal states."""

from symfric.laws.base.law import Law
from symfric.laws.dynamic.armstrong import Armstrong as Armstrong
from symfric.laws.dynamic.bliman_sorine import BlimanSorine as BlimanSorine
from symfric.laws.dynamic.bouc_wen import BoucWen as BoucWen
from symfric.laws.dynamic.bristle_2d import Bristle2D as Bristle2D
from symfric.laws.dynamic.dahl import Dahl as Dahl
from symfric.laws.dynamic.elasto_plastic import ElastoPlastic as ElastoPlastic
from symfric.laws.dynamic.exact_coulomb import ExactCoulomb as ExactCoulomb
from symfric.laws.dynamic.gms import GMS as GMS
from symfric.laws.dynamic.gms import Element as Element
from symfric.laws.dynamic.gonthier import Gonthier as Gonthier
from symfric.laws.dynamic.haessig_friedland import HaessigFriedland as HaessigFriedland
from symfric.laws.dynamic.leuven import Leuven as Leuven
from symfric.laws.dynamic.lugre import LuGre as LuGre
from symfric.laws.dynamic.lugre import LuGreNormalised as LuGreNormalised
from symfric.laws.dynamic.lugre import LuGrePassive as LuGrePassive
from symfric.laws.dynamic.maxwell_slip import MaxwellSlip as MaxwellSlip
from symfric.laws.dynamic.maxwell_slip import Slider as Slider
from symfric.laws.dynamic.rate_and_state import RateAndState as RateAndState
from symfric.laws.dynamic.stick_slip import StickSlip as StickSlip

DYNAMIC_LAWS: dict[str, type[Law]] = {
    "dahl": Dahl,
    "bliman_sorine": BlimanSorine,
    "haessig_friedland": HaessigFriedland,
    "lugre": LuGre,
    "lugre_normalised": LuGreNormalised,
    "lugre_passive": LuGrePassive,
    "elasto_plastic": ElastoPlastic,
    "leuven": Leuven,
    "maxwell_slip": MaxwellSlip,
    "gms": GMS,
    "stick_slip": StickSlip,
    "gonthier": Gonthier,
    "bristle_2d": Bristle2D,
    "bouc_wen": BoucWen,
    "rate_and_state": RateAndState,
    "armstrong": Armstrong,
    "exact_coulomb": ExactCoulomb,
}
"""Every law with states that stands alone, by name."""
