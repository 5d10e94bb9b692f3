"""Header and source of a controller in C99, the only implementation of the solver.

Sequential quadratic programs over the horizon, with the residual of optimality:

    1. linearise at the plan (X, U); residual <= tolerance: done
    2. change and multipliers by the quadratic program
    3. a step of 1, 1/2, 1/4, ... of it by the merit  cost + prices + nu |defects|_1

The Hessian is Gauss-Newton in the first two iterations of a cycle. Near stick, friction has more
curvature than the cost, and these converge slowly; from the third iteration on the curvature of the
equations, weighted with their multipliers, is added wherever the Riccati recursion then finds no
negative pivot.

The residual is that of the Karush-Kuhn-Tucker conditions at the returned plan, with the multipliers
of the equations that make the gradients in the states zero: the largest of

 * gradients in the inputs, per nominal and own curvature of the cost in an input: an input would
   move by no more than that share of its nominal;
 * defects of the equations per nominal of the state;
 * violations of rows in units of their signals; products of rows and multipliers, by the larger
   of multiplier and that curvature. A soft row may be violated instead if its multiplier is the
   price: then their difference, relative to the price, times the violation.

The quadratic program is solved by a primal-dual interior point. A hard row keeps v >= 0; a soft one
may be violated by s >= 0 at the price rho s + sigma s^2 / 2:

    v - t + s = 0,   t z = mu,   s y = mu,   z + y = rho + sigma s

Newton's method with t, s and y eliminated leaves a weight w and a slope e for each row,

    z_new = z + w (o - D d),   w = 1 / (t / z + f),   e = -(z + w o),
    o = mu / z - v - s + f a,   a = rho + sigma s - z - mu / s,   f = 1 / (sigma + y / s)

with f = 0 in a hard row, for the recursion over the intervals. Mehrotra's predictor and corrector
share its matrices. A program whose free minimum satisfies all rows needs none of this.

Names begin with that of the controller: `NAME_t` holds plan and work space, `NAME_param_t` model
parameters, bounds, tolerance and iterations, with `NAME_default`; `NAME_in_t` measurements and
references; `NAME_out_t` controls and results of the cycle; `NAME_init`, `NAME_step`.

Sources: Nocedal and Wright, Numerical Optimization, 2nd ed., (18.36) (weight of the merit);
    Mehrotra, On the implementation of a primal-dual interior point method, SIAM J. Optim. 2(4),
    1992; Frison and Diehl, HPIPM, IFAC 2020 (soft rows).
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

import casadi as ca

from ocp.mpc.design import Control, CycleStatus, Design
from symfric.codegen.layout import folded
from symfric.emitter.c99 import DOUBLE, TRANSCENDENTAL, macro
from symfric.emitter.emit import emit
from symfric.foundation.graph import graph
from symfric.foundation.parameters import Variable

LOOPS = Path(__file__).with_name("cycle.c").read_text(encoding="utf-8")
"""The loops of a cycle.

One text for all controllers, called NAME in it: sizes are macros, kernels are functions. Every loop
is bounded, nothing is allocated, all memory is in the caller's struct.
"""
PLAIN = 2
"""Iterations without curvature of the equations, which has no meaning yet far from the optimum."""
ARMIJO = 1e-4
ROUNDING = 1e-12
"""Relative rounding error of the merit that a step may lose."""
BACK = 0.995
"""Share of the step to the boundary."""
CLOSE = 1e-7
"""mu, in units of the curvature, at which a program is solved."""
AWAY = 0.1
"""Least distance from the bounds at which the interior point starts, in units of the signals."""


def header(design: Design) -> str:
    """Return the text of the header file."""
    name, h = design.name, design.horizon
    guard = f"{name.upper()}_H"
    statuses = "".join(f"#define {name}_{s.name} {int(s)}\n" for s in CycleStatus)
    return f"""{_banner(f"{name}.h")}
 *
 * Model predictive controller of '{h.model.name}': every {h.step:g} s, over {h.count} intervals.
 * Quadratic programs by Riccati's recursion and an interior point: no allocation, bounded loops.
 */
#ifndef {guard}
#define {guard}

