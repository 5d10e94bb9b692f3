"""Memoryless laws F(v, N): one family a file."""

from symfric.laws.base.law import Law
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
from symfric.laws.static.table import Table as Table
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
