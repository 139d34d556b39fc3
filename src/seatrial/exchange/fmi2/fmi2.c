/* A ship as a co-simulation slave: the entry points of FMI 2.0 over slave.h. */
#include "fmi2.h"
#include "slave.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    Slave slave;
    fmi2CallbackFunctions host;
    char name[TEXT];
    int heard; /* whether there is a logger */
} Ship;

/* The status of what was tried; what went wrong goes to the logger of the host. */
static fmi2Status done(Ship* ship, const char* wrong)
{
    const fmi2Status status = ship->slave.kept ? fmi2Discard : fmi2Error;
    ship->slave.kept = 0;
    if (!wrong) return fmi2OK;
    if (ship->heard)
        ship->host.logger(ship->host.componentEnvironment, ship->name, status, "logStatusError", "%s", wrong);
    return status;
}

const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging)
{
    Ship* ship = calloc(1, sizeof *ship);
    (void)resources; (void)visible; (void)logging;
    if (!ship) return NULL;
    if (host) ship->host = *host;
    ship->heard = host && host->logger;
    snprintf(ship->name, sizeof ship->name, "%s", name ? name : "");
    if (type != fmi2CoSimulation) done(ship, "a slave for co-simulation only, not for model exchange");
    else if (!guid || strcmp(guid, SHIP_GUID)) done(ship, "the guid is not that of modelDescription.xml, " SHIP_GUID);
    else { slave_fresh(&ship->slave); return ship; }
    free(ship);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c; (void)on; (void)n; (void)categories;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real from,
                               fmi2Boolean ends, fmi2Real stop)
{
    (void)tolerant; (void)tolerance; (void)ends; (void)stop;
    return done(c, slave_begin_at(c, from));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return done(c, slave_enter(c)); }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return done(c, slave_leave(c)); }
fmi2Status fmi2Terminate(fmi2Component c) { ((Slave*)c)->s.mode = ENDED; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { slave_fresh(c); return fmi2OK; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Real value[])
{
    return done(c, slave_get(c, at, n, value));
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Real value[])
{
    return done(c, slave_set(c, at, n, value));
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_way_back)
{
    (void)no_way_back;
    return done(c, slave_step(c, t, h));
}

fmi2Status fmi2CancelStep(fmi2Component c) { return done(c, "no step is ever pending"); }

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* copy) { return done(c, slave_save(c, copy)); }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate copy) { return done(c, slave_restore(c, copy)); }

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* copy)
{
    (void)c;
    free(*copy);
    *copy = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate copy, size_t* size)
{
    (void)c; (void)copy;
    *size = sizeof(State);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate copy, fmi2Byte bytes[], size_t size)
{
    return done(c, slave_to_bytes(c, copy, bytes, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate* copy)
{
    return done(c, slave_from_bytes(c, bytes, size, copy));
}

/* What this slave does not have, as modelDescription.xml says. */
#define NONE(call) fmi2Status call { (void)at; (void)value; return n ? done(c, "all variables are real") : fmi2OK; }
NONE(fmi2GetInteger(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Integer value[]))
NONE(fmi2GetBoolean(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Boolean value[]))
NONE(fmi2GetString(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2String value[]))
NONE(fmi2SetInteger(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Integer value[]))
NONE(fmi2SetBoolean(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Boolean value[]))
NONE(fmi2SetString(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2String value[]))

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference of[], size_t n,
                                        const fmi2ValueReference by[], size_t m, const fmi2Real dv[], fmi2Real d[])
{
    (void)of; (void)n; (void)by; (void)m; (void)dv; (void)d;
    return done(c, "no directional derivatives");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference at[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    (void)at; (void)order; (void)value;
    return n ? done(c, "inputs are held over a step; no derivatives of them") : fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference at[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    (void)at; (void)order; (void)value;
    return n ? done(c, "no derivatives of outputs") : fmi2OK;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status* value)
{
    (void)kind; (void)value;
    return done(c, "no step is ever pending");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* value)
{
    if (kind != fmi2LastSuccessfulTime) return done(c, "no such status");
    *value = ((Slave*)c)->s.t;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer* value)
{
    (void)kind; (void)value;
    return done(c, "no such status");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean* value)
{
    if (kind != fmi2Terminated) return done(c, "no such status");
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String* value)
{
    (void)kind; (void)value;
    return done(c, "no such status");
}
