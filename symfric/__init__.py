"""Friction laws as CasADi expressions, from simulation to optimal control and embedded C."""

from importlib.metadata import version as _version

from symfric.figures import FigureData as FigureData
from symfric.figures import compare as compare
from symfric.figures import figure as figure
from symfric.integrator import Ensemble as Ensemble
from symfric.integrator import Hold as Hold
from symfric.integrator import Linear as Linear
from symfric.integrator import Statistics as Statistics
from symfric.integrator import Trajectory as Trajectory
from symfric.integrator import flow as flow
from symfric.integrator import simulate as simulate
from symfric.integrator import simulate_many as simulate_many
from symfric.laws import ALL_LAWS as ALL_LAWS
from symfric.laws import Asymmetric as Asymmetric
from symfric.laws import BrownMcPhee as BrownMcPhee
from symfric.laws import Coulomb as Coulomb
from symfric.laws import Dahl as Dahl
from symfric.laws import Law as Law
from symfric.laws import LoadDependent as LoadDependent
from symfric.laws import LuGre as LuGre
from symfric.laws import SelfTuning as SelfTuning
from symfric.laws import StaticLaw as StaticLaw
from symfric.laws import Stribeck as Stribeck
from symfric.laws import Sum as Sum
from symfric.laws import Viscous as Viscous
from symfric.laws import law_from_text as law_from_text
from symfric.model import Event as Event
from symfric.model import Model as Model
from symfric.model import Monitor as Monitor
from symfric.model import Output as Output
from symfric.parameters import Parameter as Parameter
from symfric.parameters import Variable as Variable
from symfric.parameters import parameters as parameters
from symfric.parameters import symbolise as symbolise
from symfric.parameters import with_values as with_values
from symfric.scenes import drive as drive
from symfric.scenes import rabinowicz as rabinowicz
from symfric.status import SolveError as SolveError
from symfric.status import Status as Status

__version__ = _version("symfric")
