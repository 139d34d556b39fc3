/* What the Functional Mock-up Interface 3.0 asks of a slave for co-simulation: types and entry points. */
#ifndef SEATRIAL_FMI3_H
#define SEATRIAL_FMI3_H

#include "entry.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef void* fmi3Instance;
typedef void* fmi3InstanceEnvironment;
typedef void* fmi3FMUState;
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
typedef bool fmi3Clock;
typedef uint8_t fmi3Byte;
typedef const char* fmi3String;
typedef const fmi3Byte* fmi3Binary;

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64 t, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean* early, fmi3Float64* at);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3PreemptionCallback)(void);

/* Instances and their life. */
ENTRY const char* fmi3GetVersion(void);
ENTRY fmi3Status fmi3SetDebugLogging(fmi3Instance, fmi3Boolean on, size_t n, const fmi3String categories[]);
ENTRY fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment,
    fmi3LogMessageCallback, fmi3IntermediateUpdateCallback);
ENTRY fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment, fmi3LogMessageCallback);
ENTRY fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment, fmi3LogMessageCallback, fmi3ClockUpdateCallback, fmi3PreemptionCallback lock,
    fmi3PreemptionCallback unlock);
ENTRY void fmi3FreeInstance(fmi3Instance);
ENTRY fmi3Status fmi3EnterInitializationMode(fmi3Instance, fmi3Boolean tolerant, fmi3Float64 tolerance,
                                             fmi3Float64 start, fmi3Boolean ends, fmi3Float64 stop);
ENTRY fmi3Status fmi3ExitInitializationMode(fmi3Instance);
ENTRY fmi3Status fmi3EnterConfigurationMode(fmi3Instance);
ENTRY fmi3Status fmi3ExitConfigurationMode(fmi3Instance);
ENTRY fmi3Status fmi3EnterEventMode(fmi3Instance);
ENTRY fmi3Status fmi3EnterStepMode(fmi3Instance);
ENTRY fmi3Status fmi3Terminate(fmi3Instance);
ENTRY fmi3Status fmi3Reset(fmi3Instance);
ENTRY fmi3Status fmi3DoStep(fmi3Instance, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_way_back, fmi3Boolean* event,
                            fmi3Boolean* ended, fmi3Boolean* early, fmi3Float64* reached);

/* Values. */
#define TYPED(Type, type) \
    ENTRY fmi3Status fmi3Get##Type(fmi3Instance, const fmi3ValueReference[], size_t n, type value[], size_t m); \
    ENTRY fmi3Status fmi3Set##Type(fmi3Instance, const fmi3ValueReference[], size_t n, const type value[], size_t m);
TYPED(Float32, fmi3Float32)
TYPED(Float64, fmi3Float64)
TYPED(Int8, fmi3Int8)
TYPED(UInt8, fmi3UInt8)
TYPED(Int16, fmi3Int16)
TYPED(UInt16, fmi3UInt16)
TYPED(Int32, fmi3Int32)
TYPED(UInt32, fmi3UInt32)
TYPED(Int64, fmi3Int64)
TYPED(UInt64, fmi3UInt64)
TYPED(Boolean, fmi3Boolean)
TYPED(String, fmi3String)
#undef TYPED
ENTRY fmi3Status fmi3GetBinary(fmi3Instance, const fmi3ValueReference[], size_t n, size_t size[], fmi3Binary[],
                               size_t m);
ENTRY fmi3Status fmi3SetBinary(fmi3Instance, const fmi3ValueReference[], size_t n, const size_t size[],
                               const fmi3Binary[], size_t m);
ENTRY fmi3Status fmi3GetClock(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3Clock[]);
ENTRY fmi3Status fmi3SetClock(fmi3Instance, const fmi3ValueReference[], size_t n, const fmi3Clock[]);
ENTRY fmi3Status fmi3GetOutputDerivatives(fmi3Instance, const fmi3ValueReference[], size_t n, const fmi3Int32 order[],
                                          fmi3Float64[], size_t m);
