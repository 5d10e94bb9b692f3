"""Long-run behaviour of models: equilibria, linearisations, periodic orbits and their stability."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.dynamics.equilibrium import Equilibrium as Equilibrium
    from symfric.dynamics.equilibrium import Holding as Holding
    from symfric.dynamics.equilibrium import equilibrium as equilibrium
    from symfric.dynamics.linear import LinearModel as LinearModel
    from symfric.dynamics.linear import linearize as linearize

load_lazily(__name__)
