/* The C interface of FMI 3.0: types, values and functions as the standard names them. */

#ifndef SYMFRIC_FMI3_H
#define SYMFRIC_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define FMI_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI_EXPORT __attribute__((visibility("default")))
#else
#define FMI_EXPORT
#endif

/* Units that are linked into one program begin their names with their own. */
#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define FMI3_JOIN(a, b) a##b
#define FMI3_NAMED(a, b) FMI3_JOIN(a, b)
#define fmi3GetVersion FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetVersion)
#define fmi3SetDebugLogging FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetDebugLogging)
#define fmi3InstantiateModelExchange FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3InstantiateModelExchange)
#define fmi3InstantiateCoSimulation FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3InstantiateCoSimulation)
#define fmi3InstantiateScheduledExecution FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3InstantiateScheduledExecution)
#define fmi3FreeInstance FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3FreeInstance)
#define fmi3EnterInitializationMode FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3EnterInitializationMode)
#define fmi3ExitInitializationMode FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3ExitInitializationMode)
#define fmi3EnterEventMode FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3EnterEventMode)
#define fmi3Terminate FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3Terminate)
#define fmi3Reset FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3Reset)
#define fmi3GetFloat32 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetFloat32)
#define fmi3GetFloat64 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetFloat64)
#define fmi3GetInt8 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetInt8)
#define fmi3GetUInt8 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetUInt8)
#define fmi3GetInt16 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetInt16)
#define fmi3GetUInt16 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetUInt16)
#define fmi3GetInt32 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetInt32)
#define fmi3GetUInt32 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetUInt32)
#define fmi3GetInt64 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetInt64)
#define fmi3GetUInt64 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetUInt64)
#define fmi3GetBoolean FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetBoolean)
#define fmi3GetString FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetString)
#define fmi3GetBinary FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetBinary)
#define fmi3GetClock FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetClock)
#define fmi3SetFloat32 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetFloat32)
#define fmi3SetFloat64 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetFloat64)
#define fmi3SetInt8 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetInt8)
#define fmi3SetUInt8 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetUInt8)
#define fmi3SetInt16 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetInt16)
#define fmi3SetUInt16 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetUInt16)
#define fmi3SetInt32 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetInt32)
#define fmi3SetUInt32 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetUInt32)
#define fmi3SetInt64 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetInt64)
#define fmi3SetUInt64 FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetUInt64)
#define fmi3SetBoolean FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetBoolean)
#define fmi3SetString FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetString)
#define fmi3SetBinary FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetBinary)
#define fmi3SetClock FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetClock)
#define fmi3GetNumberOfVariableDependencies FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfVariableDependencies)
#define fmi3GetVariableDependencies FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetVariableDependencies)
#define fmi3GetFMUState FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetFMUState)
#define fmi3SetFMUState FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetFMUState)
#define fmi3FreeFMUState FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3FreeFMUState)
#define fmi3SerializedFMUStateSize FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SerializedFMUStateSize)
#define fmi3SerializeFMUState FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SerializeFMUState)
#define fmi3DeserializeFMUState FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3DeserializeFMUState)
#define fmi3GetDirectionalDerivative FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetDirectionalDerivative)
#define fmi3GetAdjointDerivative FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetAdjointDerivative)
#define fmi3EnterConfigurationMode FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3EnterConfigurationMode)
#define fmi3ExitConfigurationMode FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3ExitConfigurationMode)
#define fmi3GetIntervalDecimal FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetIntervalDecimal)
#define fmi3GetIntervalFraction FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetIntervalFraction)
#define fmi3GetShiftDecimal FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetShiftDecimal)
#define fmi3GetShiftFraction FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetShiftFraction)
#define fmi3SetIntervalDecimal FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetIntervalDecimal)
#define fmi3SetIntervalFraction FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetIntervalFraction)
#define fmi3SetShiftDecimal FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetShiftDecimal)
#define fmi3SetShiftFraction FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetShiftFraction)
#define fmi3EvaluateDiscreteStates FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3EvaluateDiscreteStates)
#define fmi3UpdateDiscreteStates FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3UpdateDiscreteStates)
#define fmi3EnterContinuousTimeMode FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3EnterContinuousTimeMode)
#define fmi3CompletedIntegratorStep FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3CompletedIntegratorStep)
#define fmi3SetTime FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetTime)
#define fmi3SetContinuousStates FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3SetContinuousStates)
#define fmi3GetContinuousStateDerivatives FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetContinuousStateDerivatives)
#define fmi3GetEventIndicators FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetEventIndicators)
#define fmi3GetContinuousStates FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetContinuousStates)
#define fmi3GetNominalsOfContinuousStates FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetNominalsOfContinuousStates)
#define fmi3GetNumberOfEventIndicators FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfEventIndicators)
#define fmi3GetNumberOfContinuousStates FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfContinuousStates)
#define fmi3EnterStepMode FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3EnterStepMode)
#define fmi3GetOutputDerivatives FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3GetOutputDerivatives)
#define fmi3DoStep FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3DoStep)
#define fmi3ActivateModelPartition FMI3_NAMED(FMI3_FUNCTION_PREFIX, fmi3ActivateModelPartition)
#endif