ENTRY fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance, fmi3ValueReference, size_t* n);
ENTRY fmi3Status fmi3GetVariableDependencies(fmi3Instance, fmi3ValueReference, size_t of[], fmi3ValueReference by[],
                                             size_t by_element[], fmi3DependencyKind[], size_t n);
ENTRY fmi3Status fmi3GetDirectionalDerivative(
    fmi3Instance, const fmi3ValueReference of[], size_t n, const fmi3ValueReference by[], size_t m,
    const fmi3Float64 seed[], size_t seeds, fmi3Float64 d[], size_t ds);
ENTRY fmi3Status fmi3GetAdjointDerivative(
    fmi3Instance, const fmi3ValueReference of[], size_t n, const fmi3ValueReference by[], size_t m,
    const fmi3Float64 seed[], size_t seeds, fmi3Float64 d[], size_t ds);

/* The state. */
ENTRY fmi3Status fmi3GetFMUState(fmi3Instance, fmi3FMUState*);
ENTRY fmi3Status fmi3SetFMUState(fmi3Instance, fmi3FMUState);
ENTRY fmi3Status fmi3FreeFMUState(fmi3Instance, fmi3FMUState*);
ENTRY fmi3Status fmi3SerializedFMUStateSize(fmi3Instance, fmi3FMUState, size_t*);
ENTRY fmi3Status fmi3SerializeFMUState(fmi3Instance, fmi3FMUState, fmi3Byte[], size_t size);
ENTRY fmi3Status fmi3DeserializeFMUState(fmi3Instance, const fmi3Byte[], size_t size, fmi3FMUState*);

/* Clocks and events. */
ENTRY fmi3Status fmi3GetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3Float64[],
                                        fmi3IntervalQualifier[]);
ENTRY fmi3Status fmi3GetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3UInt64 counter[],
                                         fmi3UInt64 resolution[], fmi3IntervalQualifier[]);
ENTRY fmi3Status fmi3GetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3Float64[]);
ENTRY fmi3Status fmi3GetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3UInt64 counter[],
                                      fmi3UInt64 resolution[]);
ENTRY fmi3Status fmi3SetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t n, const fmi3Float64[]);
ENTRY fmi3Status fmi3SetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t n,
                                         const fmi3UInt64 counter[], const fmi3UInt64 resolution[]);
ENTRY fmi3Status fmi3SetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t n, const fmi3Float64[]);
ENTRY fmi3Status fmi3SetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t n,
                                      const fmi3UInt64 counter[], const fmi3UInt64 resolution[]);
ENTRY fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance);
ENTRY fmi3Status fmi3UpdateDiscreteStates(fmi3Instance, fmi3Boolean* again, fmi3Boolean* end, fmi3Boolean* nominals,
                                          fmi3Boolean* values, fmi3Boolean* event, fmi3Float64* at);

/* Of the other kinds of the interface; hosts look for them all. */
ENTRY fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance);
ENTRY fmi3Status fmi3CompletedIntegratorStep(fmi3Instance, fmi3Boolean no_way_back, fmi3Boolean* event,
                                             fmi3Boolean* ended);
ENTRY fmi3Status fmi3SetTime(fmi3Instance, fmi3Float64 t);
ENTRY fmi3Status fmi3SetContinuousStates(fmi3Instance, const fmi3Float64[], size_t n);
ENTRY fmi3Status fmi3GetContinuousStates(fmi3Instance, fmi3Float64[], size_t n);
ENTRY fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance, fmi3Float64[], size_t n);
ENTRY fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance, fmi3Float64[], size_t n);
ENTRY fmi3Status fmi3GetEventIndicators(fmi3Instance, fmi3Float64[], size_t n);
ENTRY fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance, size_t* n);
ENTRY fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance, size_t* n);
ENTRY fmi3Status fmi3ActivateModelPartition(fmi3Instance, fmi3ValueReference clock, fmi3Float64 t);

#endif
