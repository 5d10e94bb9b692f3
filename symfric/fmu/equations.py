"""Equations of a unit in C: step of the integrator, signals, start values and events.

The emitter writes the functions that `simulate` runs. Results have the same bits, and CasADi is not
needed at run time.
"""

from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from math import inf
from typing import NamedTuple

import casadi as ca
import numpy as np

from symfric.emitter.c99 import DOUBLE
from symfric.fmu.variables import LEAST_RTOL, fixed_parameters
from symfric.foundation.numeric import Array
from symfric.integrator.equations.expressions import pieces
from symfric.integrator.equations.initial import (
    FLOOR,
    LONGEST_FIRST,
    SURE,
    first_guess,
    smallest_step,
)
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.methods.attempt import GROWTH_MEMORY, build_fixed
from symfric.integrator.methods.method import suited_to_start
from symfric.integrator.methods.pieces import all_macros, routine
from symfric.integrator.methods.tableaux import METHODS, chosen
from symfric.integrator.running.engine import search_source
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import PACES
from symfric.model import Model
from symfric.model.start import start_function

MOST_ATTEMPTS = 10**6
"""Largest number of attempts in one communication step."""
EVENT_TOLERANCE = 1e-10
"""Tolerance of event times [s], as in `simulate`."""


class UnitEquations(NamedTuple):
    """Equations of a model and their numerical settings in a unit.

    Attributes:
        model, integrator: sources of the functions.
        y0: consistent unknowns at the start.
        rtol: default of the relative tolerance.
        step: length of fixed steps [s]; None if the step is adaptive.
        method: method of fixed steps.
        exchange: True if the importer integrates the rates of the states.
        span: first and last time [s] of the default experiment.
    """

    model: Model
    integrator: Integrator
    y0: Array
    rtol: float
    step: float | None
    method: str
    span: tuple[float, float]
    exchange: bool = False

    @property
    def has_loops(self) -> bool:
        """True for a mechanism with closed loops."""
        return self.model.holonomic is not None and self.model.holonomic.phi.numel() > 0

    @property
    def formula(self) -> str:
        """Name of the method and type of its steps."""
        if self.exchange:
            return "rates of the states"
        if self.step is None:
            return f"{self.integrator.tableau.name}, adaptive steps"
        return f"{METHODS[self.method].name}, fixed steps of {self.step:g} s"

    @property
    def start(self) -> dict[str, float]:
        """Values of states and algebraic variables at the start."""
        places = [*range(len(self.model.x)), *_places(self.integrator)]
        names = (v.name for v in (*self.model.x, *self.model.z))
        return dict(zip(names, self.y0[places].tolist(), strict=True))


def equations(
    model: Model,
    rtol: float,
    step: float | None,
    method: str,
    span: tuple[float, float],
    exchange: bool = False,
) -> UnitEquations:
    """Build the integrator of a model with held inputs.

    Raises:
        ValueError: an unknown method; start values without consistent algebraic variables; several
            rates in one equation, for model exchange.
    """
    u = model.vector("u")
    held = InputData(u, u, np.array(span), np.zeros((len(model.u), 1)), ("fmu",))
    rtol = min((event.rtol for event in model.events if event.rtol < rtol), default=rtol)
    adaptive = "auto" if step is not None else method  # fixed steps use its signals
    integrator = Integrator(model, held, chosen("export_fmu", adaptive, rtol))
    system = integrator.system
    rates = ca.DM(system.mass).full()[: system.nx]
    if exchange and not np.array_equal(rates, np.eye(system.n)[: system.nx]):
        raise ValueError(
            f"export_fmu '{model.name}': expected one rate in each equation for model exchange, "
            "got several in one; export it for co-simulation"
        )
    guess = first_guess(system, model, model.initial_state(t=span[0]), span[0])
    d = np.concatenate([model.values("p"), model.values("u")])
    integrator = integrator.suited([(guess, d)], span[1] - span[0])
    y0 = integrator.start(guess, d)
    return UnitEquations(model, integrator, y0, rtol, step, method, span, exchange)


def _places(integrator: Integrator) -> list[int]:
    """Return the positions of the algebraic variables of the model among the unknowns."""
    names = list(integrator.system.names)
    return [names.index(v.name) for v in integrator.model.z]


