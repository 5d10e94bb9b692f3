"""Rotating machines: a clutch, a drill string, and the rollers of a laminator nip."""

from collections.abc import Mapping
from functools import partial
from math import pi
from typing import ClassVar

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar, equals
from symfric.foundation.parameters import Variable, param, parametric
from symfric.foundation.variable import symbols_of
from symfric.laws.base import smooth
from symfric.model import Model, Output, Variables
from symfric.model.sketch import Sketch
from symfric.scenes import fields
from symfric.scenes.base import GivenInput, Scene, contact, friction_outputs, structure
from symfric.scenes.drawing import RailBody, drawn


def closing(t: ca.SX) -> ca.SX:
    """Return a pressure [Pa] that rises from 0 to 4 bar within 0.1 s."""
    return 4e5 * smooth.clip(t / 0.1, 0.0, 1.0)


@parametric
class Clutch(Scene):
    """Clutch between an engine and a load, with plates that are pressed together.

        J_1 w_1' = T_1 - T,   J_2 w_2' = T - T_2,   T = n R F(v, N)
        v = R (w_1 - w_2),   N = N_0 + max(pressure A, 0),   heat' = T (w_1 - w_2)

    R is the friction radius of the plates and n the number of faces, each with the normal force N.
    The input is the pressure of the piston [Pa]; the plates are separated if it is negative. The
    states are w_2 and the slip w_1 - w_2, so that zero slip is exact. With Coulomb friction at full
    pressure from t = 0 the clutch locks after the time w / a and dissipates the energy
    T w^2 / (2 a), where w is the slip at the start and a = T (1/J_1 + 1/J_2) - T_1/J_1 - T_2/J_2.

    Defaults: assumed, for a car of 1.2 t in first gear (J_2 and T_2 at the gearbox) and laws with
    mu_d = 0.1: 200 N m at 4 bar.
    Limits: the open clutch has the normal force N_0, since some laws divide by the normal force.
    """

    t_end: ClassVar[float] = 0.6
    inputs: ClassVar[Mapping[str, GivenInput]] = {
        "pressure": GivenInput("4e5 min(t / 0.1, 1)", closing),
    }

    J_1: Scalar = fields.INERTIA(0.2, doc="inertia of the engine")
    J_2: Scalar = fields.INERTIA(0.64, doc="inertia of the load")
    T_1: Scalar = param(100.0, unit="N m", role="offset", doc="torque of the engine")
    T_2: Scalar = param(20.0, unit="N m", role="offset", doc="torque that the load takes")
    n: Scalar = fields.SIZE(2.0, unit="1", doc="number of faces")
    R: Scalar = fields.SIZE(0.1, doc="radius of the plates")
    A: Scalar = fields.SIZE(0.008 * pi, unit="m^2", doc="area of the piston")
    N_0: Scalar = fields.LOAD(1.0, doc="load of the open clutch")
    omega_1: Scalar = fields.TURN(150.0, doc="w_1 at the start")
    omega_2: Scalar = fields.TURN(0.0, doc="w_2 at the start")

    def equations(self, p: Variables) -> Model:
        """Return the model: states w_rel, w_2, heat and those of the law; input pressure."""
        w_rel = Variable(
            "w_rel", "rad/s", start=self.omega_1 - self.omega_2, nominal=10.0, doc="w_1 - w_2"
        )
        w_2 = Variable("w_2", "rad/s", start=self.omega_2, nominal=10.0, doc="speed of the load")
        heat = Variable("heat", "J", nominal=1e3, doc="energy lost in the plates")
        pressure = Variable("pressure", "Pa", nominal=1e5, doc="pressure of the piston")
        N = self.N_0 + smooth.positive(pressure.symbol * self.A, 0.0)
        both = 1 / self.J_1 + 1 / self.J_2
        pull = (self.T_1 / self.J_1 + self.T_2 / self.J_2) / (self.n * self.R * both)
        v = self.R * w_rel.symbol
        plates = contact(
            "plates", self.law, v, N, rest={"w_rel": 0.0}, least=self.N_0, F_e=ca.SX(pull)
        )
        T = self.n * self.R * plates.force
        return Model(
            name="clutch",
            x=(w_rel, w_2, heat),
            u=(pressure,),
            p=p,
            ode=ca.vertcat(
                self.T_1 / self.J_1 + self.T_2 / self.J_2 - T * both,
                (T - self.T_2) / self.J_2,
                T * w_rel.symbol,
            ),
            contacts=(plates,),
            outputs={
                "w_1": Output(w_2.symbol + w_rel.symbol, "rad/s", "speed of the engine"),
                "torque": Output(T, "N m", "torque of the clutch"),
                "v_rel": Output(v, "m/s", "sliding velocity at the radius R"),
                "N": Output(N, "N", "normal force of the plates"),
                "friction": Output(plates.force, "N", "friction force of a face, opposing v_rel"),
                "power": Output(T * w_rel.symbol, "W", "power taken by friction"),
            },
            sketch=self._sketch,
        )

    def _sketch(self) -> Sketch:
        """Return engine and load on their shafts, with the plates between them, at rest."""
        plates = {f"face_{i}": (s * 0.06, 0.0) for i, s in ((1, -1.0), (2, 1.0))}
        rims = {f"rim_{i}_{k}": (s * 0.06, z) for i, s in ((1, -1.0), (2, 1.0))
                for k, z in ((1, -0.2), (2, 0.2))}  # fmt: skip
        return drawn(
            {"engine": RailBody(-1.0, 0.0, label="J_1"), "load": RailBody(1.0, 0.0, label="J_2")},
            plates | rims,
            [("rod", "engine", "face_1", ""), ("rod", "face_2", "load", "")]
            + [("rod", f"rim_{i}_1", f"rim_{i}_2", "") for i in (1, 2)],
            hub=RailBody(0.0, 0.0, "", "v_rel", self.law, contact="plates"),
            arrows=[("w_1", "engine", "turn x"), ("T_1", "engine", "turn x"),
                    ("w_2", "load", "turn x"), ("T_2", "load", "turn -x"),
                    ("pressure", (-0.5, 0.0), "x")],
        )  # fmt: skip


