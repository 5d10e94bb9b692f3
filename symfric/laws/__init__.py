"""Friction laws as CasADi expressions: `force(v, N, z)` and `rate(v, N, z)`.

Knows nothing of mechanisms, integration or optimisation; a law drops into any CasADi code.
"""

from symfric.laws.base import PHENOMENA as PHENOMENA
from symfric.laws.base import Facts as Facts
from symfric.laws.base import Law as Law
from symfric.laws.base import State as State
from symfric.laws.base import StaticLaw as StaticLaw
from symfric.laws.compose import Asymmetric as Asymmetric
from symfric.laws.compose import LoadDependent as LoadDependent
from symfric.laws.compose import Sum as Sum
from symfric.laws.dynamic import GMS as GMS
from symfric.laws.dynamic import Dahl as Dahl
from symfric.laws.dynamic import ElastoPlastic as ElastoPlastic
from symfric.laws.dynamic import Element as Element
from symfric.laws.dynamic import LuGre as LuGre
from symfric.laws.dynamic import LuGreNormalised as LuGreNormalised
from symfric.laws.dynamic import LuGrePassive as LuGrePassive
from symfric.laws.dynamic import MaxwellSlip as MaxwellSlip
from symfric.laws.dynamic import Slider as Slider
from symfric.laws.names import ALL_LAWS as ALL_LAWS
from symfric.laws.names import law_from_text as law_from_text
from symfric.laws.names import law_name as law_name
from symfric.laws.static.brown_mcphee import BrownMcPhee as BrownMcPhee
from symfric.laws.static.coulomb import Coulomb as Coulomb
from symfric.laws.static.coulomb import Viscous as Viscous
from symfric.laws.static.self_tuning import SelfTuning as SelfTuning
from symfric.laws.static.stribeck import Stribeck as Stribeck
