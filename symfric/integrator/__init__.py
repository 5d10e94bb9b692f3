"""Integration of a `Model` over time. Knows nothing of laws or mechanisms."""

from symfric.integrator.ensemble import Ensemble as Ensemble
from symfric.integrator.ensemble import simulate_many as simulate_many
from symfric.integrator.flow import flow as flow
from symfric.integrator.inputs import Hold as Hold
from symfric.integrator.inputs import Input as Input
from symfric.integrator.inputs import Linear as Linear
from symfric.integrator.simulate import simulate as simulate
from symfric.integrator.trajectory import Statistics as Statistics
from symfric.integrator.trajectory import Trajectory as Trajectory