#define fmi3Version "3.0"
#define fmi3True true
#define fmi3False false

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef char fmi3Char;
typedef const fmi3Char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent,
    fmi3Constant,
    fmi3Fixed,
    fmi3Tunable,
    fmi3Discrete,
    fmi3Dependent
} fmi3DependencyKind;
typedef enum {
    fmi3IntervalNotYetKnown,
    fmi3IntervalUnchanged,
    fmi3IntervalChanged
} fmi3IntervalQualifier;

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment environment, fmi3Status status,
                                       fmi3String category, fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment environment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment environment,
                                               fmi3Float64 time, fmi3Boolean set_requested,
                                               fmi3Boolean get_allowed, fmi3Boolean step_finished,
                                               fmi3Boolean can_return_early,
                                               fmi3Boolean *return_early, fmi3Float64 *return_time);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

#ifdef __cplusplus
extern "C" {
#endif

FMI_EXPORT const char *fmi3GetVersion(void);
FMI_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const
    fmi3String categories[]);
FMI_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token,
    fmi3String resources, fmi3Boolean visible, fmi3Boolean on, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log);
FMI_EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token,
    fmi3String resources, fmi3Boolean visible, fmi3Boolean on, fmi3Boolean event_mode, fmi3Boolean
    early_return, const fmi3ValueReference required[], size_t n_required, fmi3InstanceEnvironment
    environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update);
FMI_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token,
    fmi3String resources, fmi3Boolean visible, fmi3Boolean on, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log, fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock);
FMI_EXPORT void fmi3FreeInstance(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
    fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop);
FMI_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3Terminate(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3Reset(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3GetFloat32(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, fmi3Float32 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, fmi3Float64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetInt8(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, fmi3Int8 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetUInt8(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, fmi3UInt8 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetInt16(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, fmi3Int16 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetUInt16(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, fmi3UInt16 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, fmi3Int32 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetUInt32(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, fmi3UInt32 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetInt64(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, fmi3Int64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetUInt64(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, fmi3UInt64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, fmi3Boolean values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, fmi3String values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, size_t sizes[], fmi3Binary values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, fmi3Clock values[]);
FMI_EXPORT fmi3Status fmi3SetFloat32(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3Float32 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3Float64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetInt8(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, const fmi3Int8 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetUInt8(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, const fmi3UInt8 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetInt16(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, const fmi3Int16 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetUInt16(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3UInt16 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, const fmi3Int32 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetUInt32(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3UInt32 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetInt64(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, const fmi3Int64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetUInt64(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3UInt64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3Boolean values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3String values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const size_t sizes[], const fmi3Binary values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference references[], size_t
    n, const fmi3Clock values[]);
FMI_EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference
    reference, size_t *n);
FMI_EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent,
    size_t elements[], fmi3ValueReference independents[], size_t of_independents[],
    fmi3DependencyKind kinds[], size_t n);
FMI_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state);
FMI_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state);
FMI_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state);
FMI_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t
    *size);
FMI_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte
    bytes[], size_t size);
FMI_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t
    size, fmi3FMUState *state);
FMI_EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference
    unknowns[], size_t n_unknowns, const fmi3ValueReference knowns[], size_t n_knowns, const
    fmi3Float64 seeds[], size_t n_seeds, fmi3Float64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference
    unknowns[], size_t n_unknowns, const fmi3ValueReference knowns[], size_t n_knowns, const
    fmi3Float64 seeds[], size_t n_seeds, fmi3Float64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference
    references[], size_t n, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]);
FMI_EXPORT fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference
    references[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier
    qualifiers[]);
FMI_EXPORT fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, fmi3Float64 shifts[]);
FMI_EXPORT fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference
    references[], size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[]);
FMI_EXPORT fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference
    references[], size_t n, const fmi3Float64 intervals[]);
FMI_EXPORT fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference
    references[], size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
FMI_EXPORT fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference references[],
    size_t n, const fmi3Float64 shifts[]);
FMI_EXPORT fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference
    references[], size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
FMI_EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean
    *terminate, fmi3Boolean *nominals_changed, fmi3Boolean *values_changed, fmi3Boolean *has_next,
    fmi3Float64 *next);

/* Model exchange. */
FMI_EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_return,
    fmi3Boolean *event_mode, fmi3Boolean *terminate);
FMI_EXPORT fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time);
FMI_EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n);
FMI_EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64
    derivatives[], size_t n);
FMI_EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t
    n);
FMI_EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n);
FMI_EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[],
    size_t n);
FMI_EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n);
FMI_EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n);

/* Co-simulation and scheduled execution. */
FMI_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c);
FMI_EXPORT fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference
    references[], size_t n, const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values);
FMI_EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean
    no_return, fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64
    *reached);
FMI_EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock,
    fmi3Float64 time);

#ifdef __cplusplus
}
#endif

#endif
