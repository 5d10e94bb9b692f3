"""Memoryless laws F(v, N): one family a file."""

from symfric.laws.base.law import Law
from symfric.laws.static.applied_force import Awrejcewicz as Awrejcewicz
from symfric.laws.static.applied_force import Karnopp as Karnopp
from symfric.laws.static.applied_force import LeineSwitch as LeineSwitch
from symfric.laws.static.applied_force import Wojewoda as Wojewoda
from symfric.laws.static.brown_mcphee import BrownMcPhee as BrownMcPhee
from symfric.laws.static.coulomb import Coulomb as Coulomb
from symfric.laws.static.coulomb import PowerLawViscous as PowerLawViscous
from symfric.laws.static.coulomb import Viscous as Viscous
from symfric.laws.static.exponential import Andersson as Andersson
from symfric.laws.static.exponential import Benson as Benson
from symfric.laws.static.exponential import Berger as Berger
from symfric.laws.static.exponential import DuanSingh as DuanSingh
from symfric.laws.static.exponential import SteadyStateLuGre as SteadyStateLuGre
from symfric.laws.static.exponential import Tustin as Tustin
from symfric.laws.static.falling import Lorentzian as Lorentzian
from symfric.laws.static.falling import PoppStelter as PoppStelter
from symfric.laws.static.joints import BAM as BAM
from symfric.laws.static.joints import Bittencourt as Bittencourt
from symfric.laws.static.joints import Capstan as Capstan
from symfric.laws.static.piecewise import Ambrosio as Ambrosio
from symfric.laws.static.piecewise import BengisuAkay as BengisuAkay
from symfric.laws.static.piecewise import Exudyn as Exudyn
from symfric.laws.static.piecewise import Hollars as Hollars
from symfric.laws.static.piecewise import Step5 as Step5
from symfric.laws.static.piecewise import VelocityBased as VelocityBased
from symfric.laws.static.quarter_car import QuarterCarGeneral as QuarterCarGeneral
from symfric.laws.static.quarter_car import QuarterCarSimple as QuarterCarSimple
from symfric.laws.static.rui_wang import RuiWang as RuiWang
from symfric.laws.static.self_tuning import BrittleSelfTuning as BrittleSelfTuning
from symfric.laws.static.self_tuning import SelfTuning as SelfTuning
from symfric.laws.static.smooth_peak import MakkarDixon as MakkarDixon
from symfric.laws.static.smooth_peak import SimscapeBreakaway as SimscapeBreakaway
from symfric.laws.static.smooth_peak import Specker as Specker
from symfric.laws.static.stribeck import Stribeck as Stribeck
from symfric.laws.static.table import Table as Table
from symfric.laws.static.threlfall import ModifiedThrelfall as ModifiedThrelfall
from symfric.laws.static.threlfall import Threlfall as Threlfall

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