#ifdef __cplusplus
extern "C" {{
#endif

{statuses}
/* A change of the plan. */
typedef struct {{
{_move(sizes(design))}\
    double slope, curvature;
}} {name}_move_t;

/* Plan and work space; nothing in it needs to be read or written. */
typedef struct {{
    int warm;                /* whether there is a plan */
{_memory(name, sizes(design))}}} {name}_t;

{_structs(design)}
/* Forget the plan; call it before the first step. */
void {name}_init({name}_t *self);

/* One cycle. Numbers that are not finite give {name}_BAD_INPUT, and the last plan goes on. */
void {name}_step({name}_t *self, const {name}_param_t *param, const {name}_in_t *in,
{" " * (len(name) + 11)}{name}_out_t *out);

#ifdef __cplusplus
}}
#endif

#endif /* {guard} */
"""


def _structs(design: Design) -> str:
    """Return the structs of inputs and outputs."""
    name, h = design.name, design.horizon
    parameters = [(v.name, f"{v.doc} [{v.unit}]") for v in _constants(design)]
    parameters += [(bound, "bound") for bound in design.bound_names]
    parameters.append(("tolerance", "residual at which a plan is optimal"))
    into = [
        (v.name, f"measured: {v.doc} [{v.unit}]") for v in (h.model.x[i] for i in design.measured)
    ]
    into += [(f"{r}[{h.count + 1}]", "reference now and after each interval") for r in h.references]
    into += [("t", "time now [s]")] * timed(design)
    out = [(c.name, f"input over the next {h.step:g} s [{c.unit}]") for c in design.controls]
    out.append(("residual", "of the conditions of optimality, of the plan that this is from"))
    out.append(("violation", "largest of a soft bound, in units of its signal"))
    return f"""typedef struct {{
{_members(parameters)}\
    int iterations;          /* quadratic programs in a cycle at most; 1: real-time iteration */
}} {name}_param_t;

extern const {name}_param_t {name}_default;

typedef struct {{
{_members(into)}}} {name}_in_t;

typedef struct {{
{_members(out)}\
    int iterations;          /* quadratic programs */
    int program_iterations;  /* of the interior point, over all of them */
    int status;              /* one of {name}_CONVERGED ... */
    int converged;           /* 1: residual <= tolerance */
}} {name}_out_t;
"""


def source(design: Design) -> str:
    """Return the text of the source file.

    Raises:
        ValueError: an operation without counterpart in C99.
    """
    name = design.name
    functions, calls = list[str](), Counter[str]()
    for kernel in design.kernels.all:
        text, called = _kernel(kernel)
        functions.append(text)
        calls += called
    macros = "".join(
        f"#ifndef {macro(c, DOUBLE)}\n#define {macro(c, DOUBLE)} {c}\n#endif\n"
        for c in sorted(set(calls) & set(TRANSCENDENTAL.values()))
    )
    booleans = "#include <stdbool.h>\n" if any("bool " in f for f in functions) else ""
    loops = LOOPS.replace("NAME", name).replace("move_t", f"{name}_move_t")
    return f"""{_banner(f"{name}.c")}
 */
#include "{name}.h"

#include <math.h>
{booleans}
{_user_functions(design)}
{_macros(design)}
{macros}
{_constants_of(design)}
{"".join(functions)}{loops}"""


def _banner(file: str) -> str:
    return f"""/* {file}: C99 made by symfric {version("symfric")} with CasADi {version("casadi")}.
 * This generated code is yours. SPDX-License-Identifier: MIT-0"""


def sizes(design: Design) -> dict[str, int]:
    """Return macro -> number, for the loops."""
    h, k = design.horizon, design.kernels
    end = k.end_linear
    return {
        "N": h.count,
        "NX": h.x.numel(),
        "NU": h.u.numel(),
        "NR": h.r.numel(),
        "NPAR": h.p.numel(),
        "NB": h.b.numel(),
        "ROWS": len(h.limits),
        "END_ROWS": len(h.end_limits),
        "ALL": h.count * len(h.limits) + len(h.end_limits),
        "END": int(end is not None),
        "NL": k.linear.size1_out(0),
        "NL_END": 0 if end is None else end.size1_out(0),
        "NG": k.matrix.size1_out(1),
        "NE": k.bend.size1_in(1),
        "PIVOTS": h.u.numel() * h.x.numel() + h.u.numel() * (h.u.numel() - 1) // 2,
        "PLAIN": PLAIN,
        "NS": len(k.identity),
        "SUBSTEPS": h.substeps,
        "NP": k.matrix.size1_in(0),
        "STEP": k.forward.size1_out(1),
        "MOST": design.settings.program,
        "HALVINGS": design.settings.halvings,
    }


def _constants(design: Design) -> list[Variable]:
    h = design.horizon
    return [v for v in h.model.p if v.name not in h.references]


def _members(rows: Iterable[tuple[str, str]]) -> str:
    return "".join(
        f"    double {name + ';':<17} /* {text.strip().replace('*/', '* /')} */\n"
        for name, text in rows
    )


