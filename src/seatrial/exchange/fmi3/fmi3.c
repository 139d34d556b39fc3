/* A ship as a co-simulation slave: the entry points of FMI 3.0 over slave.h. */
#include "fmi3.h"
#include "slave.h"

#include <stdlib.h>
#include <string.h>

#define TIME NV /* value reference of the independent variable */

typedef struct {
    Slave slave;
    fmi3InstanceEnvironment host;
    fmi3LogMessageCallback log;
} Ship;

static void tell(fmi3LogMessageCallback log, fmi3InstanceEnvironment host, const char* wrong)
{
    if (log) log(host, fmi3Error, "logStatusError", wrong);
}

/* The status of what was tried; what went wrong goes to the logger of the host. */
static fmi3Status done(Ship* ship, const char* wrong)
{
    const fmi3Status status = ship->slave.kept ? fmi3Discard : fmi3Error;
    ship->slave.kept = 0;
    if (!wrong) return fmi3OK;
    if (ship->log) ship->log(ship->host, status, "logStatusError", wrong);
    return status;
}

const char* fmi3GetVersion(void) { return "3.0"; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[])
{
    (void)c; (void)on; (void)n; (void)categories;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t n,
    fmi3InstanceEnvironment host, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    Ship* ship;
    (void)name; (void)resources; (void)visible; (void)logging; (void)early; (void)required; (void)update;
    if (!token || strcmp(token, SHIP_GUID))
        tell(log, host, "the token is not that of modelDescription.xml, " SHIP_GUID);
    else if (events) tell(log, host, "no events here: instantiate without the event mode");
    else if (n) tell(log, host, "no values between communication points: ask for no intermediate variables");
    else if ((ship = calloc(1, sizeof *ship)) != NULL) {
        slave_fresh(&ship->slave);
        ship->host = host;
        ship->log = log;
        return ship;
    }
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment host, fmi3LogMessageCallback log)
{
    (void)name; (void)token; (void)resources; (void)visible; (void)logging;
    tell(log, host, "a slave for co-simulation only, not for model exchange");
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment host, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3PreemptionCallback lock, fmi3PreemptionCallback unlock)
{
    (void)name; (void)token; (void)resources; (void)visible; (void)logging; (void)update; (void)lock; (void)unlock;
    tell(log, host, "a slave for co-simulation only, not for scheduled execution");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerant, fmi3Float64 tolerance, fmi3Float64 from,
                                       fmi3Boolean ends, fmi3Float64 stop)
{
    const char* wrong = slave_begin_at(c, from);
    (void)tolerant; (void)tolerance; (void)ends; (void)stop;
    return done(c, wrong ? wrong : slave_enter(c));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return done(c, slave_leave(c)); }
fmi3Status fmi3EnterStepMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { ((Slave*)c)->s.mode = ENDED; return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { slave_fresh(c); return fmi3OK; }

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_way_back, fmi3Boolean* event,
                      fmi3Boolean* ended, fmi3Boolean* early, fmi3Float64* reached)
{
    const char* wrong = slave_step(c, t, h);
    (void)no_way_back;
    *event = *ended = *early = false;
    *reached = ((Slave*)c)->s.t;
    return done(c, wrong);
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference at[], size_t n, fmi3Float64 value[], size_t m)
{
    const char* wrong = m == n ? NULL : slave_told(c, "%u values for %u variables", (unsigned)m, (unsigned)n);
    size_t k, from = 0;
    for (k = 0; k <= n && !wrong; k++) {
        if (k < n && at[k] != TIME) continue;
        if (k > from) wrong = slave_get(c, at + from, k - from, value + from);
        if (k < n) value[k] = ((Slave*)c)->s.t;
        from = k + 1;
    }
    return done(c, wrong);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference at[], size_t n, const fmi3Float64 value[], size_t m)
{
    if (m != n) return done(c, slave_told(c, "%u values for %u variables", (unsigned)m, (unsigned)n));
    return done(c, slave_set(c, at, n, value));
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState* copy) { return done(c, slave_save(c, copy)); }
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState copy) { return done(c, slave_restore(c, copy)); }

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState* copy)
{
    (void)c;
    free(*copy);
    *copy = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState copy, size_t* size)
{
    (void)c; (void)copy;
    *size = sizeof(State);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState copy, fmi3Byte bytes[], size_t size)
{
    return done(c, slave_to_bytes(c, copy, bytes, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState* copy)
{
    return done(c, slave_from_bytes(c, bytes, size, copy));
}

/* What this slave does not have, as modelDescription.xml says. */
#define NONE(call, wrong) fmi3Status call { return done(c, wrong); }
#define OTHER(Type, type) \
    fmi3Status fmi3Get##Type(fmi3Instance c, const fmi3ValueReference at[], size_t n, type value[], size_t m) \
    { (void)at; (void)value; (void)m; return n ? done(c, "all variables are of type Float64") : fmi3OK; } \
    fmi3Status fmi3Set##Type(fmi3Instance c, const fmi3ValueReference at[], size_t n, const type value[], size_t m) \
    { (void)at; (void)value; (void)m; return n ? done(c, "all variables are of type Float64") : fmi3OK; }
OTHER(Float32, fmi3Float32)
OTHER(Int8, fmi3Int8)
OTHER(UInt8, fmi3UInt8)
OTHER(Int16, fmi3Int16)
OTHER(UInt16, fmi3UInt16)
OTHER(Int32, fmi3Int32)
OTHER(UInt32, fmi3UInt32)
OTHER(Int64, fmi3Int64)
OTHER(UInt64, fmi3UInt64)
OTHER(Boolean, fmi3Boolean)
OTHER(String, fmi3String)

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference at[], size_t n, size_t size[], fmi3Binary value[],
                         size_t m)
{
    (void)at; (void)size; (void)value; (void)m;
    return n ? done(c, "all variables are of type Float64") : fmi3OK;
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference at[], size_t n, const size_t size[],
                         const fmi3Binary value[], size_t m)
{
    (void)at; (void)size; (void)value; (void)m;
    return n ? done(c, "all variables are of type Float64") : fmi3OK;
}

#define CLOCKS(call) fmi3Status call { (void)at; (void)a; return n ? done(c, "no clocks here") : fmi3OK; }
#define CLOCKS_2(call) fmi3Status call { (void)at; (void)a; (void)b; return n ? done(c, "no clocks here") : fmi3OK; }
CLOCKS(fmi3GetClock(fmi3Instance c, const fmi3ValueReference at[], size_t n, fmi3Clock a[]))
CLOCKS(fmi3SetClock(fmi3Instance c, const fmi3ValueReference at[], size_t n, const fmi3Clock a[]))
CLOCKS(fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference at[], size_t n, fmi3Float64 a[]))
CLOCKS(fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference at[], size_t n, const fmi3Float64 a[]))
CLOCKS(fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference at[], size_t n, const fmi3Float64 a[]))
CLOCKS_2(fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference at[], size_t n, fmi3UInt64 a[], fmi3UInt64 b[]))
CLOCKS_2(fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference at[], size_t n, const fmi3UInt64 a[],
                              const fmi3UInt64 b[]))
