"""Multi-phase problem of a mode sequence, with one phase of mode models for each arc.

The user's conditions apply by name to all arcs of a phase. The following conditions on each contact
ensure that the arcs are a motion with exact Coulomb friction and stiction:

* In slip the sliding velocity has the sign of the mode: slip >= 0 or <= 0.
* In stick the reaction is within the static level in both directions: |F| <= F_s.
* At a change of mode slip = 0, at the end of slipping and at the start of the next mode.
* At the end of stick, or at a reversal, the contact breaks away: the force that would hold it under
  the control *after* this time reaches the static level. The force may exceed the level, because
  controls jump, so the condition is an inequality. Without it a body could start to move although
  friction can hold it, at a lower, wrong cost.
* A contact that stops when the control changes must be caught. If it stops slightly earlier, the
  previous control may reverse it; it then slips back for a moment and stops only if the force under
  the next control is below the sliding force, not just below the static level.
* A contact that stops must be decelerated by a share of the sliding force. If slip only touches
  zero, or a larger force is necessary after a jump of the control, a small deviation would let it
  continue to slip.

Solvers need independent conditions, so dependent ones are omitted: slip remains zero in stick, and
no condition is imposed on it at the end of stick.

Source: Brogliato, Nonsmooth Mechanics, 3rd ed., 2016, ch. 5; Betts, Practical Methods for Optimal
Control, 2nd ed., 2010, 2.8 and 3.7 (phases, linkage conditions).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import Any, NamedTuple, final

import casadi as ca

from ocp.formulation.changed_models import further_states, rebuilt, states_of
from ocp.formulation.phase import Chain, Free, Phase, Range, Span, Start, fixed, limits, meet
from ocp.formulation.problem import Problem
from ocp.formulation.statement import Duration, added_signals, forms_of, only
from ocp.friction.mode_models import SIDES, excess, holding, mode_model
from ocp.friction.sequence import Arc, Leg, Legs
from ocp.friction.smooth_models import sticking
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked
from symfric.model import Contact, Model, Output

MARGIN = 1e-2
"""Initial friction margin: distance of stiction below the static level, and of a jumping control
above it at break-away, as a share of the level. A smooth law creeps just below its peak, and with
constant inputs a force at its limit is a sawtooth. If a contact breaks away by a force that cannot
jump, the margin decreases to zero at the end of the arc."""
FADE = 1e-3
"""Duration of this decrease, relative to the total duration."""
LEVEL = -1e-6
"""Friction margin in the direction of such a break-away. It is slightly negative, because the
break-away condition at the end of stick would otherwise be a dependent condition."""
SIGN = 1e-7
"""Magnitude up to which a sliding velocity that is not a state may have the wrong sign. With zero,
the condition at an end of slipping would be dependent."""
CATCH = 5.0
"""Distance below the sliding force, in margins, of the force at which a contact is caught or
stopped. With zero, a small deviation could let the contact continue to slip."""

FIRST = "_first_"
PULLED = "_pull"
CAUGHT = "_catch"
STOPPED = "_stop"
LEFT = "rest_left"
"""Name of the state with the remaining time [s] of an arc at whose end a contact breaks away."""

Ranges = dict[str, Range]
Sides = Mapping[str, int]
"""Contact -> direction of slip."""


class Rules(NamedTuple):
    """Settings common to all mode sequences of one problem.

    Attributes:
        problem: the user's problem.
        sizes: contact -> typical static level [N], which scales conditions on forces.
        at_rest: contacts that stick at the start.
        shortest: smallest duration of an arc [s].
        margin: friction margin as a share of the static level.
    """

    problem: Problem
    sizes: Mapping[str, float]
    at_rest: Sequence[str]
    shortest: float
    margin: float = MARGIN


def in_arcs(rules: Rules, legs: Legs) -> Problem:
    """Return the problem of mode models for the sequence `legs`, one phase for each arc.

    The durations of the arcs are initial values.
    """
    problem, fade = rules.problem, FADE * sum(leg.duration for leg in legs)
    phases = [arc.in_modes(fade) for arc in arcs_among(rules, legs)]
    added = {name for phase in phases for name in added_signals(problem, phase)}
    states = added | {v.name for v in phases[0].model.x}
    signals = {name for phase in phases for name in (*phase.model.signals, *phase.model.further)}
    parameters = {v.name for phase in phases for v in phase.model.p}
    return replace(
        problem,
        phases=Chain(tuple(phases)),
        bounds=only(problem.bounds, signals | added),
        p=only(problem.p, parameters),
        choose=only(problem.choose, parameters),
        durations=_durations(problem, legs),
        periodic=tuple(name for name in problem.periodic if name in states),
    )


def _durations(problem: Problem, legs: Legs) -> tuple[Duration, ...]:
    """Return the sums of durations of legs, and those given by the user."""
    first = 0
    sums: list[Duration] = []
    of_phase: dict[int, list[int]] = {}
    for leg in legs:
        numbers = list(range(first, first + len(leg.arcs)))
        first += len(leg.arcs)
        of_phase.setdefault(leg.phase, []).extend(numbers)
        phase = problem.chain[leg.phase]
        if isinstance(phase.T, Free):
            if len(numbers) > 1:
                sums.append((numbers, Free(phase.T.lower, phase.T.upper)))
        elif len(numbers) > 1 or phase.stops:
            fractions = [0.0, *phase.stops, 1.0]
            share = fractions[leg.part + 1] - fractions[leg.part]
            sums.append((numbers, share * phase.T))
    for phases, total in problem.durations:
        sums.append(([n for phase in phases for n in of_phase[phase]], total))
    return tuple(sums)


def arcs_among(rules: Rules, legs: Legs) -> tuple["ArcPhase", ...]:
    """Return all arcs with their neighbours."""
    pairs = [(leg, arc) for leg in legs for arc in leg.arcs]
    none: Sides = {}

    def continued(i: int) -> bool:  # True if states are continuous from arc i - 1 to arc i
        same = pairs[i - 1][0].phase == pairs[i][0].phase
        return same or not rules.problem.chain[pairs[i][0].phase].link

    found: list[ArcPhase] = []
    for i, (leg, arc) in enumerate(pairs):
        last = i == len(pairs) - 1
        leaves = {c: 0 for c, mode in arc.modes.items() if not mode}
        for c in leaves:
            later = (other.modes.get(c, None) for _, other in pairs[i + 1 :])
            leaves[c] = next((mode or 0 for mode in later if mode != 0), 0)
        opens = not i or pairs[i - 1][0].phase != leg.phase
        closes = last or pairs[i + 1][0].phase != leg.phase
        before = pairs[i - 1][1].modes if i and continued(i) else none
        after = none if last or not continued(i + 1) else pairs[i + 1][1].modes
        found.append(ArcPhase(rules, i, arc, leg, opens, closes, before, after, leaves))
    return tuple(found)


@final
@dataclass(frozen=True, eq=False)
class ArcPhase:
    """Arc with its neighbours, from which its phase is derived.

    Attributes:
        rules: settings of the problem.
        number: index of the arc.
        arc: the arc.
        leg: leg that contains the arc.
        opens, closes: True for the first and for the last arc of the user's phase.
        before, after: modes of the neighbours if states are continuous, otherwise empty.
        leaves: sticking contact -> direction of its next slip; 0 if it does not slip again.
    """

    rules: Rules
    number: int
    arc: Arc
    leg: Leg
    opens: bool
    closes: bool
    before: Sides
    after: Sides
    leaves: Sides

    @property
    def base(self) -> Phase:
        """The user's phase."""
        return self.rules.problem.chain[self.leg.phase]

    @cached_property
    def inputs(self) -> ca.SX:
        """Inputs that may jump, which have no bounded rate."""
        limited = forms_of(self.rules.problem, self.base)
        return stacked(v.symbol for v in self.base.model.u if v.name not in limited)

    def jumps(self, name: str, side: int) -> bool:
        """Return True if the force that holds a contact depends on an input that may jump."""
        modes = {**self.arc.modes, name: side}
        return ca.depends_on(excess(self.base.model, modes, name, side), self.inputs)

    @cached_property
    def released(self) -> list[str]:
        """Contacts that start to slip, or reverse, at the start of this arc."""
        first = dict.fromkeys(self.rules.at_rest, 0) if not self.number else {}
        was = {**first, **self.before}
        return [n for n, mode in self.arc.modes.items() if mode and was.get(n, mode) != mode]

    @cached_property
    def tight(self) -> Sides:
        """Sticking contact that breaks away by a force that cannot jump -> direction."""
        return {n: side for n, side in self.leaves.items() if side and not self.jumps(n, side)}

    @cached_property
    def leaving(self) -> Sides:
        """Contact that breaks away at the end by a force that cannot jump -> direction."""
        return {n: side for n, side in self.tight.items() if self.after.get(n) == side}

    @cached_property
    def stopped(self) -> Sides:
        """Contact that stops at the start -> direction of its previous slip."""
        return {n: side for n, side in self.before.items() if side and self.arc.modes.get(n) == 0}

    @cached_property
    def caught(self) -> Sides:
        """Contact that stops at the start under a control that may jump -> its direction."""
        return {n: side for n, side in self.stopped.items() if self.jumps(n, 1)}

    def model(self, fade: float) -> Model:
        """Return the mode model with the quantities in the conditions of the arc as outputs.

        Returns:
            A model with the output "<contact>_slip" and the following outputs as shares of the
            level: "<contact>_up" and "<contact>_down", the friction margins in both directions,
            minus margin tanh (remaining time / `fade`)^2 before break-away; "<contact>_first_up"
            and "<contact>_first_down", the margins at the start of an interval; "<contact>_pull",
            the excess of released contacts; "<contact>_catch", the margin of caught contacts to the
            sliding force backwards; "<contact>_stop", the margin of stopped contacts to the sliding
            force.
        """
        model, modes, sizes = self.base.model, self.arc.modes, self.rules.sizes
        kept: dict[Any, Model] = model.memory.setdefault("ocp arcs", {})
        groups = (modes, self.leaving, self.caught, self.stopped, sizes)
        margin = self.rules.margin
        key = (*(tuple(group.items()) for group in groups), *self.released, margin, fade)
        if key in kept:
            return kept[key]
        made = mode_model(model, modes)
        outputs: dict[str, ca.SX] = {}
        fading, catch = ca.SX(0), 1.0 - CATCH * margin
        if self.leaving:
            left = Variable(LEFT, "s", nominal=0.1)
            made = rebuilt(made, **further_states(made, (left,), ca.SX(-1.0)))
            fading = margin * ca.tanh((left.symbol / fade) ** 2)
        for c in sticking(model):
            outputs[f"{c.name}_slip"] = c.slip
            size, mode = sizes[c.name], modes[c.name]
            if mode and c.name not in self.released:
                continue
            force, margins = holding(model, modes, c.name)
            if mode:
                outputs[f"{c.name}{PULLED}"] = -margins[mode] / size
                continue
            for side, name in SIDES.items():
                less = fading if self.leaving.get(c.name) == side else 0.0
                outputs[f"{c.name}_{name}"] = made.expression(f"{c.name}_grip_{name}") / size - less
                outputs[f"{c.name}{FIRST}{name}"] = margins[side] / size
            if side := self.stopped.get(c.name, 0):
                ahead = side * c.sliding(side)
                outputs[f"{c.name}{STOPPED}"] = (catch * ahead - side * force) / size
            if side := self.caught.get(c.name, 0):
                back = -side * c.sliding(-side)
                outputs[f"{c.name}{CAUGHT}"] = (side * force + catch * back) / size
        new = {name: Output(expression, "1") for name, expression in outputs.items()}
        kept[key] = rebuilt(made, outputs={**made.outputs, **new})
        return kept[key]

    def in_modes(self, fade: float) -> Phase:
        """Return the phase of this arc with the user's conditions and those of its modes.

        The margin of a contact that breaks away decreases to zero within the time `fade` [s].
        """
        base, modes, margin, model = self.base, self.arc.modes, self.rules.margin, self.model(fade)
        start: Ranges = dict(base.start) if self.opens else {}
        link: dict[str, Start] = dict(base.link) if self.opens else {}
        end: Ranges = dict(base.end) if self.closes else {}
        ends = [s for s, here in ((0.0, self.opens), (1.0, self.closes)) if here and s in base.at]
        at = {s: base.at[s] for s in ends}
        if self.arc is self.leg.arcs[-1] and not self.closes:
            stop = base.stops[self.leg.part]
            end, at = dict(base.via.get(stop, {})), at | {1.0: base.at.get(stop, ())}
        if not self.opens:  # polynomials cover all arcs of a phase
            link |= {name: name for name in states_of(forms_of(self.rules.problem, base))}
        if self.leaving:
            start, end = start | {LEFT: (0.0, None)}, end | {LEFT: 0.0}
            link |= {LEFT: None} if self.number else {}
        bounds: Ranges = dict(base.bounds)
        for contact in sticking(base.model):
            name, found = contact.name, carrier(base.model, contact)
            state = found[0] if found else ""
            mode, was, then = modes[name], self.before.get(name), self.after.get(name)
            begins = was is not None or (not self.number and name in self.rules.at_rest)
            if state and ((mode == 0 and begins) or (was is not None and was != mode)):
                start[state] = 0.0
                link |= {state: None} if self.number else {}
            if not mode and not self.number and not state and not self._at_start(contact):
                start[f"{name}_slip"] = 0.0
            if not mode:
                end.pop(state, None)  # implied by stick
            elif then is not None and then != mode:
                end[state or f"{name}_slip"] = 0.0
            if mode:
                bounds |= self._direction(name, mode, found)
            else:
                for side, row in SIDES.items():
                    least = LEVEL if side == self.tight.get(name) else margin
                    bounds[f"{name}_{row}"] = (least, None)
                    # the start precedes the first collocation point
                    start[f"{name}{FIRST}{row}"] = (least, None)
                start |= {f"{name}{CAUGHT}": (0.0, None)} if name in self.caught else {}
                start |= {f"{name}{STOPPED}": (0.0, None)} if name in self.stopped else {}
            if name in self.released:
                start[f"{name}{PULLED}"] = self._pull(name)
        signals = {*model.signals, *model.further, *added_signals(self.rules.problem, base)}
        return replace(
            base,
            model=model,
            T=self._duration(),
            start=only(start, signals),
            end=only(end, signals),
            via={},
            at=at,
            bounds=only(bounds, signals),
            link=only(link, signals),
            joins=base.joins if self.opens else (),
            cost=base.cost if self.closes or base.cost is None else replace(base.cost, end=()),
            p=only(base.p, {v.name for v in model.p}),
            name=base.name if self.opens and self.closes else "",
        )

    def _at_start(self, contact: Contact) -> bool:
        """Return True if the prescribed start determines the slip of a contact."""
        nodes, x = self.rules.problem.spans[0].nodes[0.0], self.base.model.x
        return all(fixed(nodes[v.name]) for v in x if ca.depends_on(contact.slip, v.symbol))

    def _direction(self, name: str, mode: int, found: tuple[str, int] | None) -> Ranges:
        """Return the bound over the whole arc that fixes the direction of slip."""
        if found is None:
            return {f"{name}_slip": (-SIGN, None) if mode > 0 else (None, SIGN)}
        state, factor = found
        half = (0.0, inf) if mode * factor > 0 else (-inf, 0.0)
        return {state: meet(self.rules.problem.spans[self.leg.phase].boxes[state], half)}

    def _pull(self, name: str) -> Range:
        """Return the range of the excess of the holding force over the static level at break-away.

        A force that cannot jump is below the level before, so it equals the level at break-away.
        """
        modes = self.arc.modes
        if self.jumps(name, modes[name]):
            return (self.rules.margin, None)
        alone = all(modes[other] == mode for other, mode in self.before.items() if other != name)
        return 0.0 if alone and self.before.get(name) == 0 else (0.0, None)

    def _duration(self) -> float | Free:
        """Return a free duration, or the duration of the phase if it has no other arc."""
        T, shortest = self.base.T, self.rules.shortest
        if self.opens and self.closes:
            return T
        most = limits(T)[1]
        return Free(shortest, most, min(max(self.arc.duration, 2 * shortest), most))


def breaks_away(span: Span) -> bool:
    """Return True if some contact breaks away or is caught at the start of an arc."""
    return any(name.endswith((PULLED, CAUGHT)) for name in span.model.outputs)


def carrier(model: Model, contact: Contact) -> tuple[str, int] | None:
    """Return the state to which the slip of `contact` is proportional, and the sign of the factor.

    Return None if the slip is not a multiple of one state.
    """
    x = model.vector("x")
    slope = ca.SX(ca.jacobian(contact.slip, x))
    if slope.nnz() != 1 or not slope.is_constant():
        return None
    factor, index = float(ca.sum1(ca.sum2(ca.DM(slope)))), slope.sparsity().get_crs()[1][0]
    if not ca.is_equal(ca.simplify(contact.slip - factor * x[index]), ca.SX(0), 2):
        return None
    return model.x[index].name, 1 if factor > 0 else -1
