"""Integration of a `Model` over time, independent of laws and mechanisms."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.integrator.by_peer import simulate_by_peer as simulate_by_peer
    from symfric.integrator.ensemble import simulate_many as simulate_many
    from symfric.integrator.equations.inputs import Hold as Hold
    from symfric.integrator.equations.inputs import Input as Input
    from symfric.integrator.equations.inputs import Linear as Linear
    from symfric.integrator.equations.inputs import rate_of as rate_of
    from symfric.integrator.plant import Plant as Plant
    from symfric.integrator.prepared import prepare as prepare
    from symfric.integrator.simulate import simulate as simulate
    from symfric.integrator.stepper import flow as flow
    from symfric.integrator.stepper import stepper as stepper
    from symfric.integrator.stored import load_run as load_run
    from symfric.results.ensemble import Ensemble as Ensemble
    from symfric.results.ensemble import load_ensemble as load_ensemble
    from symfric.results.stored import Statistics as Statistics
    from symfric.results.trajectory import Trajectory as Trajectory

load_lazily(__name__)