def slow(t: ca.SX) -> ca.SX:
    """Return 0.3 rad/s, slower than in drilling because default laws have less friction."""
    return ca.SX(0.3)


@parametric
class DrillString(Scene):
    """String of inertias below a top drive with given speed, with friction at the bit.

        twist_i' = w_(i-1) - w_i,   w_0 = w_top
        t_i = n k twist_i + n c (w_(i-1) - w_i)
        J_i w_i' = t_i - t_(i+1),   at the bit t_(n+1) = R F(R w_n, N) + c_b w_n

    w_top is the input [rad/s]. k and c are the stiffness and the damping of the whole string, and
    n = lumps. The lumps of the string have the inertia J_string/n, the bit has J_bit plus half a
    lump. N is the weight on the bit and R the radius at which the law acts. The states are the
    twists of the n pieces instead of angles, so that accuracy is kept over many turns; `phi` is the
    angle of the bit.

    Defaults: Navarro-Lopez and Cortes (J_bit, k, c, c_b, R, N). Four lumps and J_string, that of
    1.1 km of 5 inch pipe with this stiffness, are assumed. Rock has friction coefficients of 0.5 to
    0.8, see the preset, with which the bit sticks up to 4 rad/s. With the coefficients of default
    laws it sticks at the slow default input.
    Limits: torsion only, without axial motion and cutting of the rock; the top drive is stiff.
    Source: Navarro-Lopez and Cortes, J. Sound Vib. 307, 2007, 152-171 (as quoted; there the top is
    an inertia driven by a torque).
    """

    t_end: ClassVar[float] = 60.0
    inputs: ClassVar[Mapping[str, GivenInput]] = {"w_top": GivenInput("0.3", slow)}

    lumps: int = structure(4, "inertias into which the string is divided")
    J_bit: Scalar = fields.INERTIA(471.9698, doc="inertia of bit and collars")
    J_string: Scalar = fields.INERTIA(100.0, doc="inertia of the string", lower=0.0)
    k: Scalar = fields.SHAFT(861.5336, doc="stiffness of the string", lower=1e-12)
    c: Scalar = fields.DRAG(172.3067, doc="damping of the string")
    c_b: Scalar = fields.DRAG(50.0, doc="drag of the mud at the bit")
    R: Scalar = fields.SIZE(0.155575, doc="radius of the bit")
    N: Scalar = fields.LOAD(97347.0, doc="weight on the bit")

    def __post_init__(self) -> None:
        checks.count("DrillString: lumps", self.lumps, least=1)
        super().__post_init__()
        if self.lumps > 1 and equals(self.J_string, 0.0):
            raise ValueError(
                f"DrillString: J_string: expected above 0 kg m^2 with lumps = {self.lumps}, got 0; "
                "lumps = 1 is a string without inertia"
            )

    def equations(self, p: Variables) -> Model:
        """Return the model: states twist_i, w_i, phi and those of the law; input w_top."""
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
                **friction_outputs(rock, "v_rel"),
            },
            sketch=partial(self._sketch, phi.symbol, symbols_of(twists)),
        )

    def _sketch(self, phi: ca.SX, twists: ca.SX) -> Sketch:
        """Return hands of bit and top drive as seen from above, with the twist between them.

        In a schematic, the string is seen from the side.
        """
        hands = {"bit": (phi, 0.7), "top": (phi + ca.sum1(twists), 1.0)}
        hub = RailBody(0.0, 0.0, "", "v_rel", self.law, contact="rock")
        return drawn({}, hands=hands, hub=hub, layout=self._layout())

    def _layout(self) -> Sketch:
        """Return the string from the top drive down to the bit."""
        names = [*(f"w_{i}" for i in range(1, self.lumps)), "phi w_bit"]
        bodies = [*(f"lump_{i}" for i in range(1, self.lumps)), "bit"]
        J = [*("J_string / n" for _ in bodies[1:]), "J_bit"]
        blocks = {
            name: RailBody(0.0, -1.0 * i, label=label)
            for i, (name, label) in enumerate(zip(bodies, J, strict=True), start=1)
        }
        pairs = zip(["top", *bodies], bodies, strict=False)
        return drawn(
            blocks,
            {"top": (0.0, 0.0)},
            [("strut", a, b, "n k, n c") for a, b in pairs],
            hub=RailBody(0.0, -1.0 * self.lumps, contact="rock"),
            arrows=[("w_top", "top", "turn z"), ("N", "bit", "-z")]
            + [(name, body, "turn z") for name, body in zip(names, bodies, strict=True)],
        )


