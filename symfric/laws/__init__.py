"""Friction laws as CasADi expressions: `force(v, N, z)` and `rate(v, N, z)`.

The laws are independent of mechanisms, integration and optimisation, and work in any CasADi code.
"""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.laws.base import smooth as smooth
    from symfric.laws.base.families import Exact as Exact
    from symfric.laws.base.law import Facts as Facts
    from symfric.laws.base.law import Input as Input
    from symfric.laws.base.law import Law as Law
    from symfric.laws.base.law import State as State
    from symfric.laws.base.law import StaticLaw as StaticLaw
    from symfric.laws.base.law import Switch as Switch
    from symfric.laws.base.phenomena import PHENOMENA as PHENOMENA
    from symfric.laws.catalogue import ALL_LAWS as ALL_LAWS
    from symfric.laws.catalogue import POPULATIONS as POPULATIONS
    from symfric.laws.catalogue import any_from_text as any_from_text
    from symfric.laws.catalogue import law_from_text as law_from_text
    from symfric.laws.catalogue import law_name as law_name
    from symfric.laws.check import LawReport as LawReport
    from symfric.laws.check import check_law as check_law
    from symfric.laws.composed.compose import Asymmetric as Asymmetric
    from symfric.laws.composed.compose import LoadDependent as LoadDependent
    from symfric.laws.composed.compose import Sum as Sum
    from symfric.laws.composed.isotropic import PlanarSlip as PlanarSlip
    from symfric.laws.composed.isotropic import SpatialSlip as SpatialSlip
    from symfric.laws.composed.populations import AnyLaw as AnyLaw
    from symfric.laws.composed.populations import GenericAsperity as GenericAsperity
    from symfric.laws.composed.populations import Population as Population
    from symfric.laws.composed.populations import RandomBristles as RandomBristles
    from symfric.laws.composed.populations import steady_force as steady_force
    from symfric.laws.composed.populations import steady_inputs as steady_inputs
    from symfric.laws.composed.wrap import Lagged as Lagged
    from symfric.laws.composed.wrap import LoadNormalised as LoadNormalised
    from symfric.laws.composed.wrap import TemperatureDependent as TemperatureDependent
    from symfric.laws.dynamic.dahl import BlimanSorine as BlimanSorine
    from symfric.laws.dynamic.dahl import BoucWen as BoucWen
    from symfric.laws.dynamic.dahl import Dahl as Dahl
    from symfric.laws.dynamic.dwell import Armstrong as Armstrong
    from symfric.laws.dynamic.dwell import Gonthier as Gonthier
    from symfric.laws.dynamic.dwell import RateAndState as RateAndState
    from symfric.laws.dynamic.lugre import ElastoPlastic as ElastoPlastic
    from symfric.laws.dynamic.lugre import LuGre as LuGre
    from symfric.laws.dynamic.lugre import LuGreNormalised as LuGreNormalised
    from symfric.laws.dynamic.lugre import LuGrePassive as LuGrePassive
    from symfric.laws.dynamic.lugre import LuGreTyre as LuGreTyre
    from symfric.laws.dynamic.maxwell_slip import GMS as GMS
    from symfric.laws.dynamic.maxwell_slip import Element as Element
    from symfric.laws.dynamic.maxwell_slip import Leuven as Leuven
    from symfric.laws.dynamic.maxwell_slip import MaxwellSlip as MaxwellSlip
    from symfric.laws.dynamic.maxwell_slip import Slider as Slider
    from symfric.laws.dynamic.stick_slip import Bristle2D as Bristle2D
    from symfric.laws.dynamic.stick_slip import ExactCoulomb as ExactCoulomb
    from symfric.laws.dynamic.stick_slip import HaessigFriedland as HaessigFriedland
    from symfric.laws.dynamic.stick_slip import StickSlip as StickSlip
    from symfric.laws.static.applied_force import Awrejcewicz as Awrejcewicz
    from symfric.laws.static.applied_force import Karnopp as Karnopp
    from symfric.laws.static.applied_force import LeineSwitch as LeineSwitch
    from symfric.laws.static.applied_force import Wojewoda as Wojewoda
    from symfric.laws.static.coulomb import Coulomb as Coulomb
    from symfric.laws.static.coulomb import PowerLawViscous as PowerLawViscous
    from symfric.laws.static.coulomb import Table as Table
    from symfric.laws.static.coulomb import Viscous as Viscous
    from symfric.laws.static.exponential import Andersson as Andersson
    from symfric.laws.static.exponential import Benson as Benson
    from symfric.laws.static.exponential import Berger as Berger
    from symfric.laws.static.exponential import DuanSingh as DuanSingh
    from symfric.laws.static.exponential import SteadyStateLuGre as SteadyStateLuGre
    from symfric.laws.static.exponential import Stribeck as Stribeck
    from symfric.laws.static.exponential import Tustin as Tustin
    from symfric.laws.static.from_data import Level as Level
    from symfric.laws.static.from_data import Network as Network
    from symfric.laws.static.from_data import Neuron as Neuron
    from symfric.laws.static.from_data import Spline as Spline
    from symfric.laws.static.machines import BAM as BAM
    from symfric.laws.static.machines import Bittencourt as Bittencourt
    from symfric.laws.static.machines import BrushTyre as BrushTyre
    from symfric.laws.static.machines import Capstan as Capstan
    from symfric.laws.static.machines import QuarterCarGeneral as QuarterCarGeneral
    from symfric.laws.static.machines import QuarterCarSimple as QuarterCarSimple
    from symfric.laws.static.piecewise import Ambrosio as Ambrosio
    from symfric.laws.static.piecewise import BengisuAkay as BengisuAkay
    from symfric.laws.static.piecewise import Exudyn as Exudyn
    from symfric.laws.static.piecewise import Hollars as Hollars
    from symfric.laws.static.piecewise import ModifiedThrelfall as ModifiedThrelfall
    from symfric.laws.static.piecewise import Step5 as Step5
    from symfric.laws.static.piecewise import Threlfall as Threlfall
    from symfric.laws.static.piecewise import VelocityBased as VelocityBased
    from symfric.laws.static.self_tuning import BrittleSelfTuning as BrittleSelfTuning
    from symfric.laws.static.self_tuning import RuiWang as RuiWang
    from symfric.laws.static.self_tuning import SelfTuning as SelfTuning
    from symfric.laws.static.smooth_peak import BrownMcPhee as BrownMcPhee
    from symfric.laws.static.smooth_peak import Lorentzian as Lorentzian
    from symfric.laws.static.smooth_peak import MakkarDixon as MakkarDixon
    from symfric.laws.static.smooth_peak import MixedLubrication as MixedLubrication
    from symfric.laws.static.smooth_peak import PoppStelter as PoppStelter
    from symfric.laws.static.smooth_peak import SimscapeBreakaway as SimscapeBreakaway
    from symfric.laws.static.smooth_peak import Specker as Specker

load_lazily(__name__)
