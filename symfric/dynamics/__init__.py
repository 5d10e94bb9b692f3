"""Long-run behaviour of models: equilibria, linearisations, periodic orbits and their stability."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.dynamics.boundary import Boundary as Boundary
    from symfric.dynamics.boundary import boundary as boundary
    from symfric.dynamics.branch import Branch as Branch
    from symfric.dynamics.branch import Special as Special
    from symfric.dynamics.branch import load_branch as load_branch
    from symfric.dynamics.continuation import continuation as continuation
    from symfric.dynamics.continuation import orbits_from as orbits_from
    from symfric.dynamics.describing import DescribingFunction as DescribingFunction
    from symfric.dynamics.describing import describing_function as describing_function
    from symfric.dynamics.equilibrium import Equilibrium as Equilibrium
    from symfric.dynamics.equilibrium import Holding as Holding
    from symfric.dynamics.equilibrium import equilibrium as equilibrium
    from symfric.dynamics.harmonic import HarmonicBalance as HarmonicBalance
    from symfric.dynamics.harmonic import harmonic_balance as harmonic_balance
    from symfric.dynamics.linear import LinearModel as LinearModel
    from symfric.dynamics.linear import linearize as linearize
    from symfric.dynamics.orbit import PeriodicOrbit as PeriodicOrbit
    from symfric.dynamics.orbit import periodic_orbit as periodic_orbit

load_lazily(__name__)
