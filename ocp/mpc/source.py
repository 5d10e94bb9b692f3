"""Header and source of a controller in C99, the only implementation of the solver.

Each cycle solves sequential quadratic programs over the horizon:

    1. linearise at the plan (X, U), and stop if residual <= tolerance
    2. find the change of the plan and the multipliers by the quadratic program
    3. take 1, 1/2, 1/4, ... of this change by the merit  cost + penalties + nu |defects|_1

The Hessian is the Gauss-Newton one in the first two iterations of a cycle. Near stick, friction has
more curvature than the cost, and these iterations converge slowly. From the third iteration on, the
curvature of the equations, weighted with their multipliers, is added if the pivots of the Riccati
recursion remain positive.

The residual is that of the Karush-Kuhn-Tucker conditions at the returned plan, with multipliers of
the equations for which the gradients in the states are zero. It is the largest of

 * gradients in the inputs, divided by nominal value and own curvature of the cost in an input,
   which bound the remaining change of an input relative to its nominal value;
 * defects of the equations, divided by the nominal value of the state;
 * violations of rows in units of their signals, and products of rows and multipliers, divided by
   the larger of multiplier and this curvature. For a violated soft row the alternative is the
   difference of multiplier and penalty, relative to the penalty, times the violation.

The quadratic program is solved by a primal-dual interior-point method. Hard rows have v >= 0. Soft
rows may be violated by s >= 0 with the penalty rho s + sigma s^2 / 2:

    v - t + s = 0,   t z = mu,   s y = mu,   z + y = rho + sigma s

Elimination of t, s and y from Newton's method leaves a weight w and a slope e for each row,

    z_new = z + w (o - D d),   w = 1 / (t / z + f),   e = -(z + w o),
    o = mu / z - v - s + f a,   a = rho + sigma s - z - mu / s,   f = 1 / (sigma + y / s)

with f = 0 for a hard row, which enter the recursion over the intervals. Mehrotra's predictor and
corrector use the same matrices. If the minimum without rows satisfies all rows, it is the solution.

In float, gradients with multipliers of thousands of curvatures have rounding errors above the
tolerance. The residual contains an estimate of them, and iterations end where it dominates
(`CycleStatus.ROUNDED`); `GeneratedController.verify` compares the result with double precision.

C names begin with the name of the controller. `NAME_t` contains plan and work space; `NAME_param_t`
(defaults `NAME_default`) model parameters, bounds, tolerance and iterations; `NAME_in_t`
measurements and references; `NAME_out_t` controls and results. `NAME_init` and `NAME_step` are the
functions.

Sources: Nocedal and Wright, Numerical Optimization, 2nd ed., (18.36) (weight of the merit);
    Mehrotra, On the implementation of a primal-dual interior point method, SIAM J. Optim. 2(4),
    1992; Frison and Diehl, HPIPM, IFAC 2020 (soft rows).
"""

import re
from collections import Counter
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path

import casadi as ca

from ocp.mpc.design import Control, CycleStatus, Design
from symfric.emitter.c99 import DOUBLE, FLOAT, TRANSCENDENTAL, Real, filled, folded, macro
from symfric.emitter.emit import emit
from symfric.foundation.graph import graph

FLOAT_NAMES = {"fabs": "fabsf", "HUGE_VAL": "HUGE_VALF"}
FOLDER = Path(__file__).parent
"""Folder of the templates in C.

The file cycle.c contains the loops of all controllers, with NAME for the name of the controller,
macros for sizes and functions for kernels. Loops are bounded, and memory is a struct of the caller.
"""
PLAIN = 2
"""Number of iterations without curvature of the equations, which helps only near the optimum."""
ARMIJO = 1e-4
ROUNDING = {DOUBLE: 1e-12, FLOAT: 1e-5}
"""Relative increase of the merit by rounding errors that a step may have."""
BACK = 0.995
"""Step of the interior-point method, as a share of the step to the boundary."""
RESOLUTION = {DOUBLE: 1e-15, FLOAT: 1.5e-5}
"""Estimate of the rounding error of a gradient relative to its terms; in float, where it decides
when iterations end, 130 rounding units."""
MOST, MOST_IN_FLOAT, HALVINGS = 40, 18, 6
"""Largest numbers of iterations of the interior-point method, in double and in float, where later
ones make no progress, and of halvings of a step."""
SMALLEST = {DOUBLE: 1e-200, FLOAT: 1e-18}
"""Smallest slack and multiplier in the interior-point method, whose ratios are finite."""
CLOSE = {DOUBLE: 1e-7, FLOAT: 1e-4}
"""Value of mu, in units of the curvature, at which a quadratic program is solved."""
AWAY = 0.1
"""Smallest initial distance of the interior-point method from bounds, in units of the signals."""


