"""Friction law as a block: a function, or a step of its states with held inputs.

The texts of its data sheet follow from the docstring of the law.

The block of a population is one of its contacts; C calls it in a loop over an array of states.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields, replace
from inspect import getdoc
from re import match, search, split, sub
from textwrap import dedent
from typing import Any, NamedTuple

import casadi as ca

from symfric.codegen.blocks.block import SHEET, Block
from symfric.codegen.blocks.held_step import (
    LEAST_LOAD,
    advanced,
    force_of_rate,
    forces_at,
    needs_unloaded_case,
    with_unloaded_case,
)
from symfric.codegen.blocks.variables import (
    STEP_SIZE,
    Fold,
    above_zero,
    arranged,
    as_constants,
    step_size,
    variable,
    without_idle,
)
from symfric.foundation import checks
from symfric.foundation.numeric import is_casadi
from symfric.foundation.parameters import (
    Option,
    Parametric,
    Variable,
    options,
    parameters,
    symbolise,
)
from symfric.foundation.units import turned
from symfric.foundation.variable import stacked, starts_of, symbols_of
from symfric.laws import Law, Population, law_name
from symfric.laws.base.law import require_law
from symfric.model import Output, Variables


def law_block(
    law: Law,
    *,
    name: str | None = None,
    h: float | None = None,
    free: Sequence[str] | None = None,
    fold: Fold = None,
    turning: bool = False,
) -> Block:
    """Return the discrete-time block of `law`; inputs v, N and those of the law, output F.

    A law without states becomes F(v, N). A law with states makes a step with v and N held, stable
    for any product of rate and h (for LuGre, sigma_0 |v| h / g is often far above 2, where explicit
    Euler diverges). If each rate is affine in its own state and independent of other states,
    dz/dt = a(v, N) - lambda(v, N) z, the step is exact:

        phi1(x) = (exp(x) - 1) / x,   phi2(x) = (phi1(x) - 1) / x,   x = -lambda h
        r  = phi1(x) (a - lambda z)          mean rate over the step
        z+ = z + h r
        zm = z + h phi2(x) (a - lambda z)    mean state over the step
        F  = force(v, N, zm)                 mean force over the step, with r as the rate

    Otherwise (elasto-plastic, Bouc-Wen, Maxwell-slip, Dahl's law with n != 1 and others) lambda is
    the derivative at z, and the step ends at the equilibrium if it reaches it; the step is of
    second order and bounded for every h. The same holds for a force that is not affine in the
    states. The event forms of Maxwell-slip, reset integrator and GMS have exact steps.

    F h is the impulse and F v h the work of the step. F_end, the force at the end of the step, is
    force(v, N, z+) with the rate exp(x) dz/dt; laws without states have no F_end, since it equals
    F. A controller holds F over the next step if v is planned for that step. If v comes from the
    encoder increment of the last step, F_end is the better estimate: for LuGre at 1 kHz, 2 mm/s at
    1 Hz under 10 N, its error is 0.026 N, and that of F is 0.050 N. At 0.3 m/s, F and F_end agree
    with the true mean and end values to 1e-4 N, except in the step of a reversal, in which the
    bristle reverses completely: there the error of F is 0.022 N and that of F_end 0.36 N, because
    the mean velocity does not determine the velocity at the end, on which the damping depends; the
    error of the bristle force without damping is 0.0095 N.
    In F the bristle damping uses r = (z+ - z) / h, which is bounded by the bristle's travel, and
    not the rate at one instant, which after a jump is as large as v. Use the mean velocity of the
    step, such as the encoder increment over h; with the velocity at its start the error is of first
    order in h.

    Initial states are zero (machine at rest, bristles relaxed) or, after the reset `init_sliding`,
    those of long sliding at v, N (for a controller that starts while the machine moves).

    Args:
        law: a law whose parameters are numbers.
        name: C identifier; default the name of the law.
        h: step size [s] as a constant; without it h is a parameter, by default 1 ms. A law without
            states has no step size.
        free: parameters that remain variable at run time; all others become constants.
        fold: True if all parameters (except h) become constants, or the names of those that do.
            Parameters whose value selects a cheaper form are constants in any case, see
            `runtime_parameters`. Parameters without effect are omitted.
        turning: True for a rotary contact: the same C, with units rad/s and N m in the texts.

    Raises:
        ValueError: symbols in the law; names in `free` or `fold` that are unknown, repeated or, in
            `free`, without effect; both arguments given; h for a law without states; states with
            circular dependencies (Leuven, smooth GMS), or states that are not affine, depend on
            others and have no known equilibrium; modes that follow zero crossings of v within the
            step (exact Coulomb, Karnopp and Leine by events); a force that is not finite at rest (a
            smoothing width of 0 left variable).
    """
    require_law("codegen", law)
    where = f"codegen '{law_name(law)}'"
    checks.flag(f"{where}: turning", turning)
    if name is not None:
        checks.identifier(f"{where}: name", name)
    known = parameters(law)
    symbols = [p.name for p in known.values() if is_casadi(p.value)]
    if symbols:
        raise ValueError(f"{where}: expected numbers as parameters, got symbols {symbols}")
    names, problems = variable(law, free, fold)
    if h is not None and not law.states:
        problems.append(f"h: expected none for a law without states, which has no step, got {h!r}")
    if problems:
        raise ValueError(f"{where}: {'; '.join(problems)}")
    symbolic, runtime = symbolise(law, *names)
    block = _step(law, symbolic, runtime, h, where) if law.states else _function(symbolic, runtime)
    block = without_idle(block, free, where)
    idle = {p.name for p in runtime} - {p.name for p in block.parameters}
    folded = (p for p in known.values() if p.name not in names)
    block = replace(
        block,
        name=name or sub(r"\W+", "_", law_name(law)).strip("_"),
        **_described(law, idle),
        **as_constants(folded, block.constants, turning),
    )
    if not _at_rest(block):
        raise ValueError(
            f"{where}: expected a finite force at rest, got one that is not; "
            "keep a smoothing width of 0 constant (leave it out of free)"
        )
    block = above_zero(block, [p.name for p in block.parameters if not _at_rest(block, p.name)])
    return arranged(in_turning(block) if turning else block)


def in_turning(block: Block) -> Block:
    """Return the block with the units of a rotary contact."""
    states, parameters, inputs = (
        tuple(replace(v, unit=turned(v.unit)) for v in group) for group in block.groups.values()
    )
    outputs = {n: replace(o, unit=turned(o.unit)) for n, o in block.outputs.items()}
    doc = f"{block.doc}\n\nFor a contact that turns: read rad for m, N m for N."
    return replace(
        block, states=states, inputs=inputs, parameters=parameters, outputs=outputs, doc=doc
    )


def states_of(law: Law | Population) -> Variables:
    """Return the states of a law as variables."""
    return tuple(Variable(s.name, s.unit, nominal=s.nominal, doc=s.doc) for s in law.states)


def _inputs(law: Law) -> Variables:
    return (
        Variable("v", "m/s", doc="sliding velocity"),
        Variable("N", "N", nominal=10.0, lower=0.0, doc="normal force"),
        *(Variable(i.name, i.unit, nominal=i.nominal, doc=i.doc) for i in law.inputs),
    )


def _given(inputs: Variables) -> dict[str, ca.SX]:
    """Return the symbols of the inputs after v and N, by name."""
    return {variable.name: variable.symbol for variable in inputs[2:]}


def _function(law: Law, runtime: Variables) -> Block:
    v, N, *_ = inputs = _inputs(law)
    force = law.force(v.symbol, N.symbol, ca.SX(0, 1), **_given(inputs))
    outputs = {"F": Output(force, "N", SHEET["law"]["force"])}
    use = (SHEET["law"]["sign"],)
    return Block("F", inputs=inputs, parameters=runtime, outputs=outputs, use=use)


def _step(numeric: Law, law: Law, runtime: Variables, h: float | None, where: str) -> Block:
    v, N, *_ = inputs = _inputs(law)
    states, size, given = states_of(law), step_size(where, h), _given(inputs)
    z = symbols_of(states)
    rate = ca.SX(law.rate(v.symbol, N.symbol, z, **given))
    step = advanced(law, v.symbol, N.symbol, z, rate, given, size.h, where)
    force, r = force_of_rate(ca.SX(law.force(v.symbol, N.symbol, z, **given)), rate, z)
    internal = ca.vertcat(z, r)
    at = {"F": ca.vertcat(step.mean, step.mean_rate)}
    if ca.depends_on(force, internal):
        at["F_end"] = ca.vertcat(step.end, step.end_rate)
    following, forces, said = step.end, forces_at(force, internal, at), SHEET["law"]
    use = (said["sign"], said["mean_velocity"])
    cases = with_unloaded_case(following, force, internal, at, N)

    def of_numbers(following: ca.SX, forces: dict[str, ca.SX]) -> ca.Function:
        own, columns = (*runtime, *size.parameters), [v.symbol, N.symbol, z, symbols_of(inputs[2:])]
        rows = ca.substitute(
            [following, stacked(forces.values())], [symbols_of(own)], [starts_of(own)]
        )
        return ca.Function("step", columns, [ca.densify(row) for row in rows])

    if needs_unloaded_case(numeric, of_numbers(following, forces), of_numbers(*cases)):
        following, forces = cases
        use = (*use, said["no_load"].format(least=LEAST_LOAD * N.nominal))
    when = {"F": "mean over the step", "F_end": "at the end of the step"}
    outputs = {n: Output(e, "N", f"{said['force']}, {when[n]}") for n, e in forces.items()}
    steps = ("held", *step.kinds, "mean", *("end",) * ("F_end" in outputs))
    return Block(
        "F",
        states=states,
        inputs=inputs,
        parameters=runtime + size.parameters,
        next=following,
        outputs=outputs,
        resets={"init_sliding": (ca.SX(law.steady_state(v.symbol, N.symbol)), said["sliding"])},
        constants=size.constants,
        discretisation="\n".join(SHEET["step"][name] for name in steps),
        use=(*use, *[said["which_force"]] * ("F_end" in outputs)),
    )


def _at_rest(block: Block, zero: str = "") -> bool:
    """Return True if force and states are finite at rest with the parameter `zero` set to 0."""
    states = [v.start for v in block.states]
    p = [0.0 if v.name == zero else v.start for v in block.parameters]
    rest = [0.0 if v.name == "v" else v.nominal for v in block.inputs]
    return all(result.is_regular() for result in block.step(states, p, rest))


def _described(law: Law, idle: Iterable[str]) -> dict[str, Any]:
    """Return the texts of the data sheet from the docstrings of the law and its parts.

    Limits that concern parameters without effect (`idle`) or N = 0 are omitted; the block, unlike
    the law, is valid at N = 0.
    """
    found = texts(law)
    limits = dict.fromkeys(limit for text in found for limit in text.limits)
    limits = [x.replace("N = 0 or ", "") for x in limits if x != "Not valid for N = 0."]
    return {
        "doc": "\n".join(text.title for text in found),
        "equations": equations(law),
        "limits": tuple(x for x in limits if not any(search(rf"\b{n}\b", x) for n in idle)),
        "sources": tuple(text.source for text in found if text.source),
    }


def contact_block(law: Population, *, name: str | None = None, h: float | None = None) -> Block:
    """Return the discrete-time block of one contact of `law`; inputs v, N, r, output F.

    The step is that of `Population.advance`, so that a loop in C over the contacts of
    `Population.begin` agrees with NumPy up to rounding. Keep |v| h below `Population.step`.

    Args:
        law: a population; its parameters are constants of the block.
        name: C identifier; default the name of the population.
        h: step size [s] as a constant; without it h is a parameter, by default 1 ms.

    Raises:
        ValueError: a step size <= 0.
    """
    where = f"codegen '{law_name(law)}'"
    if name is not None:
        checks.identifier(f"{where}: name", name)
    states, size, about = states_of(law), step_size(where, h), texts(law)
    v = Variable("v", "m/s", nominal=law.step / STEP_SIZE, doc="sliding velocity")
    N = Variable("N", "N", nominal=10.0, lower=0.0, doc="normal force of all contacts")
    r = Variable("r", "1", nominal=0.5, lower=-1.0, upper=1.0, doc="random number of the contact")
    z = symbols_of(states)
    rows = ca.SX(law.contact(z, r.symbol, v.symbol * size.h, size.h, N.symbol))
    redrawn = "draw r anew at every step" if law.redraws else "r stays the same at all steps"
    return Block(
        name or law_name(law),
        doc="\n".join(text.title for text in about) + "\nOne contact of a population.",
        equations=equations(law),
        discretisation="One step of the contact with v, N and r held.",
        use=(
            SHEET["population"]["loop"].format(redrawn=redrawn),
            SHEET["law"]["sign"],
            SHEET["population"]["step"].format(step=law.step),
        ),
        limits=tuple(limit for text in about for limit in text.limits),
        sources=tuple(text.source for text in about),
        states=states,
        inputs=(v, N, r),
        parameters=size.parameters,
        next=rows[: len(states)],
        outputs={"F": Output(rows[len(states)], "N", "friction force of this contact")},
        **as_constants(parameters(law).values(), size.constants),
    )


TELLING = (
    r"[Nn]ot valid|[Cc]reeps? |[Dd]rifts?\b|Needs |Keep |Never |[Oo]nly if |smooth over|rounded"
)
"""Pattern of sentences that users of the law must read."""

LEANING = r"^Without it|^Made for slip|, as there|that form|form = "
"""Pattern of sentences that depend on the previous sentence or describe another form."""


class LawText(NamedTuple):
    """Texts about a law, without Python terms.

    Attributes:
        title: name of the law, one line.
        equations: formulas, line by line.
        limits: sentences about restrictions.
        source: publication.
    """

    title: str
    equations: str
    limits: tuple[str, ...]
    source: str


def texts(law: Parametric) -> tuple[LawText, ...]:
    """Return the texts of a law and of its parts, without repetitions."""

    def every(part: Parametric) -> Iterator[LawText]:
        yield _text(part)
        for item in fields(part):
            value = getattr(part, item.name)
            for inner in value if isinstance(value, tuple) else (value,):
                if isinstance(inner, Parametric) and "\n\n    " in (getdoc(type(inner)) or ""):
                    yield from every(inner)

    return tuple(dict.fromkeys(every(law)))


def equations(obj: Parametric) -> str:
    """Return the formulas of a law or machine and its parts; several parts have titles."""
    found = texts(obj)
    if len(found) == 1:
        return found[0].equations
    return "\n\n".join(f"{text.title}\n{text.equations}".rstrip() for text in found)


def _text(law: Parametric) -> LawText:
    paragraphs = (getdoc(type(law)) or type(law).__name__).split("\n\n")
    if "Raises:" in paragraphs:
        paragraphs = paragraphs[: paragraphs.index("Raises:")]
    formulas = [dedent(p) for p in _formulas(paragraphs, options(law).values())]
    prose = "\n".join(p for p in paragraphs[1:] if not p.startswith(("    ", "Raises:")))
    about, _, source = prose.partition("\nSource: ")
    chosen = "    ".join(f"{name}: {option.value}." for name, option in options(law).items())
    return LawText(
        title=" ".join(paragraphs[0].split()),
        equations="\n".join(formulas + [chosen.capitalize()] * bool(chosen)).replace("`", ""),
        limits=tuple(_limits(about)),
        source=" ".join(source.partition("\nChecked: ")[0].split()),
    )


def _formulas(paragraphs: Sequence[str], forms: Iterable[Option]) -> Iterator[str]:
    """Yield the formulas, except those whose introduction names another value of an option."""
    others = "|".join(rf'{o.name} = "(?!{o.value}")' for o in forms) or "(?!)"
    before = ""
    for paragraph in paragraphs:
        if not paragraph.startswith("    "):
            before = " ".join(paragraph.split())
        elif not search(others, before.rpartition(". ")[2]):
            lines = paragraph.splitlines()
            yield "\n".join(line for line in lines if not search(others, line))


def _limits(prose: str) -> Iterator[str]:
    """Yield the sentences about restrictions and smoothing widths of a law."""
    for sentence in split(r"(?<=\.)(?<!al\.)\s+", " ".join(prose.split())):
        for clause in split(r";\s+", sentence.removeprefix("Limits: ").replace("`", "")):
            if search(TELLING, clause) and not search(LEANING, clause):
                text = clause.strip().rstrip(".")
                capital = match(r"[a-z]+[ ']", text)
                yield f"{text[0].upper() if capital else text[0]}{text[1:]}."
