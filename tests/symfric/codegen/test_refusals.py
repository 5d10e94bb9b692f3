"""Invalid arguments of generated C, compensators and embedded runs: one table of calls."""

import casadi as ca
import pytest
from tables import Names, table

from symfric import LuGre, Model, Output, Variable, drive
from symfric.codegen import Block
from symfric.compensation import sine
from symfric.model import Event

TABLE = table(__file__, "refusals")
x, z, u, h = (Variable(n, unit) for n, unit in (("x", "m"), ("z", "1"), ("u", "m/s"), ("h", "s")))


def lag(**changes) -> Block:
    parts = {"name": "lag", "states": (x,), "inputs": (u,), "parameters": (h,),
             "next": x.symbol + h.symbol * u.symbol,
             "outputs": {"y": Output(2 * x.symbol, "m")}}  # fmt: skip
    return Block(**parts | changes)


t = ca.SX.sym("t")
NAMES = {
    "ca": ca, "u": u, "h": h, "lag": lag, "plant": drive(LuGre()),
    "wave": sine(0.01, 1.0, 1.0),
    "ball": Model("ball", x=(x,), ode=-x.symbol, events=(Event("hit", x.symbol - 0.5),)),
    "clock": Model("clock", x=(x,), ode=-x.symbol, outputs={"now": Output(t, "s")}, t=t),
    "leak": Model("leak", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol + z.symbol**3 - x.symbol),
}  # fmt: skip


@pytest.mark.parametrize("group", TABLE)
def test_bad_arguments_are_refused_in_a_sentence_and_write_nothing(group, tmp_path):
    names = Names(NAMES, OUT=tmp_path / "c", FILE=tmp_path / "file")
    names["FILE"].write_text("")
    for call, words in TABLE[group].items():
        with pytest.raises(ValueError) as caught:
            eval(call, {}, names)
        assert words in str(caught.value), call
        assert not names["OUT"].exists()
