"""The S-function compiles strictly and steps like the block, in a stand-in for Simulink."""

import subprocess

import numpy as np
import pytest

from symfric import BrownMcPhee, LuGre
from symfric.codegen import generate, law_block, plant_block
from symfric.codegen.kit import wrapper
from symfric.codegen.runner import FLAGS, WARNINGS, run_vm
from symfric.codegen.vectors import excitation
from symfric.emitter.c99 import REALS
from symfric.laws import GMS
from symfric.scenes import Drive

pytestmark = pytest.mark.heavy

SIMSTRUC = """
typedef double real_T;
typedef int int_T;
typedef struct { int n; real_T *data; } mxArray;
typedef struct {
    mxArray param[2];
    int states, inputs, outputs;
    real_T x[64], work[64], u[16], y[16], h;
    const char *error;
} SimStruct;
#define SS_OPTION_EXCEPTION_FREE_CODE 1
#define mxIsDouble(a) ((a)->n >= 0)
#define mxGetNumberOfElements(a) ((a)->n)
#define mxGetScalar(a) ((a)->data[0])
#define mxGetPr(a) ((a)->data)
#define ssGetSFcnParam(S, i) (&(S)->param[i])
#define ssSetNumSFcnParams(S, n) ((void)(S), (void)(n))
#define ssGetNumSFcnParams(S) ((void)(S), 2)
#define ssGetSFcnParamsCount(S) ((void)(S), 2)
#define ssSetSFcnParamTunable(S, i, t) ((void)(S))
#define ssSetErrorStatus(S, text) ((S)->error = (text))
#define ssSetNumContStates(S, n) ((void)(S))
#define ssSetNumDiscStates(S, n) ((S)->states = (n))
#define ssSetNumInputPorts(S, n) ((S)->inputs = (n), 1)
#define ssSetInputPortWidth(S, i, n) ((void)(S))
#define ssSetInputPortRequiredContiguous(S, i, n) ((void)(S))
#define ssSetInputPortDirectFeedThrough(S, i, n) ((void)(S))
#define ssSetNumOutputPorts(S, n) ((S)->outputs = (n), 1)
#define ssSetOutputPortWidth(S, i, n) ((void)(S))
#define ssSetNumSampleTimes(S, n) ((void)(S))
#define ssSetNumRWork(S, n) ((void)(S))
#define ssSetOptions(S, n) ((void)(S))
#define ssSetSampleTime(S, i, t) ((S)->h = (t))
#define ssSetOffsetTime(S, i, t) ((void)(S))
#define ssGetRealDiscStates(S) ((S)->x)
#define ssGetRWork(S) ((S)->work)
#define ssGetInputPortRealSignal(S, i) ((const real_T *)&(S)->u[i])
#define ssGetOutputPortRealSignal(S, i) (&(S)->y[i])
"""

DRIVER = """
#include <stdio.h>
#include <string.h>
int main(void)
{
    static SimStruct S;
    real_T head[2], parameters[64];
    if (fread(head, sizeof head, 1, stdin) != 1) { return 1; }
    S.param[0].n = 1;
    S.param[0].data = head;
    S.param[1].n = (int)head[1];
    S.param[1].data = parameters;
    if (fread(parameters, sizeof parameters[0], (size_t)S.param[1].n, stdin)
        != (size_t)S.param[1].n) { return 1; }
    mdlInitializeSizes(&S);
    if (S.error) { fputs(S.error, stderr); return 2; }
    mdlInitializeSampleTimes(&S);
    mdlInitializeConditions(&S);
    while (fread(S.u, sizeof S.u[0], (size_t)S.inputs, stdin) == (size_t)S.inputs) {
        mdlOutputs(&S, 0);
        mdlOutputs(&S, 0); /* Simulink may ask twice: nothing advances before the update */
        fwrite(S.y, sizeof S.y[0], (size_t)S.outputs, stdout);
        mdlUpdate(&S, 0);
    }
    mdlTerminate(&S);
    return 0;
}
"""


def built(made, compiler, folder):
    (folder / "simstruc.h").write_text(SIMSTRUC)
    (folder / "cg_sfun.h").write_text(DRIVER)
    wrapper, source = folder / f"{made.block.name}_sfun.c", made.source(made.reals[0])
    unused = "-Wno-unused-value"  # of the stand-in's macros
    files = [str(wrapper), str(source)]
    flags = [*FLAGS, *WARNINGS, "-Werror", unused, f"-I{folder}"]
    compiler.run(*flags, *files, "-o", str(folder / "sfun"), "-lm")
    return folder / "sfun"


def ran(program, h, parameters, inputs):
    numbers = np.concatenate([[h, len(parameters)], parameters, inputs.ravel()])
    return subprocess.run([program], input=numbers.tobytes(), capture_output=True, check=False)


BLOCKS = {
    "lugre": law_block(LuGre()),
    "brown_mcphee": law_block(BrownMcPhee()),
    "gms": law_block(GMS(form="event"), h=2e-3),
    "drive": plant_block(Drive(BrownMcPhee())),
}


FEW = {("lugre", True), ("brown_mcphee", False)}


@pytest.mark.parametrize(
    ("name", "own"),
    [
        pytest.param(name, own, marks=[] if (name, own) in FEW else pytest.mark.slow)
        for name in BLOCKS
        for own in (False, True)
    ],
)
def test_it_steps_like_the_block(name, own, compiler, tmp_path):
    block = BLOCKS[name]
    program = built(generate(block, tmp_path, real="double"), compiler, tmp_path)
    inputs = excitation(block)[:100]
    given = np.array([float(v.start) * 1.25 for v in block.parameters])
    h = 2e-3
    rows = np.array(
        [h if v.name == "h" else g for v, g in zip(block.parameters, given, strict=True)]
    )
    if not own:
        rows = np.array([h if v.name == "h" else float(v.start) for v in block.parameters])
    done = ran(program, h, given if own else given[:0], inputs)
    found = np.frombuffer(done.stdout).reshape(100, -1)
    expected = run_vm(block, REALS["double"], inputs, parameters=np.tile(rows, (100, 1)))
    first, last = len(block.states), len(block.states) + len(block.outputs)
    assert np.array_equal(found[:, :-1], expected[:, first:last])
    assert np.array_equal(found[:, -1], expected[:, -1])


def test_a_wrong_number_of_parameters_is_said(compiler, tmp_path):
    program = built(generate(LuGre(), tmp_path, real="float"), compiler, tmp_path)
    done = ran(program, 1e-3, np.ones(3), np.zeros((1, 2)))
    assert done.returncode == 2
    assert b"lugre: argument 2: expected [] or 8 parameters" in done.stderr


def test_the_head_names_the_ports_and_how_to_build():
    block = law_block(LuGre())
    text = wrapper(block, list(REALS.values()), guards=True)
    assert "mex lugre_sfun.c lugre_f64.c" in text
    assert "Outputs: F [N], F_end [N], status." in text
    assert ".a" not in text.split("#define")[0]
