"""Messages for the most frequent mistakes name the correct call."""

import math
from typing import Any

import casadi as ca
import pytest

import symfric as sf
from symfric.multibody import Mechanism
from symfric.scenes import Rabinowicz

BELT = sf.rabinowicz(sf.BrownMcPhee())
DRIVEN = sf.drive(sf.BrownMcPhee())
STUMBLES: dict[str, tuple[Any, str]] = {
    "a scene": (
        lambda: sf.simulate(Rabinowicz(sf.LuGre()), 1.0),  # type: ignore[arg-type]
        r"^simulate: expected a model, such as rabinowicz\(LuGre\(\)\), got Rabinowicz.*; "
        r"call its model\(\)",
    ),
    "a law": (lambda: sf.flow(sf.LuGre()), "put the law in a scene"),  # type: ignore[arg-type]
    "a mechanism": (
        lambda: sf.simulate(Mechanism("m"), 1.0),  # type: ignore[arg-type]
        r"call its build\(\)",
    ),
    "a class": (lambda: sf.rabinowicz(sf.LuGre), "got the class LuGre"),  # type: ignore[arg-type]
    "a parameter that is fixed": (
        lambda: sf.simulate(BELT, 1.0, p={"mu_s": 0.2}),
        r"^model 'rabinowicz' p: expected no names, got mu_s; free it when the model is made, "
        r'rabinowicz\(law, free=\["mu_s"\]\), or with symbolise\(law, "mu_s"\) and Model\(p=...\)$',
    ),
    "a symbol in a scene": (
        lambda: sf.rabinowicz(sf.LuGre(mu_s=sf.Variable("mu", "1"))),
        r"^Rabinowicz: expected numbers, got a symbol for mu_s; free=\['mu_s'\] makes",
    ),
    "an input of a model without any": (
        lambda: sf.simulate(BELT, 1.0, u={"F": 1.0}),
        "got F; the model has no inputs$",
    ),
    "velocity and load changed places": (
        lambda: sf.contact("floor", sf.LuGre(), 10.0, sf.Variable("v", "m/s")),
        r"^contact 'floor': N: .* got variable 'v' \[m/s\].*; v comes before N$",
    ),
    "a load that pulls": (
        lambda: sf.contact("floor", sf.LuGre(), sf.Variable("v", "m/s"), -10.0),
        "^contact 'floor': N: expected a normal force >= 0 N, got -10.0$",
    ),
    "a law for a name": (
        lambda: sf.contact(sf.LuGre(), "floor", 1.0, 1.0),  # type: ignore[arg-type]
        "^contact: name: expected a text, and then a law, got LuGre",
    ),
    "math in an input": (
        lambda: sf.simulate(DRIVEN, 1.0, u={"force": lambda t: math.sin(t)}),  # type: ignore
        r"^input 'force': expected a function of the symbolic time .* write casadi.sin\(t\) for m",
    ),
    "if in an input": (
        lambda: sf.simulate(DRIVEN, 1.0, u={"force": lambda t: 1.0 if t > 0 else 0.0}),
        r"got RuntimeError \(Cannot compute the truth .*casadi.if_else\(t > 1, a, b\) for a Python",
    ),
    "a text as names": (lambda: sf.rabinowicz(sf.LuGre(), free="mu_s"), r"write \['mu_s'\]"),
    "MX in a model": (
        lambda: sf.Output(ca.MX.sym("x"), "m"),  # type: ignore[arg-type]
        "models are written with casadi.SX",
    ),
    "a method's name": (lambda: sf.simulate(BELT, 1.0, method="rodas5"), "did you mean rodas5p"),
    "a law's name": (
        lambda: sf.law_from_text("lugree"),
        r"^law 'lugree': expected one of \d+ known names, got lugree; did you mean lugre\?$",
    ),
}


@pytest.mark.parametrize("stumble", STUMBLES)
def test_messages_name_the_correct_call(stumble: str) -> None:
    call, message = STUMBLES[stumble]
    with pytest.raises(ValueError, match=message):
        call()
