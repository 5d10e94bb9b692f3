"""Ranges, formats and errors of the values of fixed-point C, by interval arithmetic over boxes.

The ranges of the inputs are divided into boxes. In each box, the range of every value is an
interval, and its error a bound of the difference from the value that real numbers give for the same
inputs. The format of a value, its number of fractional bits, follows from its range over the boxes
in which it is computed, so that its integer is at most 2^30. Boxes with the largest errors are
halved until the bound no longer falls.

A comparison of values with errors may decide otherwise near a tie. The error of a select then
includes the difference of its sides within the box.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import frexp
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.fixed.lowered import Cone, Hull
from symfric.codegen.fixed.operations import (
    BITS,
    CLAMP,
    INEXACT,
    LIMITS,
    OPERATIONS,
    OWN,
    RESULT,
    SCALE,
    Array,
    Ends,
    bits_of,
    operand_bits,
)
from symfric.emitter.branches import Placed
from symfric.emitter.logic import COMPARISONS, logical
from symfric.foundation.graph import SELECT

MOST = 500_000
"""Largest number of values, in all boxes."""
GAIN, PATIENCE = 0.01, 12
"""Relative fall of the bound that counts, and number of halvings without one before the end."""
TRIES = 6
Mask = NDArray[np.bool_]
Entry = tuple[int, int]


@final
class Bounds(NamedTuple):
    """Result of the analysis.

    Attributes:
        formats: fractional bits of each node.
        hulls: range of each node where it is computed.
        cones: argument of `narrowed`.
        boxes, by_box: boxes (inputs, 2, boxes), and the error of each result in each.
        fits: True if all integers with their errors are below 2^31.
    """

    formats: list[int]
    hulls: list[Hull]
    cones: dict[int, Cone]
    boxes: Array
    by_box: Array
    fits: bool

    @property
    def errors(self) -> Array:
        """Largest error of each result."""
        return self.by_box.max(axis=1)


def analysed(found: Placed, ranges: Mapping[Entry, Hull]) -> Bounds:
    """Return formats and error bounds of a lowered graph.

    Args:
        found: graph with its branches.
        ranges: range of each input, by its argument and row.

    Raises:
        ArithmeticError: a value is not bounded, or a comparison is too sensitive.
    """
    over = _Boxes(found, ranges)
    idle, best = 0, over.bounds(_grid([*ranges.values()], MOST // len(over.nodes)))
    while idle < PATIENCE:
        level = np.minimum(best.errors, np.finfo(float).max)[:, None]
        split: Mask = np.any(best.by_box >= np.maximum(0.5 * level, np.finfo(float).tiny), axis=0)
        count = len(over.nodes) * (best.boxes.shape[2] + split.sum())
        if not split.any() or count > MOST:
            break
        boxes = np.concatenate([best.boxes[..., ~split], over.halved(best, split)], axis=2)
        new = over.bounds(boxes)
        gain = (new.errors < (1.0 - GAIN) * best.errors).any()
        best, idle = new, 0 if gain else idle + 1
    if not best.fits:
        raise ArithmeticError(
            "a quotient near a zero divisor, an argument beyond the domain of a function, or an "
            "error above an eighth of the largest value"
        )
    return best


def _grid(ranges: Sequence[Hull], most: int) -> Array:
    """Return boxes (inputs, 2, boxes): the first input in octaves about 0, the others in thirds.

    The others are halves or whole if this would make more than about `most` boxes.
    """
    (low, high), *others = ranges
    octaves = max(abs(low), abs(high)) * 2.0 ** np.arange(-24, 1)
    first = np.unique(np.clip([*-octaves, 0.0, *octaves], low, high))
    parts = next((n for n in (3, 2) if first.size * n ** len(others) <= most), 1)
    edges = [first, *(np.linspace(*ends, parts + 1) for ends in others)]
    low, high = (
        np.meshgrid(*(e[k : e.size - 1 + k] for e in edges), indexing="ij") for k in (0, 1)
    )
    return np.array([[a.ravel(), b.ravel()] for a, b in zip(low, high, strict=True)])


@final
@dataclass
class _Boxes:
    """Analysis of a graph over boxes of its inputs, for the arguments of `analysed`."""

    found: Placed
    ranges: Mapping[Entry, Hull]

    def __post_init__(self) -> None:
        self.nodes = self.found.source.nodes
        self.bools = logical(self.nodes)
        self.results = [i for row in self.found.source.results for i in row]
        self.sizes = {entry: bits_of(max(map(abs, ends))) for entry, ends in self.ranges.items()}
        # results of states have the formats of the states
        states = {self.results[j]: self.sizes[i, j] for i, j in self.ranges if i == 0}
        self.fixed = states | {
            i: self.sizes[n.entry] for i, n in enumerate(self.nodes) if n.op == ca.OP_INPUT
        }

    def bounds(self, boxes: Array) -> Bounds:
        """Return the analysis over `boxes`; slack of comparisons grows until it covers errors."""
        slack = {
            i: np.zeros(boxes.shape[2]) for i, n in enumerate(self.nodes) if n.op in COMPARISONS
        }
        with np.errstate(all="ignore"):
            for _ in range(TRIES):
                values = self._values(boxes, slack)
                executed = self._executed(values)
                hulls = self._hulls(values, executed)
                formats = self._formats(hulls)
                errors, needed = self._errors(values, formats)
                if all((needed[i] <= slack[i]).all() for i in slack):
                    break
                slack = {i: np.maximum(slack[i], 1.01 * needed[i]) for i in slack}
            else:
                raise ArithmeticError("a comparison whose error grows with itself")
        fits = not any(
            (executed[self.found.place[i]] & (own > 2.0 ** (BITS - 3 - formats[i]))).any()
            for i, own in enumerate(errors)
            if self.nodes[i].op not in (CLAMP, ca.OP_TANH)
        )
        by_box = np.array([errors[i] for i in self.results])
        return Bounds(formats, hulls, self._cones(values, boxes), boxes, by_box, fits)

    def halved(self, best: Bounds, split: Mask) -> Array:
        """Return the boxes `split`, each halved along the input that reduces the error most."""
        own, halves, errors = best.boxes[..., split], list[Array](), list[Array]()
        for k in range(len(self.ranges)):
            both = np.concatenate([own, own], axis=2)
            middle = own[k].mean(axis=0)
            both[k, 1, : middle.size] = both[k, 0, middle.size :] = middle
            halves.append(both)
            made = self.bounds(both).by_box.max(axis=0).reshape(2, -1).max(axis=0)
            errors.append(np.where(own[k, 1] > own[k, 0], made, np.inf))
        return np.choose(np.tile(np.argmin(errors, axis=0), 2), halves)

    def _values(self, boxes: Array, slack: Mapping[int, Array]) -> list[Ends]:
        """Return the ends of every value; of a bool, where it may be true and where false."""
        rows = dict(zip(self.ranges, boxes, strict=True))
        found: list[Ends] = []
        for i, node in enumerate(self.nodes):
            args = [found[j] for j in node.args]
            match node.op:
                case ca.OP_INPUT:
                    found.append((rows[node.entry][0], rows[node.entry][1]))
                case ca.OP_CONST:
                    value = np.full(boxes.shape[2], node.value)
                    found.append((value, value))
                case ca.OP_NOT:
                    found.append((args[0][1], args[0][0]))
                case ca.OP_AND:
                    found.append((args[0][0] & args[1][0], args[0][1] | args[1][1]))
                case ca.OP_OR:
                    found.append((args[0][0] | args[1][0], args[0][1] & args[1][1]))
                case _ if node.op in COMPARISONS:
                    found.append(_compared(node.op, *args[0], *args[1], slack[i]))
                case _ if node.op == SELECT:
                    (yes, no), a, b = args
                    low = np.minimum(np.where(yes, a[0], np.inf), np.where(no, b[0], np.inf))
                    high = np.maximum(np.where(yes, a[1], -np.inf), np.where(no, b[1], -np.inf))
                    found.append((low, high))
                case _:
                    found.append(OPERATIONS[node.op].ends(node.value, args[0], args[-1]))
        return found

    def _executed(self, values: Sequence[Ends]) -> list[Mask]:
        """Return for each region of the C the boxes in which it may be executed."""
        of = self.found
        conditions = {(of.place[i], k): self.nodes[i].args[0] for i, k in of.labels.items()}
        sides = {number: key for key, number in of.inside.items()}
        found = [np.ones(values[self.results[0]][0].shape, bool)]
        for number, region in enumerate(of.regions[1:], start=1):
            truth = values[conditions[region.parent, region.label]]
            found.append(found[region.parent] & truth[sides[number][2] - 1])
        return found

    def _hulls(self, values: Sequence[Ends], executed: Sequence[Mask]) -> list[Hull]:
        found: list[Hull] = []
        for i, (low, high) in enumerate(values):
            here = executed[self.found.place[i]]
            if self.bools[i] or not here.any():
                found.append((0.0, 0.0))
            else:
                found.append((float(low[here].min()), float(high[here].max())))
        return found

    def _formats(self, hulls: Sequence[Hull]) -> list[int]:
        """Return the fractional bits of every node; 0 for values without bound."""
        found = [0] * len(self.nodes)
        for i, node in enumerate(self.nodes):
            size = max(map(abs, hulls[i]))
            if not np.isfinite(size) or self.bools[i]:
                continue
            own = bits_of(size)
            args = [found[j] for j in node.args if self.nodes[j].op != ca.OP_CONST]
            match node.op:
                case _ if i in self.fixed:
                    own = self.fixed[i]
                case _ if node.op == SELECT:
                    sides = [self.nodes[j].args[0] for j in node.args[1:]]
                    own = min([own, *(found[j] for j in sides if self.nodes[j].op != ca.OP_CONST)])
                    found[node.args[1]] = found[node.args[2]] = own
                case _ if node.op == SCALE:
                    own = args[0] + 1 - frexp(node.value)[1]
                case _ if node.op in (ca.OP_NEG, ca.OP_FABS, INEXACT):
                    own = args[0]
                case ca.OP_MUL:
                    total = sum(found[j] for j in node.args)
                    own = min(max(own, total - 62), total - 1)
                case ca.OP_SQRT:
                    own = (30 + args[0]) // 2
                case ca.OP_LOG:
                    own = min(own, 25)
                case _ if node.op in OPERATIONS:
                    kind = OPERATIONS[node.op]
                    own = own if kind.bits == OWN else kind.bits
                    own = min([own, *args]) if kind.at == RESULT and node.op != CLAMP else own
                case _:
                    pass
            found[i] = own
        return found

    def _errors(
        self, values: Sequence[Ends], formats: Sequence[int]
    ) -> tuple[list[Array], dict[int, Array]]:
        """Return the error of every number, and the error of the difference in comparisons."""
        found, slack, none = list[Array](), dict[int, Array](), np.zeros(values[-1][0].shape)

        def aligned(j: int, bits: int) -> Array:
            """Return the error of node j in the format `bits`."""
            if self.nodes[j].op == ca.OP_CONST:
                scaled = self.nodes[j].value * 2.0**bits
                return none + abs(scaled - round(scaled)) * 2.0**-bits
            return found[j] + 0.5 * 2.0**-bits * (formats[j] > bits)

        for i, node in enumerate(self.nodes):
            error, bits = none, formats[i]
            at = operand_bits(self.nodes, formats, i)
            if node.op in COMPARISONS:
                slack[i] = sum(map(aligned, node.args, at), none)
            elif node.op == ca.OP_CONST:
                error = aligned(i, bits)
            elif node.op == SELECT:
                (yes, no), a, b = (values[j] for j in node.args)
                away = np.maximum(np.abs(a[1] - b[0]), np.abs(b[1] - a[0]))
                wrong = yes & no & self._wrong(node.args[0], slack, values)
                sides = [
                    np.where(s, found[j], 0.0)
                    for s, j in zip((yes, no), node.args[1:], strict=True)
                ]
                error = np.maximum(*sides) + np.where(wrong, away, 0.0)
            elif node.op in OPERATIONS:
                kind = OPERATIONS[node.op]
                own, ends = [*map(aligned, node.args, at)], [values[j] for j in node.args]
                wide = [(x[0] - d, x[1] + d) for x, d in zip(ends, own, strict=True)]
                slopes = kind.slopes(node.value, wide[0], wide[-1])
                parts = [np.where(d > 0.0, s * d, 0.0) for s, d in zip(slopes, own, strict=True)]
                error = np.fmin(sum(parts, none), kind.most(node.value, own[0]))
                size = np.maximum(*map(np.abs, values[i]))
                error = error + kind.error(node.value, size) + kind.rounded * 2.0**-bits
                low, high = kind.domain
                inside = (ends[0][0] >= low) & (ends[0][1] <= high)
                error = np.where(inside & ~np.isnan(error), error, np.inf)
            found.append(error)
        return found, slack

    def _wrong(self, i: int, slack: Mapping[int, Array], values: Sequence[Ends]) -> Mask:
        """Return the boxes in which a condition may be decided wrongly."""
        if i in slack:
            a, b = (values[j] for j in self.nodes[i].args)
            return (a[0] - b[1] <= slack[i]) & (b[0] - a[1] <= slack[i]) & (slack[i] > 0.0)
        return np.any([self._wrong(j, slack, values) for j in self.nodes[i].args], axis=0)

    def _cones(self, values: Sequence[Ends], boxes: Array) -> dict[int, Cone]:
        """Return the saturating functions whose argument follows from one input, see `narrowed`."""
        of, cones = list[frozenset[Entry]](), dict[int, Cone]()
        rows = dict(zip(self.ranges, boxes, strict=True))
        for i, node in enumerate(self.nodes):
            own = {node.entry} if node.op == ca.OP_INPUT else set[Entry]()
            of.append(frozenset(own.union(*(of[j] for j in node.args))))
            if node.op in LIMITS and len(of[i]) == 1:
                ((entry,), (low, high)) = of[i], values[node.args[0]]
                far = (high < -LIMITS[node.op]) | (low > LIMITS[node.op]) & (node.op == ca.OP_TANH)
                size = float(np.abs(rows[entry][:, ~far]).max(initial=0.0))
                if 0.0 < size < max(map(abs, self.ranges[entry])):
                    cones[i] = entry, size
        return cones


def _compared(op: int, a: Array, b: Array, c: Array, d: Array, slack: Array) -> tuple[Array, Array]:
    """Return where a comparison of [a, b] with [c, d] may be true and where false."""
    if op == ca.OP_LT:
        return a - slack < d, b + slack >= c
    if op == ca.OP_LE:
        return a - slack <= d, b + slack > c
    meets = (a - slack <= d) & (c - slack <= b)
    single = (a == b) & (c == d) & (a == c) & (slack == 0.0)
    return (meets, ~single) if op == ca.OP_EQ else (~single, meets)