def header(design: Design, real: Real = DOUBLE) -> str:
    """Return the text of the header file."""
    name, h, parts = design.name, design.horizon, sizes(design)
    n, nx, nu, rows = parts["N"], parts["NX"], parts["NU"], parts["ALL"]
    memory = {
        "x": (n + 1, nx), "u": (n, nu), "z": (rows,), "r": (n + 1, parts["NR"]), "t": (n + 1,),
        "p": (parts["NPAR"],), "b": (parts["NB"],), "L": (n, parts["NL"]),
        "L_end": (parts["NL_END"],), "G": (n, parts["NG"]), "k": (n, nu), "lam": (n, nx),
        "w": (rows,), "e": (rows,),
    }  # fmt: skip
    of_rows = ("v", "ts", "zn", "s", "y", "f", "a", "o", "goal_t", "goal_s", "dt", "dz", "ds", "dy")
    memory |= dict.fromkeys(of_rows, (rows,)) if rows else {}
    model = {v.name: v for v in (*h.model.p, *h.model.x)}
    param = [(name, f"{model[name].doc} [{model[name].unit}]") for name in h.parameters]
    param += [(bound, "bound") for bound in design.bound_names]
    param.append(("tolerance", "residual at which a plan is optimal"))
    states = [model[name] for name in design.measured_names]
    into = [(v.name, f"measured: {v.doc} [{v.unit}]") for v in states]
    into += [(f"{r}[{h.count + 1}]", "reference now and after each interval") for r in h.references]
    into += [("t", "time now [s]")] * timed(design)
    out = [(c.name, f"input over the next {h.step:g} s [{c.unit}]") for c in design.controls]
    out.append(("residual", "of the conditions of optimality, of the plan that this is from"))
    out.append(("violation", "largest of a soft bound, in units of its signal"))
    text = filled(
        FOLDER / "controller.h",
        banner=_banner(f"{name}.h"),
        name=name,
        model=h.model.name,
        step=f"{h.step:g}",
        count=h.count,
        guard=f"{name.upper()}_H",
        statuses="".join(f"#define {name}_{s.name} {int(s)}\n" for s in CycleStatus),
        change=_arrays({"x": (n + 1, nx), "u": (n, nu), "D": (rows,)}),
        memory=_arrays(memory),
        param=_members(param),
        into=_members(into),
        out=_members(out),
        indent=" " * (len(name) + 11),
    )
    return typed(text, real)


def typed(text: str, real: Real) -> str:
    """Return C for double with numbers and functions of another type."""
    if real is DOUBLE:
        return text
    text = re.sub(r"\bdouble\b", real.name, text)
    text = re.sub(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?)(?![\w.])", rf"\1{real.letter}", text)
    return re.sub(r"\b(fabs(?=\()|HUGE_VAL\b)", lambda m: FLOAT_NAMES[m[1]], text)


def source(design: Design, real: Real = DOUBLE) -> str:
    """Return the text of the source file.

    Raises:
        ValueError: an operation does not exist in C99.
    """
    h, kernels, calls = design.horizon, list[str](), Counter[str]()
    for kernel in design.kernels.all:
        text, called = _kernel(kernel, real)
        kernels.append(text)
        calls += called
    parameters = [f"m->p[{i}] = param->{name};" for i, name in enumerate(h.parameters)]
    bounds = [f"m->b[{i}] = param->{bound};" for i, bound in enumerate(design.bound_names)]
    needed = [f"in->{name}" for name in design.measured_names] + ["param->tolerance"]
    needed += ["in->t"] * timed(design)
    needed += [f"m->p[{i}]" for i in range(len(parameters))]
    needed += [f"m->b[{i}]" for i in range(len(bounds))]
    finite = [f"sound = sound && isfinite({number});" for number in needed]
    now = "in->t + " if timed(design) else ""
    each = [f"m->t[k] = {now}{real.literal(h.step)} * (double)k;"]
    each += [f"m->r[k][{i}] = in->{name}[k];" for i, name in enumerate(h.references)]
    each += [f"sound = sound && isfinite(m->r[k][{i}]);" for i in range(len(h.references))]
    pairs = zip(design.measured, design.measured_names, strict=True)
    loops = (FOLDER / "cycle.c").read_text(encoding="utf-8").rstrip()
    loops = loops.replace("NAME", design.name).replace("move_t", f"{design.name}_move_t")
    text = filled(
        FOLDER / "controller.c",
        banner=_banner(f"{design.name}.c"),
        name=design.name,
        count=h.count,
        booleans="#include <stdbool.h>\n" * any("bool " in kernel for kernel in kernels),
        constants=_lines([*parameters, *bounds, *finite], 4),
        each=_lines(each, 8),
        measured=_lines((f"m->x[0][{i}] = in->{name};" for i, name in pairs), 4),
        controls="".join(map(_shown, design.controls)),
        macros=_macros(design, real),
        functions_of_libm="".join(
            f"#ifndef {macro(c, real)}\n#define {macro(c, real)} {c}{real.letter}\n#endif\n"
            for c in sorted(set(calls) & set(TRANSCENDENTAL.values()))
        ),
        tables=_tables(design, real),
        kernels="".join(kernels),
        loops=loops,
    )
    return typed(text, real)


def _banner(file: str) -> str:
    return f"""/* {file}: C99 made by symfric {version("symfric")} with CasADi {version("casadi")}.
 * This generated code is yours. SPDX-License-Identifier: MIT-0"""