def _array(what: str, *shape: int) -> str:
    """Return a member; no size is zero in C."""
    return f"    double {what}{''.join(f'[{max(size, 1)}]' for size in shape)};\n"


def _move(parts: dict[str, int]) -> str:
    n, nx, nu = parts["N"], parts["NX"], parts["NU"]
    return _array("x", n + 1, nx) + _array("u", n, nu) + _array("D", parts["ALL"])


def _memory(name: str, parts: dict[str, int]) -> str:
    """Return the members of the plan and the work space."""
    n, every = parts["N"], max(parts["ALL"], 1)

    states, inputs = (n + 1, parts["NX"]), (n, parts["NU"])
    lines = [_array("x", *states), _array("u", *inputs), _array("z", every)]
    lines += [_array("r", n + 1, parts["NR"]), _array("t", n + 1), _array("p", parts["NPAR"])]
    lines += [
        _array("b", parts["NB"]),
        _array("L", n, parts["NL"]),
        _array("L_end", parts["NL_END"]),
    ]
    lines += [_array("G", n, parts["NG"]), _array("k", *inputs), _array("lam", n, parts["NX"])]
    rows = ["w", "e"]
    if parts["ALL"]:
        rows += ["v", "ts", "zn", "s", "y", "f", "a", "o", "goal_t", "goal_s"]
        rows += ["dt", "dz", "ds", "dy"]
    lines += [_array(row, every) for row in rows]
    lines.append(f"    {name}_move_t go, aim;\n")
    return "".join(lines)


def _macros(design: Design) -> str:
    parts: dict[str, int | str] = dict(sizes(design))
    h, prices = design.horizon, design.prices
    parts["PAIRS"] = DOUBLE.literal(float(parts["ALL"]) + float(prices.soft.sum()))
    for name, value in (
        ("CURVATURE", h.curvature),
        ("CLOSE", CLOSE),
        ("AWAY", AWAY),
        ("BACK", BACK),
        ("ARMIJO", ARMIJO),
        ("ROUNDING", ROUNDING),
    ):
        parts[name] = DOUBLE.literal(value)
    lines = [f"#define {name} {value}" for name, value in parts.items()]
    row = "((j) < N * ROWS ? (j) % ROWS : ROWS + (j) - N * ROWS)" if parts["ROWS"] else "(j)"
    return "\n".join([*lines, f"#define ROW(j) {row}", ""])


def _constants_of(design: Design) -> str:
    h, prices = design.horizon, design.row_prices
    tables = {
        "nominal_x": h.model.nominal("x").tolist(),
        "nominal_u": h.model.nominal("u").tolist(),
        "start_x": design.x0.tolist(),
        "start_u": design.u0.tolist(),
        "identity": list(design.kernels.identity),
    }
    if prices.soft.size:
        tables |= {"rho": prices.rho.tolist(), "sigma": prices.sigma.tolist()}
    text = ""
    for name, values in tables.items():
        numbers = ", ".join(map(DOUBLE.literal, values))
        text += folded(f"static const double {name}[{len(values)}] = {{{numbers}}};", "") + "\n"
    if prices.soft.size:
        flags = ", ".join(str(int(flag)) for flag in prices.soft)
        text += f"static const int soft[{prices.soft.size}] = {{{flags}}};\n"
    name = design.name
    values = [*design.p0.tolist(), *design.bounds.tolist(), design.settings.tolerance]
    numbers = [*map(DOUBLE.literal, values), str(design.settings.iterations)]
    text += f"\nconst {name}_param_t {name}_default = {{\n    {', '.join(numbers)}\n}};\n"
    return text + "\n"


