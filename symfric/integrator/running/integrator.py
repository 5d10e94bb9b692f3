"""Adaptive integrator of one model, built once and run for any numerical values."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from threading import Lock
from time import perf_counter
from typing import Any, TypeVar, final

import casadi as ca
import numpy as np

from symfric.foundation.numeric import Array, Buffered, Scalar, is_casadi
from symfric.foundation.programs import CompileError
from symfric.foundation.variable import stacked
from symfric.integrator.compiled.columns import Columns, Prospect
from symfric.integrator.equations.blocks import Following, corrected, following
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.attempt import written
from symfric.integrator.methods.method import Method, suited
from symfric.integrator.running.contact_modes import ContactModes
from symfric.integrator.running.crossings import Crossings, crossings
from symfric.integrator.running.engine import (
    BATCH,
    CompiledEngine,
    Engine,
    VmEngine,
    Work,
    loop_source,
)
from symfric.integrator.running.events import Eventful
from symfric.model import Model
from symfric.model.kinds import MODE

JUDGED = 4
"""Number of argument sets of `Integrator.suited` whose results are cached."""
INLINE = 7000
"""Number of instructions above which a step consists of calls of blocks, which compile much faster.

Both engines run the same form.
"""
EVENT_BATCH = 8
"""Attempts per virtual machine call with events; attempts after an event are discarded."""
SPARE = 2
"""Number of buffer sets kept: one for a run, one for a run within its callback."""
REMEMBERED = 16
"""Number of integrators cached per model; the oldest is dropped first."""
T = TypeVar("T")
_LOCK = Lock()


def remember(known: dict[Hashable, T], key: Hashable, made: T, most: int) -> T:
    """Store `made` in `known` unless `key` is present, and return the stored object.

    If `known` has `most` entries, the oldest entry is removed. Threads may share `known`.
    """
    with _LOCK:
        if key not in known and len(known) >= most:
            del known[next(iter(known))]
        return known.setdefault(key, made)


@final
@dataclass(eq=False)
class Integrator:
    """System, step and Functions of a model with one structure of inputs.

    The engine affects speed only: both engines give the same bits.

    Mutable state is only a cache: engines, the time spent in the virtual machine (which decides
    when compiling saves time), the last start, and integrators of the same system with other
    pivots.

    Attributes:
        model, inputs, tableau: model, structure of its inputs, and method.
        whole: system, if its pivots are not those chosen by default; else None.
        memory: objects that other modules derive from the integrator.
        step: attempt as in `methods.attempt`.
    """

    model: Model
    inputs: InputData
    tableau: Method
    whole: System | None = None
    compile_time: float = 0.0
    vm_time: float = 0.0
    memory: dict[str, Any] = field(default_factory=dict[str, Any])
    _start: tuple[bytes, bytes, Array] = (b"", b"", np.zeros(0))
    _others: dict[Hashable, "Integrator"] = field(default_factory=dict[Hashable, "Integrator"])
    _judged: dict[Hashable, "Integrator"] = field(default_factory=dict[Hashable, "Integrator"])
    _spare: list[Work] = field(default_factory=list[Work])

    def __post_init__(self) -> None:
        self.system: System = self.whole or system(self.model, self.inputs)
        self.step, self.instructions = written(self.system, self.tableau, INLINE)
        self.crossings: Crossings | None = None
        if self.model.events:
            manifold, (events, sizes) = self.system.manifold, self._event_functions
            closes, rows = manifold is not None and manifold.m > 0, self.tableau.H.shape[0]
            self.crossings = crossings(
                self.model, events, sizes, self.resets, rows, self.follows, closes
            )
        self.prospect = Prospect(self._source, ("symfric_march",), self.instructions)

    @cached_property
    def f(self) -> ca.Function:
        """Right-hand sides as a Function (y, d)."""
        return ca.Function("f", [self.system.y, self.system.d], [self.system.f])

    @property
    def events(self) -> ca.Function:
        """Event expressions as a Function (t, y, d)."""
        return self._event_functions[0]

    @cached_property
    def resets(self) -> ca.Function:
        """Values of all resets as a Function (t, y, d)."""
        resets = (ca.SX(new) for event in self.model.events for new in event.reset.values())
        return self.of_time("resets", stacked(resets))

    @cached_property
    def _event_functions(self) -> tuple[ca.Function, ca.Function]:
        """Return the Functions (t, y, d) of the event expressions and of their magnitudes.

        A magnitude is the sum of the magnitudes of the contributions of t and y to an expression.
        Within a step, algebraic unknowns are accurate to the tolerance, and after an event exact.
        Without one Newton step, an event that depends on them could pass through zero a second time
        there. The event expressions therefore contain this step, except for mechanisms.
        """
        s, t = self.system, ca.SX.sym("time")
        values = stacked(ca.SX(e.expression) for e in self.model.events)
        events, of = self.of_time("events", ca.densify(values)), ca.vertcat(t, s.y)
        expressions = events(t, s.y, s.d)
        size = ca.fabs(ca.jacobian(expressions, of)) @ ca.fabs(of)
        sizes = ca.Function("sizes", [t, s.y, s.d], [size])
        moved = s.y[np.flatnonzero(s.free.any(axis=1)).tolist()]
        if s.manifold is None and ca.depends_on(expressions, moved):
            solved = events(t, corrected(s)(s.y, s.d), s.d)
            events = ca.Function("events", [t, s.y, s.d], [solved], {"cse": True})
        return events, sizes

    @cached_property
    def events_at(self) -> Buffered:
        """Event expressions at (t, y, d), for single calls."""
        return Buffered(self.events)

    @cached_property
    def schedules(self) -> tuple[str, ...]:
        """Serialised event expressions in time only, which error control does not see."""
        own, t = [ca.SX(event.expression) for event in self.model.events], self.model.t
        alone = (e for e in own if all(ca.is_equal(s, t) for s in ca.symvar(e)))
        return tuple(ca.SX.serialize(e) for e in alone)

    def of_time(self, name: str, expression: ca.SX) -> ca.Function:
        """Return `expression` of the model as a Function (t, y, d) with the inputs inserted."""
        s, u = self.system, self.model.vector("u")
        driven = ca.substitute(expression, u, self.inputs.expression)
        t = ca.SX.sym("time") if s.timed else self.model.t
        return ca.Function(name, [t, s.y, s.d], [driven])

    @cached_property
    def follows(self) -> bool:
        """True if there are algebraic unknowns, which have to follow jumps."""
        return bool(self.system.free.any()) or self.system.manifold is not None

    @cached_property
    def follow(self) -> Following | None:
        """Update of the algebraic unknowns after a jump of inputs or states, if there are any."""
        return following(self.system)

    @property
    def _every(self) -> ca.SX:
        """All signals of the model, with modes as integers."""
        m = self.model
        x = (in_results(v.kind, v.symbol) for v in m.x)
        outputs = (ca.SX(o.expression) for o in m.outputs.values())
        return ca.vertcat(*x, m.vector("z"), m.vector("u"), *outputs)

    @cached_property
    def signals(self) -> ca.Function:
        """All signals of the model as a Function (t, y, d), with refined unknowns."""
        return self.refined(self._every)

    def refined(self, expression: ca.SX) -> ca.Function:
        """Return `expression` as a Function (t, y, d), for a mechanism at refined unknowns.

        Between steps, the constraints of a mechanism hold only to the tolerance; in results they
        hold exactly.
        """
        signals, s = self.of_time("signals", expression), self.system
        if s.manifold is None:
            return signals
        t, y, d = ca.SX.sym("t"), ca.SX.sym("y", s.n), ca.SX.sym("d", s.d.numel())
        return ca.Function("signals", [t, y, d], [signals(t, corrected(s)(y, d), d)])

    @cached_property
    def signal_columns(self) -> Columns:
        """Evaluation of the signals at many times."""
        return Columns(self.signals)

    @cached_property
    def plain_signal_columns(self) -> Columns:
        """Evaluation of the signals at many times, not refined, with the drift of constraints."""
        return Columns(self.of_time("signals", self._every))

    @cached_property
    def states(self) -> Columns | None:
        """Projection (y, d) -> states at many times; None if the states need no projection.

        Between steps, the loops of a mechanism are closed only to the tolerance.
        """
        s, manifold = self.system, self.system.manifold
        if manifold is None or not manifold.m:
            return None
        projected = manifold.project(s.y, s.d)[: s.nx]
        return Columns(ca.Function("states", [s.y, s.d], [projected], {"cse": True}))

    @cached_property
    def contact_modes(self) -> ContactModes:
        """Decision of the modes of several contacts at one time."""
        return ContactModes.of(self.model, self.of_time)

    def decided(self, t: float, before: Array, y: Array, d: Array) -> Array:
        """Return `y` with consistent modes of all contacts; unchanged if there are none.

        `before` contains the unknowns before the events that led to `y`.
        """

        def solve(y: Array) -> Array:
            if self.follow is None:
                return y
            found = self.follow(y, d)
            return self.consistent(f"model '{self.model.name}'", y, d) if found is None else found

        found = self.contact_modes.decided(t, before, y, d, solve)
        return y if found is None else found

    def start(self, y: Array, d: Array) -> Array:
        """Return `y` with consistent algebraic unknowns; cached for runs from the same start.

        Raises:
            ValueError: no consistent values were found nearby.
        """
        if not self.follows:
            return y
        key, last = (y.tobytes(), d.tobytes()), self._start
        if last[:2] != key:  # another thread may replace the cached start meanwhile
            last = self._start = (*key, self.consistent(f"model '{self.model.name}'", y, d))
        return last[2]

    def consistent(self, where: str, y: Array, d: Array) -> Array:
        """Return `y` with consistent algebraic unknowns.

        Raises:
            ValueError: no consistent values were found nearby; the message begins with `where`.
        """
        manifold = self.system.manifold
        # normal forces need the full search; models without inputs seldom need a second start
        quick = manifold is not None and not manifold.applied and bool(self.model.u)
        return consistent(self.system, where, y, d, self.follow if quick else None)

    def suited(self, points: Sequence[tuple[Array, Array]], span: float) -> "Integrator":
        """Return this integrator, or one of the same model with stable pivots.

        The result depends on the arguments only, not on earlier runs.

        Args:
            points: (y, d) that a run has to pass, the newest last; the algebraic unknowns of the
                first one are computed here.
            span: duration of the run [s].
        """
        if not self.system.has_pivots:
            return self
        key = (*(part.tobytes() for point in points for part in point), span)
        found = self._judged.get(key)
        if found is None:
            consistent_at = [(self.start(*points[0]), points[0][1]), *points[1:]]
            found, whole = self, suited(self.system, self.tableau, consistent_at, span)
            if whole is not self.system:
                orders = tuple(sorted(whole.orders.items()))
                if orders not in self._others:
                    other = Integrator(self.model, self.inputs, self.tableau, whole)
                    self._others[orders] = other
                found = self._others[orders]
            remember(self._judged, key, found, JUDGED)
        return found

    def borrow(self) -> Work:
        """Return buffers for exclusive use by a run; threads and callbacks may start other runs."""
        try:
            return self._spare.pop()
        except IndexError:
            events = None if self.crossings is None else Eventful(self.crossings)
            sizes = self.system.n, self.step.numel_in(1), self.tableau.H.shape[0]
            return Work(*sizes, events=events)

    def give_back(self, work: Work) -> None:
        """Return buffers after a run; a few are kept for the next one."""
        if len(self._spare) < SPARE:
            self._spare.append(work)

    @cached_property
    def vm(self) -> Engine:
        """Engine that needs no compiler."""
        size = EVENT_BATCH if self.model.events else BATCH
        return VmEngine(self.step, size, self.follows)

    def _source(self) -> str:
        """Return the C source of the loop."""
        # models without inputs and events seldom jump: not worth the compile time
        jumps = bool(self.model.u or self.model.events)
        follow = self.follow if self.follows and jumps else None
        parts = self.crossings, self.follows, follow, self._decision
        return loop_source(self.step, self.tableau.H.shape[0], *parts)

    @property
    def _decision(self) -> ContactModes | None:
        """Decision for compiled code; None if it is for Python, or if there is one contact."""
        crossings = self.crossings
        if crossings is None or crossings.closes or not crossings.decided.any():
            return None
        solved = self.follow is not None or not self.follows
        return self.contact_modes if solved and len(self.contact_modes.contacts) > 1 else None

    @cached_property
    def compiled(self) -> Engine:
        """Engine in compiled C; the library is compiled, or loaded from the cache, on first use.

        Raises:
            CompileError: no compiler was found, or it failed.
        """
        begin = perf_counter()
        engine = CompiledEngine(self.prospect.written())
        self.compile_time = perf_counter() - begin
        return engine

    def choose(self, backend: str, left: float) -> Engine:
        """Return the engine for `backend`; "auto" compiles if that is expected to save time.

        Args:
            backend: "vm", "compiled" or "auto".
            left: estimated time [s] that the virtual machine still needs, 0 if unknown.
        """
        if backend == "vm":
            return self.vm
        if backend == "compiled" or "compiled" in self.__dict__:
            return self.compiled
        if self.prospect.pays(max(left, self.vm_time)):
            try:
                return self.compiled
            except CompileError:  # simulate in the VM if the compiler is broken
                self.prospect.hopeless = True
        return self.vm


def in_results(kind: str, value: Scalar) -> Scalar:
    """Return the value of a variable of this kind for results; modes are rounded to integers."""
    if kind != MODE:
        return value
    return ca.floor(value + 0.5) if is_casadi(value) else np.floor(value + 0.5)


def built(model: Model, inputs: InputData, method: Method) -> tuple[Integrator, bool]:
    """Return the integrator of this model, input structure and method, and True if it is new.

    The cache belongs to the model: an integrator refers to its model, and a global table would keep
    both alive forever.
    """
    known: dict[Hashable, Integrator] = model.memory.setdefault("integrators", {})
    key = (method.name, method.finer, inputs.key)
    found = known.get(key)
    if found is not None:
        return found, False
    return remember(known, key, Integrator(model, inputs, method), REMEMBERED), True
