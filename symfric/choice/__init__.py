"""Choice of a law: laws in the user's machine, ranked by work at equal error."""

from typing import TYPE_CHECKING

from symfric.foundation.lazy import load_lazily

if TYPE_CHECKING:
    from symfric.choice.friction import Friction as Friction
    from symfric.choice.nature import NEEDS as NEEDS
    from symfric.choice.ranking import Row as Row
    from symfric.choice.select import Choice as Choice
    from symfric.choice.select import select as select

load_lazily(__name__)
