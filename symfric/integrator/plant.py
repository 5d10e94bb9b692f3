"""Model that advances from sample to sample with held inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.programs import CompileError, find_compiler
from symfric.foundation.status import SolveError, Status
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.many.members import fastest
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.running.crossings import Memory
from symfric.integrator.running.diagnosis import explain
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.plants import SAMPLES, Advance, InPython, Plants, Why, looking
from symfric.integrator.running.run import MOST_ORDERS

Numbers = Mapping[str, ArrayLike]


@final
class Plant:
    """Model that advances from sample to sample; created by `stepper`.

    Attributes:
        model: the equations.
        dt: interval between samples [s].
        failed: after a `SolveError`, number of each plant that did not reach its sample -> reason.
    """

    def __init__(
        self, integrator: Integrator, plants: Plants, backend: str, batch: int | None,
        tolerance: float,
    ) -> None:  # fmt: skip
        self.model, self.dt = integrator.model, plants.dt
        self.failed: dict[int, tuple[Status, str]] = {}
        self._plants, self._batch, self._tolerance = plants, batch, tolerance
        self._backend = "vm" if backend == "auto" and find_compiler() is None else backend
        self._fresh: dict[int, Array] = {}
        self._own, self._places = integrator, list[tuple[Array, Array]]()
        self._use(integrator)

    def _use(self, integrator: Integrator) -> None:
        """Continue with another integrator of the same equations."""
        self._integrator, plants = integrator, self._plants
        try:
            self._advance = self._loop(integrator)
        except CompileError:
            if self._backend == "compiled":
                raise
            self._backend = "vm"  # continue in the VM if the compiler is broken
            self._advance = self._loop(integrator)
        self._look, self._seen = looking(integrator, plants, self._backend), False
        nx, one = integrator.system.nx, self._batch is None
        states = plants.S[:, SRow.MEMORY : SRow.MEMORY + nx]
        self._x: Array = states[0] if one else states
        self._u: Array = plants.u[0] if one else plants.u

    def _loop(self, integrator: Integrator) -> Advance:
        """Return the function that advances the plants."""
        vm, plants = self._backend == "vm", self._plants
        self._in_python = vm or integrator.crossings is not None
        if self._in_python:
            engine = integrator.vm if vm else integrator.compiled
            return InPython(integrator, plants, engine, self._tolerance)
        return fastest(integrator, plants)

    def __repr__(self) -> str:
        many = "" if self._batch is None else f" x {self._batch}"
        return f"<plant '{self.model.name}'{many}, dt = {self.dt:g} s>"

    def step(self, u: ArrayLike | Numbers | None = None) -> Array:
        """Hold inputs for `dt` and return the states at the end, shape (nx,) or (batch, nx).

        Args:
            u: inputs in the order of the model, shape (nu,) or (batch, nu); a number if there is
                one input and one plant; or values by name, where a number applies to all plants
                and the other inputs keep their values. The default is the inputs held last, or
                the start values of the model in the first interval.

        Raises:
            ValueError: unknown names, a wrong shape or values that are not finite; the plant is
                unchanged.
            SolveError: a plant did not reach its sample; `failed` gives the plants and reasons, and
                `partial` the states. Call `reset` for this plant, or `step` with other inputs,
                which continues from its current time to the sample.
            KeyboardInterrupt: Ctrl-C; the plant is unchanged. Compiled code finishes first.
        """
        if not self._in_python:
            return self._go(u)
        before, fresh = self._plants.copy(), dict(self._fresh)
        try:
            return self._go(u)
        except KeyboardInterrupt:
            self._plants.back_to(before)
            self._fresh, self._seen = fresh, False
            raise

    def _go(self, u: ArrayLike | Numbers | None) -> Array:
        if u is not None:
            try:
                self._take(u)
            except ValueError:
                self._hold_on()
                raise
        if self._fresh:
            self._settle()
        self._seen = False
        if short := self._advance(1):
            self._mend(short)
        elif self.failed:
            self.failed = {}
        return self._x.copy()

    def reset(
        self,
        x0: Numbers | None = None,
        p: Numbers | None = None,
        members: Sequence[int] | None = None,
    ) -> Array:
        """Return plants to the start, with inputs at the start values of the model.

        Args:
            x0: start values by name; the other states start at the model's defaults.
            p: parameters by name; the other parameters keep their values.
            members: numbers of the plants; default all. Arrays in `x0` and `p` have one entry for
                each of them.

        Returns:
            The states of all plants, in the shape that `step` returns.

        Raises:
            ValueError: unknown names, arrays of wrong length or no consistent start; the plant is
                unchanged.
        """
        which = self._which(members)
        guesses, values = self._starts(
            self._each("x0", x0, which), self._each("p", p, which), which
        )
        plants, system = self._plants, self._integrator.system
        held = self.model.values("u")
        found: list[Array] = []
        for guess, own in zip(guesses, values, strict=True):
            found.append(self._integrator.consistent("stepper", guess, np.concatenate([own, held])))
        h = plants.first_step()
        remembered = Memory.new(len(self.model.events), self._tolerance)
        for b, guess, own, y in zip(which, guesses, values, found, strict=True):
            plants.S[b] = SRow.at(plants.begin[b], h, y)
            plants.R[b, RRow.d(system.nx)] = np.concatenate([own, held])
            plants.R[b, RRow.T_END] = plants.begin[b]
            plants.u[b], plants.count[b], plants.why[b] = held, 0, Why.END
            plants.memory[b] = remembered
            self._fresh[b] = guess
            self.failed.pop(b, None)
        if which:  # pivots that are stable at the start of the first plant
            self._places = [(guesses[0], plants.R[which[0], RRow.d(system.nx)].copy())]
            suited = self._own.suited(self._places, SAMPLES * self.dt)
            if suited is not self._integrator:
                self._use(suited)
        self._seen = False
        return self._x.copy()

    def copy(self) -> Plant:
        """Return an independent plant in the same state."""
        plants = self._plants.copy()
        other = Plant(self._integrator, plants, self._backend, self._batch, self._tolerance)
        other._fresh, other.failed = dict(self._fresh), dict(self.failed)
        other._own, other._places = self._own, list(self._places)
        return other

    def __deepcopy__(self, memo: dict[int, Any]) -> Plant:
        return self.copy()

    @property
    def t(self) -> Any:
        """Time [s]: a number, or with a batch one per plant, shape (batch,)."""
        t = self._plants.S[:, SRow.T]
        return float(t[0]) if self._batch is None else t.copy()

    @property
    def x(self) -> Array:
        """States, shape (nx,) or (batch, nx)."""
        return self._x.copy()

    @property
    def u(self) -> Array:
        """Inputs held now, shape (nu,) or (batch, nu)."""
        nu = self._u.shape[-1]
        held = self._plants.R[:, self._plants.R.shape[1] - nu :]
        return (held[0] if self._batch is None else held).copy()

    @property
    def attempts(self) -> int:
        """Number of attempted steps of all plants in the last interval."""
        return int(self._plants.made.sum())

    @property
    def happened(self) -> list[Any]:
        """Events of the last interval: (time [s], name), or (plant, time, name) with a batch."""
        found = self._plants.happened
        return [event[1:] for event in found] if self._batch is None else list(found)

    @property
    def terminated(self) -> Any:
        """True if a terminal event has ended the run of a plant, which then waits for `reset`.

        With a batch, the value is an array, shape (batch,).
        """
        over = self._plants.why == Why.OVER
        return bool(over[0]) if self._batch is None else over

    @property
    def signals(self) -> dict[str, Any]:
        """Name -> value of every signal: states, algebraic variables, inputs, outputs."""
        columns = self._looked.T
        values = columns[:, 0].tolist() if self._batch is None else columns.copy()
        return dict(zip(self.model.signals, values, strict=True))

    def __getitem__(self, name: str) -> Any:
        names = list(self.model.signals)
        checks.check_names(f"plant of '{self.model.name}'", [name], names)
        values = self._looked[:, names.index(name)]
        return float(values[0]) if self._batch is None else values.copy()

    @property
    def _looked(self) -> Array:
        """All signals, shape (plants, signals)."""
        if not self._seen:
            self._values, self._seen = self._look(), True
        return self._values

    def _take(self, u: ArrayLike | Numbers) -> None:
        """Store the inputs of the next interval."""
        where = f"plant of '{self.model.name}': u"
        if not isinstance(u, Mapping):
            self._write(where, self._u, u)
            return
        values = self.model.named("u", u)
        for i, v in enumerate(self.model.u):
            if v.name in values:
                part = self._u[..., i : i + 1]
                self._write(f"{where}: {v.name}", part, values[v.name], common=True)

    def _write(self, where: str, place: Array, value: Any, common: bool = False) -> None:
        """Store `value` in `place`; with `common`, a number applies to all plants."""
        given, single = np.asarray(value), place.shape[-1] == 1
        if given.dtype.kind not in "fiub":
            raise checks.refused(where, "numbers", value)
        if single and given.shape == place.shape[:-1]:
            given = given[..., None]
        if given.shape != place.shape and not (common and not given.ndim):
            or_ = f" or {place.shape[:-1]}" if single else ""
            raise ValueError(f"{where}: expected shape {place.shape}{or_}, got {given.shape}")
        place[...] = given

    def _hold_on(self) -> None:
        """Discard the inputs of the next interval, so that the current ones remain."""
        plants = self._plants
        plants.u[:] = plants.R[:, plants.R.shape[1] - plants.u.shape[1] :]

    def _settle(self) -> None:
        """Make the start values of new plants consistent with the inputs of the next interval."""
        plants, system = self._plants, self._integrator.system
        nu = plants.u.shape[1]
        if not np.isfinite(plants.u).all():
            return
        for b, guess in self._fresh.items():
            d = plants.R[b, RRow.d(system.nx)].copy()
            d[d.size - nu :] = plants.u[b]
            if system.free.any() and (d != plants.R[b, RRow.d(system.nx)]).any():
                plants.S[b, SRow.Y] = self._integrator.consistent("stepper", guess, d)
            plants.ready[b] = 1
        self._fresh.clear()

    def _mend(self, short: int) -> None:
        """Continue the plants that did not reach their sample; raise an error for lost ones."""
        plants = self._plants
        if short == Plants.REFUSED:
            given = self._u.tolist()
            self._hold_on()
            where = f"plant of '{self.model.name}': u"
            raise checks.refused(where, "finite numbers", given)
        self.failed = lost = dict[int, tuple[Status, str]]()
        while stopped := [b for b in np.flatnonzero(plants.why > 0).tolist() if b not in lost]:
            lost |= {b: why for b in stopped if (why := self._help(b)) is not None}
            if len(lost) < np.count_nonzero(plants.why > 0):
                self._advance(0)
        if lost:
            b, (status, message) = next(iter(lost.items()))
            which = "" if self._batch is None else f"plant {b}: "
            more = f" ({len(lost)} plants failed.)" if len(lost) > 1 else ""
            raise SolveError(which + message + more, status, self._x.copy())

    def _help(self, b: int) -> tuple[Status, str] | None:
        """Prepare a plant to continue, or return the reason why it cannot."""
        plants, system = self._plants, self._integrator.system
        t, y, d = plants.S[b, SRow.T], plants.S[b, SRow.Y], plants.R[b, RRow.d(system.nx)]
        where = f"stepper '{self.model.name}' at t = {t:.9g} s"
        if plants.why[b] == Why.ATTEMPTS:
            return Status.MAX_STEPS, f"{where}: {Status.MAX_STEPS.value}"
        if plants.why[b] == Why.STORM:
            return Status.EVENT_STORM, f"{where}: {Status.EVENT_STORM.value}"
        if plants.why[b] == Why.SEARCH:
            try:
                y[:] = consistent(system, where, y.copy(), d)
            except ValueError as error:
                return Status.SINGULAR, str(error)
        elif not self._found_pivots(y.copy(), d.copy()):
            status, message = explain(self._integrator, t, y, d, float(plants.S[b, SRow.H]))
            plants.S[b] = SRow.at(t, plants.first_step(), y.copy())  # so that a retry can work
            return status, message.replace("simulate", "stepper", 1)
        plants.why[b] = Why.AGAIN
        return None

    def _found_pivots(self, y: Array, d: Array) -> bool:
        """Return True if other pivots are stable where steps failed; use them from then on."""
        if len(self._places) > MOST_ORDERS:
            return False
        other = self._integrator.suited([*self._places, (y, d)], SAMPLES * self.dt)
        if other is self._integrator:
            return False
        self._places.append((y, d))
        self._use(other)
        return True

    def _which(self, members: Sequence[int] | None) -> list[int]:
        """Return the checked numbers of plants; all of them by default."""
        count = self._plants.S.shape[0]
        if members is None:
            return list(range(count))
        where = f"plant of '{self.model.name}': reset: members"
        every = checks.many(where, members, "numbers of plants")
        found = [checks.count(where, b, least=0, most=count - 1) for b in every]
        if len(set(found)) < len(found):
            raise ValueError(f"{where}: expected different numbers, got {found}")
        return found

    def _each(self, what: str, given: Numbers | None, which: list[int]) -> dict[str, Array]:
        """Return checked values by name, each with one entry per plant of `which`."""
        found: dict[str, Array] = {}
        for name, value in self.model.named(what, given).items():
            where = f"plant of '{self.model.name}': {what}: {name}"
            numbers = checks.array(where, value, ndim=None)
            if numbers.shape not in ((), (len(which),)) or (numbers.ndim and self._batch is None):
                many = "" if self._batch is None else f" or an array of {len(which)}"
                raise ValueError(f"{where}: expected a number{many}, got shape {numbers.shape}")
            found[name] = np.broadcast_to(numbers, (len(which),))
        for v in self.model.p if what == "p" else ():
            for end in (np.min, np.max) if v.name in found and which else ():
                v.within(f"plant of '{self.model.name}': p: {v.name}", float(end(found[v.name])))
        return found

    def _starts(
        self, x0: dict[str, Array], p: dict[str, Array], which: list[int]
    ) -> tuple[Array, Array]:
        """Return initial guesses of the unknowns and the parameters, one row for each plant."""
        plants, system, count = self._plants, self._integrator.system, len(which)
        own = plants.R[which, RRow.d(system.nx)].T
        every = {v.name: own[i] for i, v in enumerate(self.model.p)} | p
        if not count:
            return np.zeros((0, system.n)), np.zeros((0, len(every)))
        x, values = self.model.initial_states(x0, every, count, plants.begin[which])
        y = first_guess(system, self.model, x)
        if system.timed:
            y[:, -1] = plants.begin[which]
        return y, values
