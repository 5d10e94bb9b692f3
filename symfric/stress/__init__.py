"""Random campaigns that compare each case with a reference; may import every other package."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.stress.campaign import Report as Report
    from symfric.stress.cases import Case as Case
    from symfric.stress.cases import Signal as Signal
    from symfric.stress.cases import draw as draw
    from symfric.stress.judge import CLASSES as CLASSES
    from symfric.stress.judge import Judgement as Judgement

load_lazily(__name__)
