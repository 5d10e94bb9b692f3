"""Functional Mock-up Units of models: the adaptive step in C, without CasADi at run time."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.fmu.export import Exported as Exported
    from symfric.fmu.export import export_fmu as export_fmu
    from symfric.fmu.export import running as running

load_lazily(__name__)
