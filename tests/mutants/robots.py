"""Mutants of inverse dynamics in C, and of the programs that are run beside this process."""

from mutants.mutant import Mutant

INVERSE = "symfric/codegen/blocks/inverse_dynamics.py"
PAYLOAD = "symfric/codegen/blocks/joints.py"
RUBBING = "symfric/codegen/blocks/joints.py"
NUMBERING = "symfric/codegen/blocks/variables.py"
RUNNER = "symfric/codegen/runner.py"
T_INVERSE = ("tests/symfric/codegen/blocks/test_inverse_dynamics.py",)

ROBOTS = (
    Mutant("friction is left out of the torque", INVERSE, "motion + rubbed,", "motion,", T_INVERSE),
    Mutant(
        "what is coupled starts at zero", INVERSE, "[T_sx @ y + offset,", "[T_sx @ y,", T_INVERSE
    ),
    Mutant(
        "what is coupled weighs nothing", INVERSE, "ca.densify(ca.SX(self.T.T) @ ",
        "ca.densify(ca.SX(ca.DM(self.T.T) == 1) @ ", T_INVERSE,
    ),
    Mutant(
        "a normal force that other friction changes is taken", INVERSE,
        "    if ca.depends_on(stacked(eq.normals), eq.F):", "    if False:", T_INVERSE,
    ),
    Mutant(
        "a load far out does not turn its body", PAYLOAD, "_six(body.J + J + moved)",
        "_six(body.J + J)", T_INVERSE,
    ),
    Mutant(
        "the axes of the frame are those of the body", PAYLOAD,
        "ca.SX(frame.p) + ca.SX(frame.R) @ load.c", "ca.SX(frame.p) + load.c", T_INVERSE,
    ),
    Mutant(
        "a constant normal force cannot be changed", RUBBING,
        "        normal = level[0].symbol", "        pass", T_INVERSE,
    ),
    Mutant(
        "every joint has the states of the first", INVERSE,
        "ca.SX(stacked(columns))[order] if order",
        "ca.SX(stacked(columns))[[0] * len(order)] if order", T_INVERSE,
    ),
    Mutant(
        "metres and radians share an array", NUMBERING,
        '"in": [(v.name, (v.unit, v.lower, v.upper)) for v in block.inputs],',
        '"in": [(v.name, "") for v in block.inputs],', T_INVERSE,
    ),
    Mutant(
        "a program that hangs is waited for", RUNNER, "limit=limit, name=", "limit=1e4, name=",
        ("tests/symfric/codegen/test_runner.py",),
    ),
)  # fmt: skip
