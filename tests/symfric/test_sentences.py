"""Messages for the most frequent mistakes name the correct call."""

import math
from pathlib import Path

from refusing import not_refused

import symfric as sf
from symfric.multibody import Mechanism
from symfric.scenes import Rabinowicz


def test_messages_name_the_correct_call() -> None:
    law = sf.BrownMcPhee()
    names = {"BELT": sf.rabinowicz(law), "DRIVEN": sf.drive(law), "Rabinowicz": Rabinowicz}
    table = Path(__file__).with_name("stumbles.toml")
    assert not_refused(table, sf=sf, math=math, Mechanism=Mechanism, **names) == []
