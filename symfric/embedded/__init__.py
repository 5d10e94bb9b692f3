"""Cost and accuracy of generated C: runs on Cortex-M cores under QEMU, errors of fixed steps."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.embedded.measure import BlockMeasurement as BlockMeasurement
    from symfric.embedded.measure import measure as measure
    from symfric.embedded.measure import wrong_on_target as wrong_on_target
    from symfric.embedded.step_errors import StepError as StepError
    from symfric.embedded.step_errors import step_errors as step_errors
    from symfric.embedded.target import BY as BY
    from symfric.embedded.target import CORES as CORES
    from symfric.embedded.target import Absent as Absent
    from symfric.embedded.target import Core as Core
    from symfric.embedded.target import Tools as Tools
    from symfric.embedded.target import find_tools as find_tools

load_lazily(__name__)
