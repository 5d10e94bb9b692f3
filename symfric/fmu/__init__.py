"""Functional Mock-up Units of models: the adaptive step in C, without CasADi at run time."""

from typing import TYPE_CHECKING

from symfric.foundation.fronts import hand_out

if TYPE_CHECKING:
    from symfric.fmu.export import Exported as Exported
    from symfric.fmu.export import export_fmu as export_fmu
    from symfric.fmu.export import running as running

hand_out(__name__)
