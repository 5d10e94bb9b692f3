/* The C interface of FMI 2.0: types, values and functions as the standard names them. */

#ifndef SYMFRIC_FMI2_H
#define SYMFRIC_FMI2_H

#include <stddef.h>

#if defined(_WIN32)
#define FMI_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI_EXPORT __attribute__((visibility("default")))
#else
#define FMI_EXPORT
#endif

/* Units that are linked into one program begin their names with their own. */
#ifdef FMI2_FUNCTION_PREFIX
#define FMI2_JOIN(a, b) a##b
#define FMI2_NAMED(a, b) FMI2_JOIN(a, b)
#define fmi2GetTypesPlatform FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetTypesPlatform)
#define fmi2GetVersion FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetVersion)
#define fmi2SetDebugLogging FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetDebugLogging)
#define fmi2Instantiate FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2Instantiate)
#define fmi2FreeInstance FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2FreeInstance)
#define fmi2SetupExperiment FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetupExperiment)
#define fmi2EnterInitializationMode FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2EnterInitializationMode)
#define fmi2ExitInitializationMode FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2ExitInitializationMode)
#define fmi2Terminate FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2Terminate)
#define fmi2Reset FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2Reset)
#define fmi2GetReal FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetReal)
#define fmi2GetInteger FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetInteger)
#define fmi2GetBoolean FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetBoolean)
#define fmi2GetString FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetString)
#define fmi2SetReal FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetReal)
#define fmi2SetInteger FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetInteger)
#define fmi2SetBoolean FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetBoolean)
#define fmi2SetString FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetString)
#define fmi2GetFMUstate FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetFMUstate)
#define fmi2SetFMUstate FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetFMUstate)
#define fmi2FreeFMUstate FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2FreeFMUstate)
#define fmi2SerializedFMUstateSize FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SerializedFMUstateSize)
#define fmi2SerializeFMUstate FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SerializeFMUstate)
#define fmi2DeSerializeFMUstate FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2DeSerializeFMUstate)
#define fmi2GetDirectionalDerivative FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetDirectionalDerivative)
#define fmi2EnterEventMode FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2EnterEventMode)
#define fmi2NewDiscreteStates FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2NewDiscreteStates)
#define fmi2EnterContinuousTimeMode FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2EnterContinuousTimeMode)
#define fmi2CompletedIntegratorStep FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2CompletedIntegratorStep)
#define fmi2SetTime FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetTime)
#define fmi2SetContinuousStates FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetContinuousStates)
#define fmi2GetDerivatives FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetDerivatives)
#define fmi2GetEventIndicators FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetEventIndicators)
#define fmi2GetContinuousStates FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetContinuousStates)
#define fmi2GetNominalsOfContinuousStates FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetNominalsOfContinuousStates)
#define fmi2SetRealInputDerivatives FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2SetRealInputDerivatives)
#define fmi2GetRealOutputDerivatives FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetRealOutputDerivatives)
#define fmi2DoStep FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2DoStep)
#define fmi2CancelStep FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2CancelStep)
#define fmi2GetStatus FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetStatus)
#define fmi2GetRealStatus FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetRealStatus)
#define fmi2GetIntegerStatus FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetIntegerStatus)
#define fmi2GetBooleanStatus FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetBooleanStatus)
#define fmi2GetStringStatus FMI2_NAMED(FMI2_FUNCTION_PREFIX, fmi2GetStringStatus)
#endif

#define fmi2TypesPlatform "default"
#define fmi2Version "2.0"
#define fmi2True 1
#define fmi2False 0

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum {
    fmi2DoStepStatus,
    fmi2PendingStatus,
    fmi2LastSuccessfulTime,
    fmi2Terminated
} fmi2StatusKind;

typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment environment, fmi2String name,
                                   fmi2Status status, fmi2String category, fmi2String message, ...);
typedef void *(*fmi2CallbackAllocateMemory)(size_t count, size_t size);
typedef void (*fmi2CallbackFreeMemory)(void *object);
typedef void (*fmi2StepFinished)(fmi2ComponentEnvironment environment, fmi2Status status);

typedef struct {
    fmi2CallbackLogger logger;
    fmi2CallbackAllocateMemory allocateMemory;
    fmi2CallbackFreeMemory freeMemory;
    fmi2StepFinished stepFinished;
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean newDiscreteStatesNeeded;
    fmi2Boolean terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

#ifdef __cplusplus
extern "C" {
#endif

FMI_EXPORT const char *fmi2GetTypesPlatform(void);
FMI_EXPORT const char *fmi2GetVersion(void);
FMI_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const
    fmi2String categories[]);
FMI_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
    fmi2String resources, const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean
    on);
FMI_EXPORT void fmi2FreeInstance(fmi2Component c);
FMI_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real
    tolerance, fmi2Real start, fmi2Boolean has_stop, fmi2Real stop);
FMI_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c);
FMI_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c);
FMI_EXPORT fmi2Status fmi2Terminate(fmi2Component c);
FMI_EXPORT fmi2Status fmi2Reset(fmi2Component c);
FMI_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t
    n, fmi2Real values[]);
FMI_EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference references[],
    size_t n, fmi2Integer values[]);
FMI_EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference references[],
    size_t n, fmi2Boolean values[]);
FMI_EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference references[],
    size_t n, fmi2String values[]);
FMI_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t
    n, const fmi2Real values[]);
FMI_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference references[],
    size_t n, const fmi2Integer values[]);
FMI_EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference references[],
    size_t n, const fmi2Boolean values[]);
FMI_EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference references[],
    size_t n, const fmi2String values[]);
FMI_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state);
FMI_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state);
FMI_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state);
FMI_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t
    *size);
FMI_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte
    bytes[], size_t size);
FMI_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t
    size, fmi2FMUstate *state);
FMI_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference
    unknowns[], size_t n_unknowns, const fmi2ValueReference knowns[], size_t n_knowns, const
    fmi2Real seeds[], fmi2Real values[]);

/* Model exchange. */
FMI_EXPORT fmi2Status fmi2EnterEventMode(fmi2Component c);
FMI_EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info);
FMI_EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c);
FMI_EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_return,
    fmi2Boolean *event_mode, fmi2Boolean *terminate);
FMI_EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time);
FMI_EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n);
FMI_EXPORT fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t n);
FMI_EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t n);
FMI_EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n);
FMI_EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[],
    size_t n);

/* Co-simulation. */
FMI_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference
    references[], size_t n, const fmi2Integer orders[], const fmi2Real values[]);
FMI_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference
    references[], size_t n, const fmi2Integer orders[], fmi2Real values[]);
FMI_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean
    no_return);
FMI_EXPORT fmi2Status fmi2CancelStep(fmi2Component c);
FMI_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status
    *value);
FMI_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real
    *value);
FMI_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind,
    fmi2Integer *value);
FMI_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind,
    fmi2Boolean *value);
FMI_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String
    *value);

#ifdef __cplusplus
}
#endif

#endif
