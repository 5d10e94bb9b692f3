"""Friction laws as CasADi expressions: `force(v, N, z)` and `rate(v, N, z)`.

Knows nothing of mechanisms, integration or optimisation; a law drops into any CasADi code.
"""

from symfric.laws.base.law import PHENOMENA as PHENOMENA
from symfric.laws.base.law import Facts as Facts
from symfric.laws.base.law import Input as Input
from symfric.laws.base.law import Law as Law
from symfric.laws.base.law import State as State
from symfric.laws.base.law import StaticLaw as StaticLaw
from symfric.laws.composed.compose import Asymmetric as Asymmetric
from symfric.laws.composed.compose import LoadDependent as LoadDependent
from symfric.laws.composed.compose import Sum as Sum
from symfric.laws.composed.isotropic import PlanarSlip as PlanarSlip
from symfric.laws.composed.isotropic import SpatialSlip as SpatialSlip
from symfric.laws.composed.populations import AnyLaw as AnyLaw
from symfric.laws.composed.populations import GenericAsperity as GenericAsperity
from symfric.laws.composed.populations import Population as Population
from symfric.laws.composed.populations import RandomBristles as RandomBristles
from symfric.laws.composed.wrap import Lagged as Lagged
from symfric.laws.composed.wrap import TemperatureDependent as TemperatureDependent
from symfric.laws.dynamic import *
from symfric.laws.names import ALL_LAWS as ALL_LAWS
from symfric.laws.names import POPULATIONS as POPULATIONS
from symfric.laws.names import any_from_text as any_from_text
from symfric.laws.names import law_from_text as law_from_text
from symfric.laws.names import law_name as law_name
from symfric.laws.static import *
from symfric.laws.steady import steady_force as steady_force
from symfric.laws.steady import steady_inputs as steady_inputs
