"""Friction compensators, observers and estimators as blocks, and tests of them in closed loops."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.compensation.compensator import compensator as compensator
    from symfric.compensation.estimators import kalman_estimator as kalman_estimator
    from symfric.compensation.estimators import recursive_estimator as recursive_estimator
    from symfric.compensation.follow import Followed as Followed
    from symfric.compensation.follow import follow as follow
    from symfric.compensation.force import TERMS as TERMS
    from symfric.compensation.loop import Cascade as Cascade
    from symfric.compensation.loop import close_loop as close_loop
    from symfric.compensation.observers import disturbance_observer as disturbance_observer
    from symfric.compensation.observers import gms_observer as gms_observer
    from symfric.compensation.observers import lugre_observer as lugre_observer
    from symfric.compensation.result import Comparison as Comparison
    from symfric.compensation.result import Loop as Loop
    from symfric.compensation.result import Reference as Reference
    from symfric.compensation.result import moves as moves
    from symfric.compensation.result import sine as sine
    from symfric.compensation.result import step as step
    from symfric.compensation.settings import Adaptation as Adaptation
    from symfric.compensation.settings import Compensation as Compensation
    from symfric.compensation.settings import settings_from_text as settings_from_text
    from symfric.compensation.valves import valve_describing_function as valve_describing_function
    from symfric.compensation.valves import valve_stiction as valve_stiction

load_lazily(__name__)
