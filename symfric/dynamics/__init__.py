"""Long-run behaviour of models: equilibria, linearisations, periodic orbits and their stability."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.dynamics.equilibrium import Equilibrium as Equilibrium
    from symfric.dynamics.equilibrium import Holding as Holding
    from symfric.dynamics.equilibrium import equilibrium as equilibrium
    from symfric.dynamics.linear import LinearModel as LinearModel
    from symfric.dynamics.linear import linearize as linearize
    from symfric.dynamics.orbit import PeriodicOrbit as PeriodicOrbit
    from symfric.dynamics.orbit import periodic_orbit as periodic_orbit

load_lazily(__name__)
