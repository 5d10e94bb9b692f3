@head
 *
 * Level-2 S-function in C. Compile it in MATLAB:
 *     mex @{name}_sfun.c @stem.c
 * Enter the name @{name}_sfun and the arguments h, [] in an S-Function block. To build for
 * a target (dSPACE, Speedgoat), add @stem to the S-function modules; the sources are
 * sufficient.
 * Arguments: sample time [s].@fixed
 *     Tunable parameters in the order @order; [] for the defaults.
 * Inputs: @ports.
 * Outputs: @shown. States are discrete states of the block.
 */
#define S_FUNCTION_NAME @{name}_sfun
#define S_FUNCTION_LEVEL 2

#include "simstruc.h"
#include "@stem.h"

#include <math.h>

#define PARAMETERS @parameters /* length of the second argument, in the order of the struct */

static void mdlInitializeSizes(SimStruct *S)
{
    int i;

    ssSetNumSFcnParams(S, 2);
    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) {
        return;
    }
    if (!mxIsDouble(ssGetSFcnParam(S, 0)) || mxGetNumberOfElements(ssGetSFcnParam(S, 0)) != 1) {
        ssSetErrorStatus(S, "@name: argument 1: expected the sample time [s]");
        return;
    }
    if (mxGetNumberOfElements(ssGetSFcnParam(S, 1)) != 0
        && (!mxIsDouble(ssGetSFcnParam(S, 1))
            || mxGetNumberOfElements(ssGetSFcnParam(S, 1)) != PARAMETERS)) {
        ssSetErrorStatus(S, "@name: argument 2: expected [] or @parameters parameters");
        return;
    }
    ssSetSFcnParamTunable(S, 0, 0);
    ssSetSFcnParamTunable(S, 1, 1);
    ssSetNumContStates(S, 0);
    ssSetNumDiscStates(S, @states);
    if (!ssSetNumInputPorts(S, @inputs)) {
        return;
    }
    for (i = 0; i < @inputs; i++) {
        ssSetInputPortWidth(S, i, 1);
        ssSetInputPortRequiredContiguous(S, i, 1);
        ssSetInputPortDirectFeedThrough(S, i, 1);
    }
    if (!ssSetNumOutputPorts(S, @outputs)) {
        return;
    }
    for (i = 0; i < @outputs; i++) {
        ssSetOutputPortWidth(S, i, 1);
    }
    ssSetNumSampleTimes(S, 1);
    ssSetNumRWork(S, @states); /* states after the step */
    ssSetOptions(S, SS_OPTION_EXCEPTION_FREE_CODE);
}

static void mdlInitializeSampleTimes(SimStruct *S)
{
    ssSetSampleTime(S, 0, mxGetScalar(ssGetSFcnParam(S, 0)));
    ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_INITIALIZE_CONDITIONS
static void mdlInitializeConditions(SimStruct *S)
{
@start
}

static void mdlOutputs(SimStruct *S, int_T tid)
{
@declarations

    (void)tid;
@outputs_body
}

#define MDL_UPDATE
static void mdlUpdate(SimStruct *S, int_T tid)
{
    (void)tid;
@update
}

static void mdlTerminate(SimStruct *S)
{
    (void)S;
}

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
