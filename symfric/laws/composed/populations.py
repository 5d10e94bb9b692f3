"""Friction of many random contacts: reference models that cannot be used in optimisation.

The force depends on the history of contacts that are made and lost at random. Smooth laws are
identified from the results and compared with them. A single contact is an expression, like a law.
Therefore a population runs in NumPy, on arrays of all contacts, and as generated C, in a loop.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import ceil
from typing import ClassVar, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.numeric import Array, Scalar, column, expm1, sin
from symfric.foundation.parameters import Parametric, parametric
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, Input, Law, State

SPEEDS = 20
"""Number of speeds per decade at which the mean force is computed."""


@final
@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts of a population at one time.

    Attributes:
        z: states of the contacts, shape (states, count).
        r: random number of each contact, shape (count,).
        random: generator of new random numbers.
    """

    z: Array
    r: Array
    random: np.random.Generator


@parametric
class Population(Parametric, ABC):
    """Friction of `count` contacts that are made and lost at random, reproducible by `seed`.

    A population has figures and a force along a prescribed motion. It has no rate, so it is not a
    `Law` and cannot be used in scenes.
    """

    facts: ClassVar[Facts]
    redraws: ClassVar[bool]
    """True if contacts draw a new random number at every step."""

    count: int
    seed: int

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, least in (("count", 1), ("seed", 0)):
            whole = checks.count(f"{type(self).__name__}: {name}", getattr(self, name), least=least)
            object.__setattr__(self, name, whole)

    @property
    @abstractmethod
    def states(self) -> tuple[State, ...]:
        """States of one contact."""

    @property
    def inputs(self) -> tuple[Input, ...]:
        """Empty tuple, since v and N are the only inputs."""
        return ()

    @property
    @abstractmethod
    def velocity_scale(self) -> float:
        """Sliding velocity [m/s] over which the mean force changes; inf without such a scale."""

    @property
    @abstractmethod
    def stiffness(self) -> float:
        """Stiffness at rest [N/m]."""

    @property
    @abstractmethod
    def path(self) -> float:
        """Length of the path [m] after which every contact has been renewed."""

    @property
    def step(self) -> float:
        """Largest path [m] of one step of a contact."""
        return self.path / 20

    @abstractmethod
    def contact(self, z: Scalar, r: Scalar, dx: Scalar, dt: Scalar, N: Scalar) -> Scalar:
        """Return the states of one contact after a step, followed by its force [N].

        The step is the path dx [m] in the time dt [s]. `z` contains the states of the contact, `r`
        is its random number, and N [N] is the load of the whole population. The arguments are
        floats, arrays over all contacts or CasADi symbols.
        """

    @abstractmethod
    def _draw(self, random: np.random.Generator) -> tuple[Array, Array]:
        """Return the states (states, count) and random numbers (count,) of unloaded contacts."""

    def begin(self) -> Contacts:
        """Return unloaded contacts at random positions."""
        random = np.random.default_rng(self.seed)
        return Contacts(*self._draw(random), random)

    def advance(self, contacts: Contacts, dx: float, dt: float, N: float) -> tuple[Contacts, float]:
        """Return the contacts and their force [N] after the path `dx` [m] in the time `dt` [s].

        N [N] is the load. A path longer than `step` is divided into several steps.
        """
        z, r, rows = contacts.z, contacts.r, np.zeros(0)
        parts = max(1, ceil(abs(dx) / self.step * (1 - 1e-9)))
        for _ in range(parts):
            if self.redraws:
                r = contacts.random.uniform(-1.0, 1.0, self.count)
            rows = self.contact(z, r, dx / parts, dt / parts, N)
            z = rows[:-1]
        return Contacts(z, r, contacts.random), float(rows[-1].sum())

    def force(self, t: ArrayLike, x: ArrayLike, N: float) -> Array:
        """Return the force [N] along the motion x(t) [m] at the load N [N].

        The contacts are unloaded at the first time.

        Raises:
            ValueError: t does not increase, or t and x differ in length.
        """
        where = f"{type(self).__name__}.force"
        t, x = checks.times(f"{where}: t", t), checks.array(f"{where}: x", x)
        checks.number(f"{where}: N", N, unit="N", lower=0.0)
        if t.shape != x.shape or t.size < 2:
            raise ValueError(
                f"{type(self).__name__}: expected rising times t and as many positions x, got "
                f"shapes {t.shape} and {x.shape}"
            )
        contacts, F = self.begin(), np.zeros(t.size)
        contacts, F[0] = self.advance(contacts, 0.0, 0.0, N)
        for i, (dx, dt) in enumerate(zip(np.diff(x), np.diff(t), strict=True), start=1):
            contacts, F[i] = self.advance(contacts, dx, dt, N)
        return F

    def steady_force(self, v: ArrayLike, N: float) -> Array:
        """Return the mean force [N] in steady sliding at `v` [m/s]; 0 at rest.

        It is computed at 20 speeds per decade over the range of `v` and interpolated between them.
        """
        where = f"{type(self).__name__}.steady_force"
        v = checks.array(f"{where}: v", v, ndim=None)
        checks.number(f"{where}: N", N, unit="N", lower=0.0)
        moving = np.abs(v[v != 0])
        if not moving.size:
            return np.zeros(v.shape)
        low, high = np.log(moving.min()), np.log(moving.max())
        speeds = np.linspace(low, high, 2 + int(SPEEDS * (high - low) / np.log(10.0)))
        means = [self._mean_force(speed, N) for speed in np.exp(speeds)]
        at = np.interp(np.log(np.abs(np.where(v == 0, 1.0, v))), speeds, means)
        return np.where(v == 0, 0.0, smooth.sign(v, 0.0) * at)

    def _mean_force(self, v: float, N: float) -> float:
        """Return the mean force [N] at the speed `v` [m/s], after all contacts were renewed."""
        contacts, F, parts = self.begin(), np.zeros(80), 40
        for i in range(F.size):
            contacts, F[i] = self.advance(contacts, self.path / parts, self.path / parts / v, N)
        return float(F[parts:].mean())

    def warnings(self) -> tuple[str, ...]:
        """Return an empty tuple, since all parameters within their bounds are valid."""
        return ()


