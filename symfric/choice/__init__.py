"""Choice of a law or a method: run time at equal error in the user's machine."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.choice.friction import Friction as Friction
    from symfric.choice.nature import NEEDS as NEEDS
    from symfric.choice.ranking import RankedLaw as RankedLaw
    from symfric.choice.select import Choice as Choice
    from symfric.choice.select import select as select
    from symfric.choice.work_precision import WorkPoint as WorkPoint
    from symfric.choice.work_precision import WorkPrecision as WorkPrecision
    from symfric.choice.work_precision import work_precision as work_precision

load_lazily(__name__)
