/* What the Functional Mock-up Interface 2.0 asks of a co-simulation slave: types and entry points. */
#ifndef SEATRIAL_FMI2_H
#define SEATRIAL_FMI2_H

#include "entry.h"

#include <stddef.h>

typedef void* fmi2Component;
typedef void* fmi2ComponentEnvironment;
typedef void* fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef char fmi2Byte;
typedef const fmi2Char* fmi2String;

enum { fmi2False = 0, fmi2True = 1 };
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String instance, fmi2Status, fmi2String category, fmi2String, ...);
    void* (*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void*);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

ENTRY const char* fmi2GetTypesPlatform(void);
ENTRY const char* fmi2GetVersion(void);
ENTRY fmi2Status fmi2SetDebugLogging(fmi2Component, fmi2Boolean on, size_t n, const fmi2String categories[]);
ENTRY fmi2Component fmi2Instantiate(fmi2String name, fmi2Type, fmi2String guid, fmi2String resources,
                                    const fmi2CallbackFunctions*, fmi2Boolean visible, fmi2Boolean logging);
ENTRY void fmi2FreeInstance(fmi2Component);
ENTRY fmi2Status fmi2SetupExperiment(fmi2Component, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real start,
                                     fmi2Boolean ends, fmi2Real stop);
ENTRY fmi2Status fmi2EnterInitializationMode(fmi2Component);
ENTRY fmi2Status fmi2ExitInitializationMode(fmi2Component);
ENTRY fmi2Status fmi2Terminate(fmi2Component);
ENTRY fmi2Status fmi2Reset(fmi2Component);
ENTRY fmi2Status fmi2GetReal(fmi2Component, const fmi2ValueReference[], size_t n, fmi2Real[]);
ENTRY fmi2Status fmi2GetInteger(fmi2Component, const fmi2ValueReference[], size_t n, fmi2Integer[]);
ENTRY fmi2Status fmi2GetBoolean(fmi2Component, const fmi2ValueReference[], size_t n, fmi2Boolean[]);
ENTRY fmi2Status fmi2GetString(fmi2Component, const fmi2ValueReference[], size_t n, fmi2String[]);
ENTRY fmi2Status fmi2SetReal(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2Real[]);
ENTRY fmi2Status fmi2SetInteger(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2Integer[]);
ENTRY fmi2Status fmi2SetBoolean(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2Boolean[]);
ENTRY fmi2Status fmi2SetString(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2String[]);
ENTRY fmi2Status fmi2GetFMUstate(fmi2Component, fmi2FMUstate*);
ENTRY fmi2Status fmi2SetFMUstate(fmi2Component, fmi2FMUstate);
ENTRY fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate*);
ENTRY fmi2Status fmi2SerializedFMUstateSize(fmi2Component, fmi2FMUstate, size_t*);
ENTRY fmi2Status fmi2SerializeFMUstate(fmi2Component, fmi2FMUstate, fmi2Byte[], size_t);
ENTRY fmi2Status fmi2DeSerializeFMUstate(fmi2Component, const fmi2Byte[], size_t, fmi2FMUstate*);
ENTRY fmi2Status fmi2GetDirectionalDerivative(fmi2Component, const fmi2ValueReference of[], size_t n,
                                              const fmi2ValueReference by[], size_t m, const fmi2Real[], fmi2Real[]);
ENTRY fmi2Status fmi2SetRealInputDerivatives(fmi2Component, const fmi2ValueReference[], size_t n,
                                             const fmi2Integer order[], const fmi2Real[]);
ENTRY fmi2Status fmi2GetRealOutputDerivatives(fmi2Component, const fmi2ValueReference[], size_t n,
                                              const fmi2Integer order[], fmi2Real[]);
ENTRY fmi2Status fmi2DoStep(fmi2Component, fmi2Real t, fmi2Real h, fmi2Boolean no_way_back);
ENTRY fmi2Status fmi2CancelStep(fmi2Component);
ENTRY fmi2Status fmi2GetStatus(fmi2Component, const fmi2StatusKind, fmi2Status*);
ENTRY fmi2Status fmi2GetRealStatus(fmi2Component, const fmi2StatusKind, fmi2Real*);
ENTRY fmi2Status fmi2GetIntegerStatus(fmi2Component, const fmi2StatusKind, fmi2Integer*);
ENTRY fmi2Status fmi2GetBooleanStatus(fmi2Component, const fmi2StatusKind, fmi2Boolean*);
ENTRY fmi2Status fmi2GetStringStatus(fmi2Component, const fmi2StatusKind, fmi2String*);

#endif
