"""Model predictive control: controllers derived from problems, their C code, and closed loops."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from ocp.mpc.closed_loop import ClosedLoopRun as ClosedLoopRun
    from ocp.mpc.controller import Controller as Controller
    from ocp.mpc.controller import ControllerCheck as ControllerCheck
    from ocp.mpc.controller import GeneratedController as GeneratedController
    from ocp.mpc.controller import controller_of as controller_of
    from ocp.mpc.design import CycleStatus as CycleStatus
    from ocp.mpc.session import Action as Action
    from ocp.mpc.session import Session as Session

load_lazily(__name__)