def header(own: UnitEquations, token: str) -> str:
    """Return sizes and settings of a model as C."""
    model, system = own.model, own.integrator.system
    manifold, crossings = system.manifold, own.integrator.crossings
    events = len(model.events) if own.step is None else 0
    adaptive = own.step is None
    loops = manifold.m if manifold is not None else 0
    sizes = {
        "N": system.n, "NX": system.nx, "NZ": len(model.z), "NU": len(model.u),
        "NP": len(model.p), "ND": len(model.p) + len(model.u), "NS": len(model.signals),
        "ROWS": own.integrator.tableau.H.shape[0] if adaptive else 1,
        "EVENT_MEMORY": events if own.exchange else 105 * bool(events) + 2 * events,  # of `Memory`
        "JUMP": crossings.width if crossings and events else 0,
        "RESET_VALUES": len(crossings.resets) if crossings and events else 0,
    }  # fmt: skip
    switches = {
        "TIMED": int(system.timed),
        "EQUATIONS": len(system.algebraic[0]),
        "CONSTRAINTS": loops,
        "COORDINATES": 0 if manifold is None else manifold.n,
        "BASIS": 0 if manifold is None else len(manifold.basis),
        "BASIS_AT": 0 if manifold is None else manifold.basis.start,
        "CROSSINGS": events,
        "STEP_IS_FIXED": int(not adaptive),
        "EXCHANGE": int(own.exchange),
        "CLOSES": int(bool(loops) and any(event.reset for event in model.events)),
    }
    span = own.span[1] - own.span[0]
    # as in `run.integrate`: a step spans few pieces of events that depend on time only
    quickest = min((pieces(f, *own.span).pace for f in own.integrator.schedules), default=inf)
    numbers = {
        "DEFAULT_RTOL": own.rtol, "LEAST_RTOL": LEAST_RTOL,
        "LARGEST_RTOL": min((event.rtol for event in model.events), default=0.1),
        "ATOL": 0.1, "LONGEST_STEP": PACES * quickest,
        "FIRST_STEP": min(1e-8 * span, LONGEST_FIRST),
        "SURE_STEP": SURE, "SMALLEST_STEP": smallest_step(span), "STEP_FLOOR": FLOOR,
        "GROWTH_MEMORY": GROWTH_MEMORY, "MOST_ATTEMPTS": MOST_ATTEMPTS,
        "EVENT_TOLERANCE": EVENT_TOLERANCE, "STEP_SIZE": own.step or 0.0,
    }  # fmt: skip
    kind = int(sha256(token.encode()).hexdigest()[:16], 16)
    lines = [
        f'#define MODEL_NAME "{_quoted(model.name)}"',
        f'#define MODEL_TOKEN "{token}"',
        f"#define MODEL_KIND 0x{kind:016x}ULL",
        f"enum {{ {', '.join(f'{name} = {value}' for name, value in sizes.items())} }};",
        *(f"#define {name} {value}" for name, value in switches.items()),
        *(f"#define {name} {DOUBLE.literal(float(value))}" for name, value in numbers.items()),
    ]
    return "\n".join(lines) + "\n"


def source(own: UnitEquations) -> str:
    """Return tables and functions of a model as C."""
    system, integrator = own.integrator.system, own.integrator
    model, y, d = own.model, system.y, system.d
    functions: dict[str, ca.Function] = {
        "model_signals": integrator.signals,
        "model_start": start_function(
            model.x, model.vector("u"), model.vector("p"), model.t, model.z
        ),
        "model_rates": integrator.f,
    }
    if own.step is not None:
        formula = METHODS[own.method]
        functions["model_step"] = build_fixed(suited_to_start(system, formula, model), formula)
    elif not own.exchange:  # in model exchange, the importer makes the steps
        functions["model_attempt"] = integrator.step
    manifold, follow = system.manifold, integrator.follow
    if follow is not None:
        functions |= {"model_equations": system.constraints, "model_round": follow.round}
    if manifold is not None and manifold.m:
        functions |= {"model_defect": manifold.defect, "model_project": manifold.project}
        if manifold.charted:
            n, m = manifold.n, manifold.m
            slope = ca.densify(ca.SX(manifold.slope(y, d))[n : n + m, :n])
            functions["model_slope"] = ca.Function("slope", [y, d], [slope])
    else:
        functions["model_along"] = _along(own)
    text = [all_macros(), "\n", tables(own), "\n"]
    text += [routine(function, name) for name, function in functions.items()]
    searches = integrator.crossings is not None and own.step is None and not own.exchange
    if follow is not None or searches:
        text.append("typedef long long casadi_int;\n\n")
    if follow is not None:
        text += [_called("symfric_round", "model_round", 2, 2), FOLLOWED, follow.c_source, "\n"]
    if own.step is None:
        text += _events(own)
    return "".join(text)


