"""The Simulink wrapper of a kit: a level 2 S-function in C that needs sources only, no library."""

from collections.abc import Sequence

from symfric.codegen.blocks.block import Block
from symfric.codegen.kit.c_text import declarations, fields, step
from symfric.codegen.writing.layout import prefix
from symfric.codegen.writing.text import banner, block_comment
from symfric.emitter.c99 import Real

WRAPPER = """\
{about}
#define S_FUNCTION_NAME {name}_sfun
#define S_FUNCTION_LEVEL 2

#include "simstruc.h"
#include "{stem}.h"

#include <math.h>

#define PARAMETERS {parameters} /* numbers in the second argument, in the order of the struct */

static void mdlInitializeSizes(SimStruct *S)
{{
    int i;

    ssSetNumSFcnParams(S, 2);
    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) {{
        return;
    }}
    if (!mxIsDouble(ssGetSFcnParam(S, 0)) || mxGetNumberOfElements(ssGetSFcnParam(S, 0)) != 1) {{
        ssSetErrorStatus(S, "{name}: argument 1: expected the sample time [s]");
        return;
    }}
    if (mxGetNumberOfElements(ssGetSFcnParam(S, 1)) != 0
        && (!mxIsDouble(ssGetSFcnParam(S, 1))
            || mxGetNumberOfElements(ssGetSFcnParam(S, 1)) != PARAMETERS)) {{
        ssSetErrorStatus(S, "{name}: argument 2: expected [] or {parameters} parameters");
        return;
    }}
    ssSetSFcnParamTunable(S, 0, 0);
    ssSetSFcnParamTunable(S, 1, 1);
    ssSetNumContStates(S, 0);
    ssSetNumDiscStates(S, {states});
    if (!ssSetNumInputPorts(S, {inputs})) {{
        return;
    }}
    for (i = 0; i < {inputs}; i++) {{
        ssSetInputPortWidth(S, i, 1);
        ssSetInputPortRequiredContiguous(S, i, 1);
        ssSetInputPortDirectFeedThrough(S, i, 1);
    }}
    if (!ssSetNumOutputPorts(S, {outputs})) {{
        return;
    }}
    for (i = 0; i < {outputs}; i++) {{
        ssSetOutputPortWidth(S, i, 1);
    }}
    ssSetNumSampleTimes(S, 1);
    ssSetNumRWork(S, {states}); /* the states after the step */
    ssSetOptions(S, SS_OPTION_EXCEPTION_FREE_CODE);
}}

static void mdlInitializeSampleTimes(SimStruct *S)
{{
    ssSetSampleTime(S, 0, mxGetScalar(ssGetSFcnParam(S, 0)));
    ssSetOffsetTime(S, 0, 0.0);
}}

#define MDL_INITIALIZE_CONDITIONS
static void mdlInitializeConditions(SimStruct *S)
{{
{start}
}}

static void mdlOutputs(SimStruct *S, int_T tid)
{{
{declarations}

    (void)tid;
{outputs_body}
}}

#define MDL_UPDATE
static void mdlUpdate(SimStruct *S, int_T tid)
{{
    (void)tid;
{update}
}}

static void mdlTerminate(SimStruct *S)
{{
    (void)S;
}}

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
"""


def wrapper(block: Block, reals: Sequence[Real], guards: bool) -> str:
    """Text of NAME_sfun.c; on the type double where it is there, else on float."""
    real = max(reals, key=lambda r: r.size)
    states, count = fields(block, "state"), len(block.states)
    outputs = len(block.outputs) + guards
    body = [*_given(block, real), *step(block, real, guards).splitlines(), *_shown(block, guards)]
    body += [f"ssGetRWork(S)[{i}] = (real_T){place};" for i, place in enumerate(states)]
    lines = declarations(block, real) + ["unsigned int status = 0u;"] * guards
    if block.parameters:
        lines.append("const real_T *given;")
    later = [f"ssGetRealDiscStates(S)[{i}] = ssGetRWork(S)[{i}];" for i in range(count)]
    name = prefix(block, real)
    start = [
        f"ssGetRealDiscStates(S)[{i}] = (real_T){name}_start.{place.partition('.')[2]};"
        for i, place in enumerate(states)
    ]
    return WRAPPER.format(
        about=block_comment(_about(block, name, guards)),
        name=block.name,
        stem=name,
        parameters=len(block.parameters),
        states=count,
        inputs=len(block.inputs),
        outputs=outputs,
        start=_indented(start or ["(void)S;"]),
        declarations=_indented(lines),
        outputs_body=_indented(body),
        update=_indented(later or ["(void)S;"]),
    )


def _given(block: Block, real: Real) -> list[str]:
    """Statements that take states, parameters and inputs from Simulink."""
    cast = "" if real.size == 8 else f"({real.name})"
    name, lines = prefix(block, real), list[str]()
    for i, place in enumerate(fields(block, "state")):
        lines.append(f"{place} = {cast}ssGetRealDiscStates(S)[{i}];")
    if block.parameters:
        lines += [
            f"param = {name}_default;",
            "if (mxGetNumberOfElements(ssGetSFcnParam(S, 1)) == PARAMETERS) {",
            "    given = mxGetPr(ssGetSFcnParam(S, 1));",
            *(f"    {p} = {cast}given[{i}];" for i, p in enumerate(fields(block, "param"))),
            "}",
        ]
        if any(v.name == "h" for v in block.parameters):
            lines.append(f"param.h = {cast}mxGetScalar(ssGetSFcnParam(S, 0));")
    for i, place in enumerate(fields(block, "in")):
        lines.append(f"{place} = {cast}ssGetInputPortRealSignal(S, {i})[0];")
    return lines


def _shown(block: Block, guards: bool) -> list[str]:
    """Statements that give the outputs, and the status, to Simulink."""
    places = [*fields(block, "out"), *(["status"] if guards else [])]
    return [f"ssGetOutputPortRealSignal(S, {i})[0] = (real_T){p};" for i, p in enumerate(places)]


def _about(block: Block, name: str, guards: bool) -> list[str]:
    """The head of the file: how it is built and what its ports are."""
    ports = [f"{v.name} [{v.unit}]" for v in block.inputs]
    shown = [f"{n} [{o.unit}]" for n, o in block.outputs.items()] + ["status"] * guards
    order = ", ".join(v.name for v in block.parameters) or "none"
    h = block.sample_time
    said = "" if h is None or "h" not in block.constants else f" It must be {h:g} s."
    return [
        *banner(block, f"{block.name}_sfun.c"),
        "",
        "S-function of level 2 in plain C. In MATLAB:",
        f"    mex {block.name}_sfun.c {name}.c",
        f"and in the block S-Function the name {block.name}_sfun with the arguments h, []. For a",
        f"build for a target (dSPACE, Speedgoat) add {name} to its S-function modules: sources are",
        "all that it needs.",
        f"Arguments: sample time [s].{said}",
        f"    Parameters, [] for the defaults, tunable, in the order {order}.",
        f"Inputs: {', '.join(ports) or 'none'}.",
        f"Outputs: {', '.join(shown) or 'none'}. States are discrete states of the block.",
    ]


def _indented(lines: Sequence[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)