CLOCKS_2(fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference at[], size_t n, const fmi3UInt64 a[],
                                 const fmi3UInt64 b[]))
CLOCKS_2(fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference at[], size_t n, fmi3Float64 a[],
                                fmi3IntervalQualifier b[]))

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference at[], size_t n, fmi3UInt64 counter[],
                                   fmi3UInt64 resolution[], fmi3IntervalQualifier told[])
{
    (void)at; (void)counter; (void)resolution; (void)told;
    return n ? done(c, "no clocks here") : fmi3OK;
}

NONE(fmi3EnterConfigurationMode(fmi3Instance c), "no structural parameters here")
NONE(fmi3ExitConfigurationMode(fmi3Instance c), "no structural parameters here")
NONE(fmi3EnterEventMode(fmi3Instance c), "no events here")
NONE(fmi3EvaluateDiscreteStates(fmi3Instance c), "no events here")

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean* again, fmi3Boolean* end, fmi3Boolean* nominals,
                                    fmi3Boolean* values, fmi3Boolean* event, fmi3Float64* at)
{
    (void)again; (void)end; (void)nominals; (void)values; (void)event; (void)at;
    return done(c, "no events here");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference at[], size_t n, const fmi3Int32 order[],
                                    fmi3Float64 value[], size_t m)
{
    (void)at; (void)order; (void)value; (void)m;
    return n ? done(c, "no derivatives of outputs") : fmi3OK;
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference of, size_t* n)
{
    (void)of; (void)n;
    return done(c, "dependencies are told by modelDescription.xml alone");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference at, size_t of[], fmi3ValueReference by[],
                                       size_t by_element[], fmi3DependencyKind kind[], size_t n)
{
    (void)at; (void)of; (void)by; (void)by_element; (void)kind; (void)n;
    return done(c, "dependencies are told by modelDescription.xml alone");
}

#define DERIVATIVE(name) \
    fmi3Status name(fmi3Instance c, const fmi3ValueReference of[], size_t n, const fmi3ValueReference by[], size_t m, \
                    const fmi3Float64 seed[], size_t seeds, fmi3Float64 d[], size_t ds) \
    { \
        (void)of; (void)n; (void)by; (void)m; (void)seed; (void)seeds; (void)d; (void)ds; \
        return done(c, "no directional or adjoint derivatives"); \
    }
DERIVATIVE(fmi3GetDirectionalDerivative)
DERIVATIVE(fmi3GetAdjointDerivative)

/* Of the other kinds of the interface. */
#define STATES(call) fmi3Status call { (void)value; (void)n; return done(c, "not for model exchange"); }
#define COUNT(call) fmi3Status call { *n = 0; return done(c, "not for model exchange"); }
NONE(fmi3EnterContinuousTimeMode(fmi3Instance c), "not for model exchange")
STATES(fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 value[], size_t n))
STATES(fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 value[], size_t n))
STATES(fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 value[], size_t n))
STATES(fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 value[], size_t n))
STATES(fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 value[], size_t n))
COUNT(fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t* n))
COUNT(fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t* n))

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) { (void)t; return done(c, "not for model exchange"); }

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_way_back, fmi3Boolean* event, fmi3Boolean* ended)
{
    (void)no_way_back; (void)event; (void)ended;
    return done(c, "not for model exchange");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 t)
{
    (void)clock; (void)t;
    return done(c, "not for scheduled execution");
}
