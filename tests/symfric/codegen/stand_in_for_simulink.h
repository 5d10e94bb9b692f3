/* Names of simstruc.h that S-functions use, and a program that calls one. */
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
/* DRIVER */
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
