"""Models, which are the interface between equations and solvers."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.model.contact import Contact as Contact
    from symfric.model.model import Model as Model
    from symfric.model.model import Variables as Variables
    from symfric.model.model import check_model as check_model
    from symfric.model.parts import Event as Event
    from symfric.model.parts import Holonomic as Holonomic
    from symfric.model.parts import Monitor as Monitor
    from symfric.model.parts import Output as Output

load_lazily(__name__)