def _along(own: UnitEquations) -> ca.Function:
    """Return (t, y, d, dy, dd) -> derivatives of rates, signals and equations along (dy, dd)."""
    model, system = own.model, own.integrator.system
    t, y, d = ca.SX.sym("t"), system.y, system.d
    dy, dd = ca.SX.sym("dy", system.n), ca.SX.sym("dd", d.numel())
    outputs = (ca.SX(output.expression) for output in model.outputs.values())
    every = ca.vertcat(*(model.vector(letter) for letter in "xzu"), *outputs)
    signals = own.integrator.of_time("signals", every)(t, y, d)
    rates, equations = system.f[: system.nx], system.f[system.algebraic[0]]
    of = ca.vertcat(rates, signals, equations)
    slope = ca.jtimes(of, ca.vertcat(y, d), ca.vertcat(dy, dd))
    return ca.Function("along", [t, y, d, dy, dd], [ca.densify(slope)], {"cse": True})


FOLLOWED = "static int symfric_follow(double *y, const double *d);\n"


def _called(name: str, of: str, arguments: int, results: int) -> str:
    """Return a C function `name` with CasADi's signature that calls `of`."""
    given = [*(f"arg[{i}]" for i in range(arguments)), *(f"res[{i}]" for i in range(results))]
    return (
        f"static int {name}(const double **arg, double **res, casadi_int *iw, double *w, int mem)\n"
        f"{{\n    (void)iw;\n    (void)w;\n    (void)mem;\n    {of}({', '.join(given)});\n"
        "    return 0;\n}\n\n"
    )


def _events(own: UnitEquations) -> Iterator[str]:
    """Yield the C of events: search, effects, values, values at the start and names."""
    events, crossings = own.model.events, own.integrator.crossings
    if crossings is not None and own.exchange:  # the importer searches
        yield routine(own.integrator.resets, "model_resets")
        yield _table("model_directions", crossings.directions, "int")
        yield _table("model_terminal", map(int, crossings.terminal), "int")
        yield _table("model_by_event", (i for i, _ in crossings.resets), "int")
        yield _table("model_of_state", (j for _, j in crossings.resets), "int")
    elif crossings is not None:
        for function in crossings.functions:
            name = f"model_{function.name().removeprefix('symfric_')}"
            yield routine(function, name)
            yield _called(function.name(), name, function.n_in(), function.n_out())
        yield search_source(crossings, own.integrator.step.numel_in(1), decides=False)
    if events:
        yield routine(own.integrator.events, "model_events")
        signs = [-event.direction if event.at_start else 0 for event in events]
        yield _table("model_at_start", signs)
        yield _strings("model_event_names", [event.name for event in events])


def tables(own: UnitEquations) -> str:
    """Return names, start values and ranges as C."""
    model, system = own.model, own.integrator.system
    data = [*model.values("p"), *model.values("u")]
    guess, fixed = [float(v.start) for v in model.z], fixed_parameters(model)
    parts = [
        _strings("model_unknown_names", system.names),
        _strings("model_signal_names", model.signals),
        _strings("model_parameter_names", [v.name for v in model.p]),
        _table("model_nominal", system.nominal),
        _table("model_data", [*data, 0.0]),
        _table("model_guess", [*guess, 0.0]),
        _table("model_lower", [v.lower for v in model.p]),
        _table("model_upper", [v.upper for v in model.p]),
        _table("model_fixed", [int(v.name in fixed) for v in model.p], "int"),
        _table("model_start_values", own.y0),
        _table("model_place_of_z", _places(own.integrator), "int"),
    ]
    if own.integrator.follow is not None:
        parts.append(_table("model_free", system.free.ravel(order="F")))
    return "".join(parts)


def _table(name: str, values: Iterable[float], kind: str = "double") -> str:
    """Return a constant array of at least one number."""
    texts = [str(x) if kind == "int" else DOUBLE.literal(float(x)) for x in values] or ["0"]
    return _wrapped(f"static const {kind} {name}[{len(texts)}] = {{", texts)


def _strings(name: str, values: Iterable[str]) -> str:
    texts = [f'"{_quoted(text)}"' for text in values] or ['""']
    return _wrapped(f"static const char *const {name}[{len(texts)}] = {{", texts)


def _wrapped(head: str, texts: list[str]) -> str:
    """Return the entries of an array in lines of up to eight."""
    rows = (texts[i : i + 8] for i in range(0, len(texts), 8))
    return "\n".join([head, *(f"    {', '.join(row)}," for row in rows), "};"]) + "\n"


def _quoted(text: str) -> str:
    """Return the content of a C string."""
    return text.replace("\\", "\\\\").replace('"', '\\"')


def fingerprint(parts: Mapping[str, str]) -> str:
    """Return a token that identifies the content of a unit."""
    content = "\0".join(f"{name}\0{text}" for name, text in parts.items())
    text = sha256(content.encode()).hexdigest()
    return f"{{{text[:8]}-{text[8:12]}-{text[12:16]}-{text[16:20]}-{text[20:32]}}}"
