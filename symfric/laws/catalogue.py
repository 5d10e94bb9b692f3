"""Every law that stands alone, by the name that a user types."""

from symfric.laws.base.law import Law
from symfric.laws.dynamic.armstrong import Armstrong
from symfric.laws.dynamic.bliman_sorine import BlimanSorine
from symfric.laws.dynamic.bouc_wen import BoucWen
from symfric.laws.dynamic.bristle_2d import Bristle2D
from symfric.laws.dynamic.dahl import Dahl
from symfric.laws.dynamic.elasto_plastic import ElastoPlastic
from symfric.laws.dynamic.exact_coulomb import ExactCoulomb
from symfric.laws.dynamic.gms import GMS
from symfric.laws.dynamic.gonthier import Gonthier
from symfric.laws.dynamic.haessig_friedland import HaessigFriedland
from symfric.laws.dynamic.leuven import Leuven
from symfric.laws.dynamic.lugre import LuGre, LuGreNormalised, LuGrePassive
from symfric.laws.dynamic.maxwell_slip import MaxwellSlip
from symfric.laws.dynamic.rate_and_state import RateAndState
from symfric.laws.dynamic.stick_slip import StickSlip
from symfric.laws.static.applied_force import Awrejcewicz, Karnopp, LeineSwitch, Wojewoda
from symfric.laws.static.brown_mcphee import BrownMcPhee
from symfric.laws.static.coulomb import Coulomb, PowerLawViscous, Viscous
from symfric.laws.static.exponential import (
    Andersson,
    Benson,
    Berger,
    DuanSingh,
    SteadyStateLuGre,
    Tustin,
)
from symfric.laws.static.falling import Lorentzian, PoppStelter
from symfric.laws.static.joints import BAM, Bittencourt, Capstan
from symfric.laws.static.piecewise import (
    Ambrosio,
    BengisuAkay,
    Exudyn,
    Hollars,
    Step5,
    VelocityBased,
)
from symfric.laws.static.quarter_car import QuarterCarGeneral, QuarterCarSimple
from symfric.laws.static.rui_wang import RuiWang
from symfric.laws.static.self_tuning import BrittleSelfTuning, SelfTuning
from symfric.laws.static.smooth_peak import MakkarDixon, SimscapeBreakaway, Specker
from symfric.laws.static.stribeck import Stribeck
from symfric.laws.static.threlfall import ModifiedThrelfall, Threlfall

STATIC_LAWS: dict[str, type[Law]] = {
    "coulomb": Coulomb,
    "viscous": Viscous,
    "power_law_viscous": PowerLawViscous,
    "stribeck": Stribeck,
    "tustin": Tustin,
    "lorentzian": Lorentzian,
    "steady_state_lugre": SteadyStateLuGre,
    "brown_mcphee": BrownMcPhee,
    "simscape_breakaway": SimscapeBreakaway,
    "specker": Specker,
    "self_tuning": SelfTuning,
    "brittle_self_tuning": BrittleSelfTuning,
    "rui_wang": RuiWang,
    "threlfall": Threlfall,
    "modified_threlfall": ModifiedThrelfall,
    "bengisu_akay": BengisuAkay,
    "velocity_based": VelocityBased,
    "ambrosio": Ambrosio,
    "hollars": Hollars,
    "exudyn": Exudyn,
    "step5": Step5,
    "benson": Benson,
    "andersson": Andersson,
    "duan_singh": DuanSingh,
    "berger": Berger,
    "popp_stelter": PoppStelter,
    "makkar_dixon": MakkarDixon,
    "karnopp": Karnopp,
    "awrejcewicz": Awrejcewicz,
    "leine_switch": LeineSwitch,
    "wojewoda": Wojewoda,
    "quarter_car_general": QuarterCarGeneral,
    "quarter_car_simple": QuarterCarSimple,
    "bittencourt": Bittencourt,
    "bam": BAM,
    "capstan": Capstan,
}
"""Memoryless laws by name, the widely used ones first."""

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

ALL_LAWS: dict[str, type[Law]] = {**STATIC_LAWS, **DYNAMIC_LAWS}
"""Every law that stands alone, by name; the contract tests run over them."""