def _kernel(function: ca.Function) -> tuple[str, Counter[str]]:
    """Return a static C function (arguments, results), and the functions it calls."""
    whole = graph(function)
    count, results = function.n_in(), function.n_out()
    names = [[f"a{i}_{j}" for j in range(function.size1_in(i))] for i in range(count)]
    targets = [[f"r{i}[{j}] = {{}};" for j in range(function.size1_out(i))] for i in range(results)]
    code = emit(whole, names, targets, DOUBLE)
    used = sorted(code.used)
    loads = [f"const double a{i}_{j} = a{i}[{j}];" for i, j in used]
    idle = [f"(void)a{i};" for i in range(count) if i not in {u[0] for u in used}]
    idle += [f"(void)r{i};" for i in range(results) if not targets[i]]
    arguments = [f"const double *a{i}" for i in range(count)]
    arguments += [f"double *r{i}" for i in range(results)]
    head = folded(f"static void {function.name()}({', '.join(arguments)})", "")
    body = "".join(folded(line, "    ") + "\n" for line in (*idle, *loads, *code.lines))
    return f"{head}\n{{\n{body}}}\n\n", code.calls


def _user_functions(design: Design) -> str:
    """Return functions with names of the user, placed before all macros."""
    name, h = design.name, design.horizon
    p = [f"m->p[{i}] = param->{v.name};" for i, v in enumerate(_constants(design))]
    b = [f"m->b[{i}] = param->{bound};" for i, bound in enumerate(design.bound_names)]
    r = [f"m->r[k][{i}] = in->{reference}[k];" for i, reference in enumerate(h.references)]
    needed = [f"in->{h.model.x[i].name}" for i in design.measured] + ["param->tolerance"]
    needed += ["in->t"] * timed(design)
    needed += [f"m->p[{i}]" for i in range(len(p))] + [f"m->b[{i}]" for i in range(len(b))]
    checks = [f"sound = sound && isfinite({what});" for what in needed]
    now = "in->t + " if timed(design) else ""
    each = [f"m->t[k] = {now}{DOUBLE.literal(h.step)} * (double)k;", *r]
    each += [f"sound = sound && isfinite(m->r[k][{i}]);" for i in range(len(r))]
    measured = [f"m->x[0][{i}] = in->{h.model.x[i].name};" for i in design.measured]
    return f"""/* Take everything that is given but the states; whether all of it is finite. */
static int take({name}_t *m, const {name}_param_t *param, const {name}_in_t *in)
{{
    int k, sound = 1;
{_lines(p + b + checks, 4)}    for (k = 0; k <= {h.count}; k++) {{
{_lines(each, 8)}    }}
    return sound;
}}

static void measure({name}_t *m, const {name}_in_t *in)
{{
{_lines(measured, 4)}}}

static void show(const {name}_t *m, {name}_out_t *out)
{{
    double u;
{"".join(map(_shown, design.controls))}}}
"""


def timed(design: Design) -> bool:
    """Return True if a cost or a bound depends on time."""
    h = design.horizon
    values = [h.early.value, h.late.value, h.end.value]
    values += [limit.expression for limit in (*h.limits, *h.end_limits)]
    return ca.depends_on(ca.vertcat(*values), h.t)


def _lines(lines: Sequence[str], margin: int) -> str:
    return "".join(f"{' ' * margin}{line}\n" for line in lines)


def _shown(control: Control) -> str:
    value = f"m->u[0][{control.place}]"
    if control.rated:
        value = f"0.5 * (m->x[0][{control.place}] + m->x[1][{control.place}])"
    text = f"    u = {value};\n"
    for place, order in ((control.lower, "<"), (control.upper, ">")):
        if place is not None:
            text += f"    u = u {order} m->b[{place}] ? m->b[{place}] : u;\n"
    return text + f"    out->{control.name} = u;\n"
