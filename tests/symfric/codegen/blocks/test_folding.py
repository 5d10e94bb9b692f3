"""Parameters that become constants because their value selects a cheaper form."""

import pytest

from symfric import (
    Asymmetric,
    BrownMcPhee,
    Dahl,
    LuGre,
    SelfTuning,
    Stribeck,
    law_from_text,
    parameters,
)
from symfric.codegen.blocks.variables import runtime_parameters


@pytest.mark.parametrize(
    ("law", "constants"),
    [
        (law_from_text("coulomb"), set()),
        (law_from_text("coulomb+viscous"), set()),
        (law_from_text("coulomb+coulomb"), set()),
        (BrownMcPhee(), {"mu_v"}),
        (BrownMcPhee(mu_v=0.4), set()),
        (BrownMcPhee(mu_s=0.1, mu_d=0.1), {"mu_v"}),
        (SelfTuning(), {"E"}),
        (SelfTuning(E=0.5), set()),
        (Stribeck(), {"delta"}),
        (Stribeck(delta=0.78), set()),
        (LuGre(), {"delta"}),
        (LuGre(mu_s=0.1, mu_d=0.1), {"delta"}),
        (LuGre(delta=1.5), set()),
        (LuGre(delta=1.5, v_eps=0.0), {"v_eps"}),
        (LuGre(sigma_2=1.0), {"delta"}),
        (Dahl(), {"n"}),
        (law_from_text("load_dependent(lugre)"), {"delta"}),
        (law_from_text("asymmetric(lugre)"), {"delta_pos", "delta_neg"}),
        (Asymmetric(Stribeck(), Stribeck(delta=1.5)), set()),
        (law_from_text("lugre+lugre"), {"delta_1", "delta_2"}),
        (law_from_text("lugre+dahl"), {"delta", "n"}),
    ],
    ids=lambda value: str(sorted(value) if isinstance(value, set) else value),
)
def test_only_values_that_spare_a_function_call_become_constants(law, constants):
    assert set(parameters(law)) - set(runtime_parameters(law)) == constants