AnyLaw = Law | Population
"""Law or population; both have a name, facts and figures."""


@parametric
class GenericAsperity(Population):
    """Generic asperity-level friction: many elastic contacts that age (a population).

        s+   = s + dx/lam  modulo 1,  in contact while s < duty
        t_c+ = t_c + dt in contact, else 0
        mu   = mu_0 + (mu_inf - mu_0) (1 - exp(-t_c/tau_c))
        N_c  = N pi / (2 duty count) sin(pi s/duty)
        d+   = d + dx within +-mu N_c/k_c in contact, else 0
        F    = sum of k_c d over `count` asperities

    Each asperity meets a counterface of period lam at a random phase s. Its load is a half sine of
    s, and the loads of all asperities add up to N. In contact it is a spring of random stiffness
    k_c (1/2 to 3/2 of the mean), which sticks up to a force that grows with its age and then slips.
    When the contact is lost, the energy of the spring is dissipated.
    Limits: mu_0 N in fast sliding and mu_inf N in slow sliding, both reduced by springs that have
    not reached their limit. Hysteresis with memory, velocity weakening, lag and dwell result from
    the contacts. The scatter of the force decreases as 1/sqrt(count). Reconstructed from the text.
    Source: Al-Bender, Lampaert, Swevers, Tribol. Lett. 16(1-2), 2004.
    Checked: reconstructed from the description in the text.
    """

    facts: ClassVar[Facts] = Facts(
        ("D", "S", "St", "P", "M", "L", "B", "N", "T"),
        "C0 in the position, random",
        "rebuilt",
        load="proportional in steady sliding",
    )
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("mu_0", "mu_inf"),)
    redraws: ClassVar[bool] = False

    k: Scalar = fields.STIFFNESS(1e6, doc="stiffness of all asperities in contact")
    mu_0: Scalar = fields.COEFFICIENT(0.05, doc="friction coefficient of a new contact")
    mu_inf: Scalar = fields.COEFFICIENT(0.2, doc="friction coefficient of an old contact")
    tau_c: Scalar = fields.TIME(0.05, doc="time in which a contact ages")
    lam: Scalar = fields.LENGTH(2e-5, doc="period of the counterface")
    duty: Scalar = fields.SHAPE(0.6, doc="share of a period in contact", lower=1e-3, upper=1.0)
    count: int = fields.SAMPLING(1000, doc="number of asperities", lower=1)
    seed: int = fields.SAMPLING(0, doc="seed of the random numbers", lower=0)

    @property
    def states(self) -> tuple[State, ...]:
        """Position in the period, stretch and age of one asperity."""
        stretch = State("d", "m", 1e-6, doc="stretch of the asperity")
        place = State("s", "1", 1.0, even=True, doc="place in the period")
        return (place, stretch, State("t_c", "s", 0.1, even=True, doc="age of the contact"))

    @property
    def velocity_scale(self) -> float:
        """Velocity at which a contact lasts for tau_c [m/s]."""
        return self.duty * self.lam / self.tau_c

    @property
    def stiffness(self) -> float:
        """Stiffness of all asperities in contact [N/m]."""
        return self.k

    @property
    def path(self) -> float:
        """Period of the counterface [m]."""
        return self.lam

    def contact(self, z: Scalar, r: Scalar, dx: Scalar, dt: Scalar, N: Scalar) -> Scalar:
        """Return the position, stretch, age and force [N] of an asperity after a step.

        The stiffness of the asperity is (1 + r/2) times the mean, with r in [-1, 1].
        """
        s = smooth.fraction(z[0] + dx / self.lam)
        along, k_c = s / self.duty, self.k / (self.count * self.duty) * (1 + r / 2)
        touches = along < 1
        age = smooth.choose(touches, z[2] + dt, 0.0)
        mu = self.mu_0 - (self.mu_inf - self.mu_0) * expm1(-age / self.tau_c)
        load = N * np.pi / (2 * self.duty * self.count) * sin(np.pi * along)
        top = smooth.choose(touches, mu * load / k_c, 0.0)
        d = smooth.clip(z[1] + dx, -top, top)
        return column(s, d, age, k_c * d)

    def _draw(self, random: np.random.Generator) -> tuple[Array, Array]:
        s, r = random.uniform(0.0, 1.0, self.count), random.uniform(-1.0, 1.0, self.count)
        return np.stack([s, 0 * s, 0 * s]), r


