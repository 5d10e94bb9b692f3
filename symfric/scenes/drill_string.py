"""A drill string that twists between the top drive and a bit that sticks and slips."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, equals
from symfric.foundation.parameters import Variable, param
from symfric.foundation.symbols import symbols_of
from symfric.laws import Benson, LuGre, Stribeck, Tustin
from symfric.model import Model, Output, Variables
from symfric.model.sketch import Sketch
from symfric.scenes.base import GivenInput, Scene, contact, structure
from symfric.scenes.drawn import Block, drawn
from symfric.scenes.presets import Numbers, Preset


def slow(t: ca.SX) -> ca.SX:
    """0.3 rad/s: slower than is drilled, as default laws grip less than rock."""
    return ca.SX(0.3)


FALL = {"v_s": 0.155575 / 0.9}
"""Velocity [m/s] over which friction at the bit falls by 1/e in the paper's numbers."""


@final
@dataclass(frozen=True, eq=False)
class DrillString(Scene):
    """A string of inertias under a top drive whose speed is given, friction at the bit.

        twist_i' = w_(i-1) - w_i,   w_0 = w_top
        t_i = n k twist_i + n c (w_(i-1) - w_i)
        J_i w_i' = t_i - t_(i+1),   at the bit t_(n+1) = R F(R w_n, N) + c_b w_n

    w_top is the input [rad/s], k and c the stiffness and the damping of the whole string, n =
    lumps; the lumps of the string have J_string/n, the bit has J_bit and half a lump more. N is the
    weight on the bit, R the radius at which the law acts. The states are the twists of the n
    pieces, not angles, so a thousand turns cost no digit; `phi` is the angle of the bit.

    Defaults: Navarro-Lopez and Cortes (J_bit, k, c, c_b, R, N); four lumps and J_string, that of
    1.1 km of 5 inch pipe of this stiffness, are ours. Rock has coefficients of 0.5 to 0.8, see the
    preset, with which the bit sticks up to 4 rad/s; with those of default laws it takes the slow
    default input.
    Limits: torsion only: no axial motion, no cutting of the rock; the top drive is stiff.
    Source: Navarro-Lopez and Cortes, J. Sound Vib. 307, 2007, 152-171 (as quoted; there the top is
    an inertia driven by a torque).
    """

    t_end: ClassVar[float] = 60.0
    inputs: ClassVar[Mapping[str, GivenInput]] = {"w_top": GivenInput("0.3", slow)}
    presets: ClassVar[Mapping[str, Preset]] = {
        "navarro_lopez": Preset(
            "one inertia below a stiff top; their law falls as exp(-0.9 |w| / (1 rad/s)), which is "
            "Stribeck's with delta = 1 at v_s = R / 0.9",
            "Navarro-Lopez and Cortes, J. Sound Vib. 307, 2007, as quoted",
            {"J_bit": 471.9698, "J_string": 0.0, "k": 861.5336, "c": 172.3067, "c_b": 50.0}
            | {"R": 0.155575, "N": 97347.0, "lumps": 1},
            {
                "law": Numbers(
                    {"mu_s": 0.8, "mu_d": 0.5, "sigma_2": 0.0},
                    {
                        Stribeck: FALL | {"delta": 1.0},
                        LuGre: FALL | {"delta": 1.0},
                        Tustin: FALL,
                        Benson: {"d_c": 0.9 / 0.155575},
                    },
                )
            },
        )
    }

    lumps: int = structure(4, "inertias into which the string is divided")
    J_bit: Scalar = param(
        471.9698, unit="kg m^2", role="inertia", doc="inertia of bit and collars", lower=1e-12
    )
    J_string: Scalar = param(
        100.0, unit="kg m^2", role="inertia", doc="inertia of the string", lower=0.0
    )
    k: Scalar = param(
        861.5336, unit="N m/rad", role="stiffness", doc="stiffness of the string", lower=1e-12
    )
    c: Scalar = param(
        172.3067, unit="N m s/rad", role="damping", doc="damping of the string", lower=0.0
    )
    c_b: Scalar = param(
        50.0, unit="N m s/rad", role="damping", doc="drag of the mud at the bit", lower=0.0
    )
    R: Scalar = param(0.155575, unit="m", role="geometry", doc="radius of the bit", lower=1e-12)
    N: Scalar = param(97347.0, unit="N", role="load", doc="weight on the bit", lower=0.0)

    def __post_init__(self) -> None:
        checks.count("DrillString: lumps", self.lumps, least=1)
        super().__post_init__()
        if self.lumps > 1 and equals(self.J_string, 0.0):
            raise ValueError(
                f"DrillString: J_string: expected above 0 kg m^2 with lumps = {self.lumps}, got 0; "
                "lumps = 1 is a string without inertia"
            )

    def equations(self, p: Variables) -> Model:
        """States twist_i, w_i, phi and those of the law; input w_top; torques and friction."""
        n = self.lumps
        top = Variable("w_top", "rad/s", nominal=10.0, doc="speed of the top drive")
        twists = tuple(
            Variable(f"twist_{i}", "rad", nominal=1.0, doc=f"twist of piece {i}, from the top")
            for i in range(1, n + 1)
        )
        speeds = tuple(
            Variable(f"w_{i}", "rad/s", nominal=1.0, doc=f"speed of lump {i}") for i in range(1, n)
        )
        bit = Variable("w_bit", "rad/s", nominal=1.0, doc="speed of the bit")
        phi = Variable("phi", "rad", nominal=10.0, doc="angle of the bit")
        turning = symbols_of((top, *speeds, bit))
        twisting = turning[:-1] - turning[1:]
        torques = n * (self.k * symbols_of(twists) + self.c * twisting)
        at_bit = torques[n - 1] - self.c_b * bit.symbol
        v = self.R * bit.symbol
        rock = contact("rock", self.law, v, self.N, rest={"w_bit": 0.0}, F_e=at_bit / self.R)
        J = self.J_string / n
        between = [(torques[i] - torques[i + 1]) / J for i in range(n - 1)]
        last = (at_bit - self.R * rock.force) / (self.J_bit + J / 2)
        return Model(
            name="drill_string",
            x=(*twists, *speeds, bit, phi),
            u=(top,),
            p=p,
            ode=ca.vertcat(twisting, *between, last, bit.symbol),
            contacts=(rock,),
            outputs={
                "torque_top": Output(torques[0], "N m", "torque of the top drive"),
                "torque_bit": Output(self.R * rock.force, "N m", "torque of the rock on the bit"),
                "v_rel": Output(v, "m/s", "sliding velocity at the radius of the bit"),
                "friction": Output(rock.force, "N", "friction force opposing v_rel"),
                "power": Output(rock.force * v, "W", "power taken by the rock"),
            },
            sketch=partial(self._sketch, phi.symbol, symbols_of(twists)),
        )

    def _sketch(self, phi: ca.SX, twists: ca.SX) -> Sketch:
        """Hands of bit and top drive, seen from above; the angle between them is the twist."""
        hands = {"bit": (phi, 0.7), "top": (phi + ca.sum1(twists), 1.0)}
        return drawn({}, hands=hands, hub=Block(0.0, 0.0, "", "v_rel", self.law))
