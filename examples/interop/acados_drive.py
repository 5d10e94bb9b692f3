"""A model for acados: its fields, and a check of the functions that acados would generate.

    x' = f(x, u, p),   its forward variational equations Sx' = df/dx Sx, Su' = df/dx Su + df/du

acados has no wheel. If `acados_template` is installed, the model is an AcadosModel, else an object
with the same fields. In both cases the C that CasADi writes for acados is compiled and compared
with the friction law. Use a smooth law: the fixed steps of the integrators of acados must resolve
v_t, or the bristles of LuGre (sim_method_num_steps).
"""

from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from symfric import BrownMcPhee, Model, drive

OUT = Path("out")


def acados_model(model: Model) -> Any:
    """Return an AcadosModel of an explicit model without events."""
    if model.ode is None or model.z or model.events:
        raise ValueError(f"acados_model: expected an explicit model without events: {model.name}")
    if find_spec("acados_template"):
        from acados_template import AcadosModel  # noqa: PLC0415  # pyright: ignore

        made = AcadosModel()
    else:
        made = SimpleNamespace()
    made.name = model.name
    made.x, made.u, made.p = (model.vector(letter) for letter in "xup")
    made.xdot = ca.SX.sym("xdot", made.x.numel())
    made.f_expl_expr = model.ode
    made.f_impl_expr = made.xdot - model.ode
    return made


def functions(m: Any) -> list[ca.Function]:
    """Return expl_ode_fun and expl_vde_forw, as acados generates them with CasADi."""
    nx, nu = m.x.numel(), m.u.numel()
    Sx, Su = ca.SX.sym("Sx", nx, nx), ca.SX.sym("Su", nx, nu)
    vdeX = ca.jtimes(m.f_expl_expr, m.x, Sx)
    vdeU = ca.jtimes(m.f_expl_expr, m.x, Su) + ca.jacobian(m.f_expl_expr, m.u)
    ode = ca.Function(f"{m.name}_expl_ode_fun", [m.x, m.u, m.p], [m.f_expl_expr])
    name = f"{m.name}_expl_vde_forw"
    return [ode, ca.Function(name, [m.x, Sx, Su, m.u, m.p], [m.f_expl_expr, vdeX, vdeU])]


def compiled(function: ca.Function, folder: Path) -> ca.Function:
    """Return the function from generated and compiled C."""
    code = ca.CodeGenerator(f"{function.name()}.c")
    code.add(function)
    source = code.generate(f"{folder}/")
    return ca.external(function.name(), ca.Importer(source, "shell", {"compiler": "cc"}))


def main() -> None:
    """Write, compile and compare."""
    OUT.mkdir(exist_ok=True)
    law = BrownMcPhee(v_t=5e-3)
    m = acados_model(drive(law, m=1.0, N=10.0))
    x, u, p = np.array([0.0, 2e-3]), np.array([1.0]), np.zeros(0)
    ode, vde = functions(m)
    rate = compiled(ode, OUT)(x, u, p)
    print(
        f"acceleration {float(rate[1]):.6f} m/s^2, by hand {1.0 - float(law.force(2e-3, 10.0)):.6f}"
    )
    _, vdeX, vdeU = compiled(vde, OUT)(x, np.eye(2), np.zeros((2, 1)), u, p)
    h = 1e-8
    slope = (float(law.force(2e-3 + h, 10.0)) - float(law.force(2e-3 - h, 10.0))) / (2 * h)
    print(f"da/dv {float(vdeX[1, 1]):.4f} 1/s, by differences {-slope:.4f}; da/du {float(vdeU[1])}")


if __name__ == "__main__":
    main()
