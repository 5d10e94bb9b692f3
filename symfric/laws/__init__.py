"""Friction laws as CasADi expressions: `force(v, N, z)` and `rate(v, N, z)`.

Knows nothing of mechanisms, integration or optimisation; a law drops into any CasADi code.
"""

from symfric.laws.base import PHENOMENA as PHENOMENA
from symfric.laws.base import Facts as Facts
from symfric.laws.base import Input as Input
from symfric.laws.base import Law as Law
from symfric.laws.base import State as State
from symfric.laws.base import StaticLaw as StaticLaw
from symfric.laws.compose import Asymmetric as Asymmetric
from symfric.laws.compose import LoadDependent as LoadDependent
from symfric.laws.compose import Sum as Sum
from symfric.laws.dynamic import GMS as GMS
from symfric.laws.dynamic import Armstrong as Armstrong
from symfric.laws.dynamic import BlimanSorine as BlimanSorine
from symfric.laws.dynamic import BoucWen as BoucWen
from symfric.laws.dynamic import Bristle2D as Bristle2D
from symfric.laws.dynamic import Dahl as Dahl
from symfric.laws.dynamic import ElastoPlastic as ElastoPlastic
from symfric.laws.dynamic import Element as Element
from symfric.laws.dynamic import ExactCoulomb as ExactCoulomb
from symfric.laws.dynamic import Gonthier as Gonthier
from symfric.laws.dynamic import HaessigFriedland as HaessigFriedland
from symfric.laws.dynamic import Leuven as Leuven
from symfric.laws.dynamic import LuGre as LuGre
from symfric.laws.dynamic import LuGreNormalised as LuGreNormalised
from symfric.laws.dynamic import LuGrePassive as LuGrePassive
from symfric.laws.dynamic import MaxwellSlip as MaxwellSlip
from symfric.laws.dynamic import RateAndState as RateAndState
from symfric.laws.dynamic import Slider as Slider
from symfric.laws.dynamic import StickSlip as StickSlip
from symfric.laws.names import ALL_LAWS as ALL_LAWS
from symfric.laws.names import POPULATIONS as POPULATIONS
from symfric.laws.names import any_from_text as any_from_text
from symfric.laws.names import law_from_text as law_from_text
from symfric.laws.names import law_name as law_name
from symfric.laws.planar import Planar as Planar
from symfric.laws.planar import Spatial as Spatial
from symfric.laws.populations import AnyLaw as AnyLaw
from symfric.laws.populations import GenericAsperity as GenericAsperity
from symfric.laws.populations import Population as Population
from symfric.laws.populations import RandomBristles as RandomBristles
from symfric.laws.static import BAM as BAM
from symfric.laws.static import Ambrosio as Ambrosio
from symfric.laws.static import Andersson as Andersson
from symfric.laws.static import Awrejcewicz as Awrejcewicz
from symfric.laws.static import BengisuAkay as BengisuAkay
from symfric.laws.static import Benson as Benson
from symfric.laws.static import Berger as Berger
from symfric.laws.static import Bittencourt as Bittencourt
from symfric.laws.static import BrittleSelfTuning as BrittleSelfTuning
from symfric.laws.static import BrownMcPhee as BrownMcPhee
from symfric.laws.static import Capstan as Capstan
from symfric.laws.static import Coulomb as Coulomb
from symfric.laws.static import DuanSingh as DuanSingh
from symfric.laws.static import Exudyn as Exudyn
from symfric.laws.static import Hollars as Hollars
from symfric.laws.static import Karnopp as Karnopp
from symfric.laws.static import LeineSwitch as LeineSwitch
from symfric.laws.static import Lorentzian as Lorentzian
from symfric.laws.static import MakkarDixon as MakkarDixon
from symfric.laws.static import ModifiedThrelfall as ModifiedThrelfall
from symfric.laws.static import PoppStelter as PoppStelter
from symfric.laws.static import PowerLawViscous as PowerLawViscous
from symfric.laws.static import QuarterCarGeneral as QuarterCarGeneral
from symfric.laws.static import QuarterCarSimple as QuarterCarSimple
from symfric.laws.static import RuiWang as RuiWang
from symfric.laws.static import SelfTuning as SelfTuning
from symfric.laws.static import SimscapeBreakaway as SimscapeBreakaway
from symfric.laws.static import Specker as Specker
from symfric.laws.static import SteadyStateLuGre as SteadyStateLuGre
from symfric.laws.static import Step5 as Step5
from symfric.laws.static import Stribeck as Stribeck
from symfric.laws.static import Table as Table
from symfric.laws.static import Threlfall as Threlfall
from symfric.laws.static import Tustin as Tustin
from symfric.laws.static import VelocityBased as VelocityBased
from symfric.laws.static import Viscous as Viscous
from symfric.laws.static import Wojewoda as Wojewoda
from symfric.laws.steady import steady_force as steady_force
from symfric.laws.steady import steady_inputs as steady_inputs
from symfric.laws.wrap import Lagged as Lagged
from symfric.laws.wrap import TemperatureDependent as TemperatureDependent


def __getattr__(name: str) -> object:
    """`compare`, which stands above the laws and is fetched when asked for."""
    if name != "compare":
        raise AttributeError(f"module 'symfric.laws' has no attribute '{name}'")
    from symfric.figures import compare  # noqa: PLC0415  (laws know nothing of figures)

    return compare