def machine_start(t: ca.SX) -> ca.SX:
    """Return a speed [m/s] that rises to 0.5 m/s within 4 s."""
    return 0.5 * smooth.clip(t / 4, 0.0, 1.0)


def pressing(t: ca.SX) -> ca.SX:
    """Return 500 N +- 5 %, as of an eccentric roller at full speed."""
    return 500 + 25 * ca.sin(5 * t)


@parametric
class Nip(Scene):
    """Carton between a steel chill roll, which carries it, and a slower rubber nip roller.

        J w' = R F(v, N) + k twist + d (w_0 - w),   twist' = w_0 - w
        v = v_line - R w,   w_0 = (1 - lag) v_line / R,   N = N_0 + max(load, 0)
        tau v_line' = v_set - v_line

    The web has the speed v_line of the line, which follows the input v_set, and slips with the
    velocity v on the nip roller. The drive of this roller is slower by the share `lag`, in practice
    1 to 2 %. Friction pulls the roller forward against its shaft (stiffness k, damping d), like the
    belt pulls the block of `Rabinowicz`; if friction falls with the velocity, the slip oscillates.
    The input `load` [N] presses the roller; the nip is open if it is negative. The contact is flat
    with uniform pressure. -F is the force on the web, the change of its tension across the nip.

    Defaults: slip and its range of at most 650 mm/min from the thesis. The thesis has no parameters
    of the machine; those of roller, shaft and load are assumed. Its measured laws are presets of
    `Prescribed`.
    Limits: if friction falls with the velocity, both uniform slip and stick-slip are possible,
    depending on start and law. With the defaults, dry friction from rest oscillates permanently,
    whereas the soft bristles of `LuGre` (1e5 N/m) reach uniform slip. The web neither slips on the
    chill roll nor stretches; edge effects of the cylinder are neglected.
    Source: A Friction Model for Laminator Nips, MSc thesis TFRT-5968, Lund 2015, section 2.9.
    """

    t_end: ClassVar[float] = 8.0
    inputs: ClassVar[Mapping[str, GivenInput]] = {
        "v_set": GivenInput("0.5 min(t / 4, 1)", machine_start),
        "load": GivenInput("500 + 25 sin(5 t)", pressing),
    }

    J: Scalar = fields.INERTIA(0.2, doc="inertia of the roller")
    R: Scalar = fields.SIZE(0.1, doc="radius of the roller")
    k: Scalar = fields.SHAFT(200.0, doc="stiffness of its shaft")
    d: Scalar = fields.DRAG(0.5, doc="damping of its shaft")
    tau: Scalar = param(
        0.1, unit="s", role="time", doc="time constant of the line's drive", lower=1e-9
    )
    lag: Scalar = fields.START(
        0.015, unit="1", doc="share by which its drive lags", lower=0.0, upper=1.0
    )
    N_0: Scalar = fields.LOAD(1.0, doc="load of the open nip")

    def equations(self, p: Variables) -> Model:
        """Return the model: states v_line, v_rel, twist and those of the law; v_set, load."""
        twist = Variable("twist", "rad", nominal=0.01, doc="twist of the shaft")
        v_rel = Variable("v_rel", "m/s", nominal=0.01, doc="slip of the web over the nip roller")
        line = Variable("v_line", "m/s", nominal=0.1, doc="speed of the web")
        target = Variable("v_set", "m/s", nominal=0.1, doc="speed that the line is set to")
        load = Variable("load", "N", nominal=100.0, doc="force that presses the nip roller")
        N = self.N_0 + smooth.positive(load.symbol, 0.0)
        v, twisting = v_rel.symbol, (v_rel.symbol - self.lag * line.symbol) / self.R
        shaft = self.k * twist.symbol + self.d * twisting
        gain = (target.symbol - line.symbol) / self.tau
        mass = self.J / (self.R * self.R)
        pull = mass * gain - shaft / self.R
        web = contact("web", self.law, v, N, rest={"v_rel": 0.0}, least=self.N_0, F_e=pull)
        return Model(
            name="nip",
            x=(line, v_rel, twist),
            u=(target, load),
            p=p,
            ode=ca.vertcat(gain, (pull - web.force) / mass, twisting),
            contacts=(web,),
            outputs={
                "w_roller": Output((line.symbol - v) / self.R, "rad/s", "speed of the nip roller"),
                "N": Output(N, "N", "normal force of the nip"),
                "torque": Output(shaft, "N m", "torque of the shaft on the roller"),
                **friction_outputs(web, "v_rel"),
            },
            sketch=self._sketch,
        )

    def _sketch(self) -> Sketch:
        """Return both rollers with the web between them, and the shaft's spring, at rest."""
        return drawn(
            {"chill_roll": RailBody(0.0, 1.6), "roller": RailBody(0.0, -1.0, label="J")},
            {"rim": (0.0, 3.2), "rim_roller": (0.0, -2.0), "drive": (-2.4, -1.0),
             "web_in": (-2.4, 0.0), "web_out": (2.4, 0.0)},
            [("circle", "chill_roll", "rim", ""), ("circle", "roller", "rim_roller", "R"),
             ("rod", "web_in", "web_out", ""), ("strut", "drive", "roller", "k, d")],
            hub=RailBody(0.0, 0.0, "", "v_rel", self.law, contact="web"),
            arrows=[("v_line", (1.8, 0.0), "x"), ("v_set", (1.8, 0.0), "x"),
                    ("w_roller", "roller", "turn y"), ("load", "roller", "z")],
        )  # fmt: skip