@parametric
class RandomBristles(Population):
    """Bristle friction of Haessig and Friedland (a population).

        d+ = d + dx, or a new random value within +-delta_s where |d + dx| > delta_s
        F  = sigma_0/count sum of d over `count` bristles

    A bristle snaps when it is stretched beyond delta_s, and bonds again on either side.
    Limits: the mean force in sliding is about half of sigma_0 delta_s, and at most sigma_0 delta_s.
    It depends neither on the velocity nor on the load. `HaessigFriedland` is the reset integrator
    of the same paper.
    Source: Haessig and Friedland, ASME J. Dyn. Syst. Meas. Control 113(3), 1991.
    """

    facts: ClassVar[Facts] = Facts(
        ("D", "S", "P"), "jumps at random", "unverified", load="independent"
    )
    redraws: ClassVar[bool] = True

    sigma_0: Scalar = fields.STIFFNESS(1e5, doc="stiffness of all bristles")
    delta_s: Scalar = fields.LENGTH(1e-5, doc="stretch at which a bristle snaps")
    count: int = fields.SAMPLING(25, doc="number of bristles", lower=1)
    seed: int = fields.SAMPLING(0, doc="seed of the random numbers", lower=0)

    @property
    def states(self) -> tuple[State, ...]:
        """Stretch of one bristle."""
        return (State("d", "m", 1e-6, doc="stretch of the bristle"),)

    @property
    def velocity_scale(self) -> float:
        """Infinite velocity scale, since the force depends on the path only."""
        return float("inf")

    @property
    def stiffness(self) -> float:
        """Stiffness of all bristles [N/m]."""
        return self.sigma_0

    @property
    def path(self) -> float:
        """Twice the stretch at which a bristle snaps [m]."""
        return 2 * self.delta_s

    def contact(self, z: Scalar, r: Scalar, dx: Scalar, dt: Scalar, N: Scalar) -> Scalar:
        """Return the stretch and the force [N] of a bristle after a step.

        A bristle that snaps bonds again at r delta_s, with r in [-1, 1].
        """
        d = z[0] + dx
        d = smooth.choose(smooth.magnitude(d, 0.0) > self.delta_s, r * self.delta_s, d)
        return column(d, self.sigma_0 / self.count * d)

    def _draw(self, random: np.random.Generator) -> tuple[Array, Array]:
        r = random.uniform(-1.0, 1.0, self.count)
        return r[None] * self.delta_s, r


def steady_force(law: AnyLaw, v: Array, N: float) -> Array:
    """Return the force [N] in steady sliding at the velocities `v` [m/s].

    Further inputs of the law have the value `Input.steady`, multiplied by the sign of v if the law
    is odd, so that an applied force pulls in the direction of sliding.
    """
    if isinstance(law, Population):
        return law.steady_force(v, N)
    return np.array(np.broadcast_to(in_steady_sliding(law, v, N), v.shape), dtype=float)


def in_steady_sliding(law: Law, v: Scalar, N: Scalar) -> Scalar:
    """Return the `steady_force` [N] of a law as numbers or as an expression."""
    ahead: Scalar = smooth.sign(v, 0.0) if law.facts.odd else 1.0
    given = {i.name: i.steady * ahead for i in law.inputs}
    return law.force(v, N, law.steady_state(v, N), **given)


def steady_inputs(law: AnyLaw) -> str:
    """Return the further inputs of `steady_force` as text, such as ", F_e = 1 N".

    The text is empty for a law without further inputs. For an odd law the values hold for v > 0.
    """
    return "".join(f", {i.name} = {i.steady:g} {i.unit}" for i in law.inputs)


@dataclass(frozen=True)
class Cost:
    """Number of CasADi instructions, including inputs and outputs.

    Attributes:
        value: instructions for force and rate together, or for one contact of a population.
        gradient: instructions for their derivatives with respect to v, N, the states and further
            inputs.
    """

    value: int
    gradient: int


def cost(law: AnyLaw) -> Cost:
    """Return the cost of `law` with numerical parameters; common subexpressions count once."""
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), ca.SX.sym("z", len(law.states))
    if isinstance(law, Population):
        r, dt = ca.SX.sym("r"), ca.SX.sym("dt")
        arguments, results = ca.vertcat(v, N, z, r, dt), law.contact(z, r, v * dt, dt, N)
    else:
        given = {i.name: ca.SX.sym(i.name) for i in law.inputs}
        arguments = ca.vertcat(v, N, z, *given.values())
        results = ca.vertcat(law.force(v, N, z, **given), law.rate(v, N, z, **given))
    both = results, ca.jacobian(results, arguments)
    return Cost(*(ca.Function("law", [arguments], [ca.cse(y)]).n_instructions() for y in both))