def sizes(design: Design) -> dict[str, int]:
    """Return macro -> number for the loops in C."""
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
        "MOST": MOST,
        "HALVINGS": HALVINGS,
    }


def timed(design: Design) -> bool:
    """Return True if a cost or a bound depends on time."""
    h = design.horizon
    values = [h.early.value, h.late.value, h.end.value]
    values += [limit.expression for limit in h.all_limits]
    return ca.depends_on(ca.vertcat(*values), h.t)


def _members(rows: Iterable[tuple[str, str]]) -> str:
    return "".join(
        f"    double {name + ';':<17} /* {text.strip().replace('*/', '* /')} */\n"
        for name, text in rows
    )


def _arrays(shapes: dict[str, tuple[int, ...]]) -> str:
    """Return the declarations of members name -> shape; sizes of zero become one."""
    lines = (name + "".join(f"[{max(n, 1)}]" for n in shape) for name, shape in shapes.items())
    return "".join(f"    double {line};\n" for line in lines)


def _lines(lines: Iterable[str], margin: int) -> str:
    return "".join(f"{' ' * margin}{line}\n" for line in lines)


def _macros(design: Design, real: Real) -> str:
    parts: dict[str, int | str] = dict(sizes(design))
    if real is FLOAT:
        parts["MOST"] = MOST_IN_FLOAT
    numbers = {
        "PAIRS": float(parts["ALL"]) + float((design.prices > 0.0).sum()),
        "CURVATURE": design.horizon.curvature,
        "CLOSE": CLOSE[real],
        "AWAY": AWAY,
        "BACK": BACK,
        "ARMIJO": ARMIJO,
        "ROUNDING": ROUNDING[real],
        "RESOLUTION": RESOLUTION[real],
        "SMALLEST": SMALLEST[real],
    }
    parts |= {name: real.literal(value) for name, value in numbers.items()}
    lines = [f"#define {name} {value}" for name, value in parts.items()]
    row = "((j) < N * ROWS ? (j) % ROWS : ROWS + (j) - N * ROWS)" if parts["ROWS"] else "(j)"
    return "\n".join([*lines, f"#define ROW(j) {row}", ""])


def _tables(design: Design, real: Real) -> str:
    """Return the constant arrays and the default parameters."""
    name, h, prices = design.name, design.horizon, design.row_prices.tolist()
    tables = {
        "nominal_x": h.model.nominal("x").tolist(),
        "nominal_u": h.model.nominal("u").tolist(),
        "start_x": design.x0.tolist(),
        "start_u": design.u0.tolist(),
        "identity": list(design.kernels.identity),
    }
    if prices:
        tables |= {"rho": prices, "sigma": prices}
    text = ""
    for table, values in tables.items():
        numbers = ", ".join(map(real.literal, values))
        text += folded(f"static const double {table}[{len(values)}] = {{{numbers}}};", "") + "\n"
    if prices:
        flags = ", ".join(str(int(price > 0.0)) for price in prices)
        text += f"static const int soft[{len(prices)}] = {{{flags}}};\n"
    values = [*design.p0.tolist(), *design.bounds.tolist(), design.settings.tolerance]
    numbers = ", ".join([*map(real.literal, values), str(design.settings.iterations)])
    return f"{text}\nconst {name}_param_t {name}_default = {{\n    {numbers}\n}};\n\n"


def _kernel(function: ca.Function, real: Real) -> tuple[str, Counter[str]]:
    """Return a static C function with columns as arguments, and the functions that it calls."""
    whole = graph(function)
    count, results = function.n_in(), function.n_out()
    names = [[f"a{i}_{j}" for j in range(function.size1_in(i))] for i in range(count)]
    targets = [[f"r{i}[{j}] = {{}};" for j in range(function.size1_out(i))] for i in range(results)]
    code = emit(whole, names, targets, real)
    used = sorted(code.used)
    loads = [f"const double a{i}_{j} = a{i}[{j}];" for i, j in used]
    idle = [f"(void)a{i};" for i in range(count) if i not in {u[0] for u in used}]
    idle += [f"(void)r{i};" for i in range(results) if not targets[i]]
    arguments = [f"const double *a{i}" for i in range(count)]
    arguments += [f"double *r{i}" for i in range(results)]
    head = folded(f"static void {function.name()}({', '.join(arguments)})", "")
    body = "".join(folded(line, "    ") + "\n" for line in (*idle, *loads, *code.lines))
    return f"{head}\n{{\n{body}}}\n\n", code.calls


def _shown(control: Control) -> str:
    value = f"m->u[0][{control.place}]"
    if control.rated:
        value = f"0.5 * (m->x[0][{control.place}] + m->x[1][{control.place}])"
    text = f"    u = {value};\n"
    for place, order in ((control.lower, "<"), (control.upper, ">")):
        if place is not None:
            text += f"    u = u {order} m->b[{place}] ? m->b[{place}] : u;\n"
    return text + f"    out->{control.name} = u;\n"
