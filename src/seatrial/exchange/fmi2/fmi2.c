/* A ship as a co-simulation slave: FMI 2.0 around the functions of ship.h.

   Memory is taken when an instance or a copy of its state is made, never in a step.  Instances share nothing. */
#include "fmi2.h"
#include "ship.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NEAR 1e-6 /* of an internal step: as good as on its end */
#define TEXT 256

typedef enum { MADE, INITIALISING, RUNNING, ENDED } Mode;

/* All that a run depends on: a copy of it is the state of the slave. */
typedef struct {
    double v[NV];            /* outputs, inputs, parameters, starts: by value reference */
    double x[NX];            /* state at the end of the last whole step */
    double now[NX];          /* state at the communication point */
    double u[NU], e[NE];     /* what acts over the step under way */
    double a[NA + 1], a_next[NA + 1]; /* memory of the actuators before and after that step */
    double t_start, t;
    long long steps;         /* whole steps since the start */
    int begun;               /* whether a step is under way */
    Mode mode;
} State;

typedef struct {
    State s;
    fmi2CallbackFunctions host;
    char name[TEXT];
    int heard; /* whether there is a logger */
} Ship;

static fmi2Status fail(Ship* ship, const char* form, ...)
{
    char text[TEXT];
    va_list rest;
    va_start(rest, form);
    vsnprintf(text, sizeof text, form, rest);
    va_end(rest);
    if (ship->heard)
        ship->host.logger(ship->host.componentEnvironment, ship->name, fmi2Error, "logStatusError", "%s", text);
    return fmi2Error;
}

static void rk4(const State* s, const double x[], double h, double x_next[])
{
    const double* p = s->v + V_NUMBERS;
    double k[NX], sum[NX], z[NX];
    int i;
    ship_rates(x, s->u, s->e, p, k);
    for (i = 0; i < NX; i++) { sum[i] = k[i]; z[i] = x[i] + 0.5 * h * k[i]; }
    ship_rates(z, s->u, s->e, p, k);
    for (i = 0; i < NX; i++) { sum[i] += 2.0 * k[i]; z[i] = x[i] + 0.5 * h * k[i]; }
    ship_rates(z, s->u, s->e, p, k);
    for (i = 0; i < NX; i++) { sum[i] += 2.0 * k[i]; z[i] = x[i] + h * k[i]; }
    ship_rates(z, s->u, s->e, p, k);
    for (i = 0; i < NX; i++) x_next[i] = x[i] + h / 6.0 * (sum[i] + k[i]);
}

/* Outputs at the communication point, under what acts there. */
static void outputs(State* s)
{
    double rates[NX], u[NU], e[NE];
    int i;
    ship_inputs(s->v + V_INPUTS, u, e);
    for (i = 0; i < NA; i++) if (ship_control_of[i] >= 0) u[ship_control_of[i]] = s->a[i];
    ship_rates(s->now, u, e, s->v + V_NUMBERS, rates);
    for (i = 0; i < NX; i++) s->v[i] = s->now[i];
    for (i = 0; i < 3; i++) s->v[NX + i] = rates[3 + i];
    for (i = 0; i < NA; i++) if (ship_control_of[i] >= 0) s->v[NX + 3 + ship_control_of[i]] = s->a[i];
}

/* Inputs are read where an internal step begins, and hold until its end. */
static void begin(State* s)
{
#if NA > 0
    double orders[NU];
    ship_inputs(s->v + V_INPUTS, orders, s->e);
    ship_actuate(s->a, orders, s->v + V_SERVOS, s->u, s->a_next);
#else
    ship_inputs(s->v + V_INPUTS, s->u, s->e);
#endif
    s->begun = 1;
}

#if NA > 0
/* Orders and dead times live on the grid of the internal step; a point within it is reached by a shorter last one. */
static void advance(State* s, double h)
{
    const double at = (s->t + h - s->t_start) / STEP;
    const double whole = floor(at + NEAR);
    double rest = (at - whole) * STEP;
    if (rest < NEAR * STEP) rest = 0.0;
    while ((double)s->steps < whole) {
        if (!s->begun) begin(s);
        rk4(s, s->x, STEP, s->x);
        memcpy(s->a, s->a_next, sizeof s->a);
        s->steps++;
        s->begun = 0;
    }
    if (rest > 0.0 && !s->begun) begin(s);
    if (rest > 0.0) rk4(s, s->x, rest, s->now);
    else memcpy(s->now, s->x, sizeof s->now);
}
#else
/* Forces act from one communication point to the next, in equal steps no longer than the internal one. */
static void advance(State* s, double h)
{
    const double pieces = h > STEP ? ceil(h / STEP - NEAR) : 1.0;
    double k;
    begin(s);
    for (k = 0.0; k < pieces; k += 1.0) { rk4(s, s->x, h / pieces, s->x); s->steps++; }
    memcpy(s->now, s->x, sizeof s->now);
}
#endif

static void start(State* s)
{
    int i;
    for (i = 0; i < NX; i++) s->x[i] = s->now[i] = s->v[V_STARTS + i];
    for (i = 0; i < NA; i++) s->a[i] = ship_start_of[i] >= 0 ? s->v[V_STARTS + NX + ship_start_of[i]] : 0.0;
    s->t = s->t_start;
    s->steps = 0;
    s->begun = 0;
    outputs(s);
}

static void fresh(State* s)
{
    memset(s, 0, sizeof *s);
    memcpy(s->v, ship_values, sizeof s->v);
    s->mode = MADE;
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
    if (type != fmi2CoSimulation) fail(ship, "a slave for co-simulation only, not for model exchange");
    else if (!guid || strcmp(guid, SHIP_GUID)) fail(ship, "the guid is not that of modelDescription.xml, " SHIP_GUID);
    else { fresh(&ship->s); return ship; }
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
    Ship* ship = c;
    (void)tolerant; (void)tolerance; (void)ends; (void)stop;
    if (ship->s.mode != MADE) return fail(ship, "SetupExperiment after initialisation; reset first");
    if (!isfinite(from)) return fail(ship, "a start time that is no finite number");
    ship->s.t = ship->s.t_start = from;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Ship* ship = c;
    if (ship->s.mode != MADE) return fail(ship, "initialised already; reset first");
    ship->s.mode = INITIALISING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    Ship* ship = c;
    if (ship->s.mode != INITIALISING) return fail(ship, "not in initialisation");
    start(&ship->s);
    ship->s.mode = RUNNING;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) { ((Ship*)c)->s.mode = ENDED; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { fresh(&((Ship*)c)->s); return fmi2OK; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Real value[])
{
    Ship* ship = c;
    size_t i;
    if (ship->s.mode < RUNNING) start(&ship->s);
    for (i = 0; i < n; i++) {
        if (at[i] >= NV) return fail(ship, "no real variable %u; the last is %d", at[i], NV - 1);
        value[i] = ship->s.v[at[i]];
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Real value[])
{
    Ship* ship = c;
    size_t i;
    for (i = 0; i < n; i++) {
        if (at[i] >= NV) return fail(ship, "no real variable %u; the last is %d", at[i], NV - 1);
        if (at[i] < V_INPUTS) return fail(ship, "variable %u is an output and cannot be set", at[i]);
        if (at[i] >= V_NUMBERS && ship->s.mode >= RUNNING)
            return fail(ship, "variable %u is fixed once the run has begun; set it before, or reset", at[i]);
        if (!isfinite(value[i])) return fail(ship, "variable %u set to what is no finite number", at[i]);
    }
    for (i = 0; i < n; i++) ship->s.v[at[i]] = value[i];
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_way_back)
{
    Ship* ship = c;
    State* s = &ship->s;
    int i;
    (void)no_way_back;
    if (s->mode != RUNNING) return fail(ship, "a step outside a run; initialise first");
    if (!(h > 0.0) || !isfinite(h)) return fail(ship, "a step of %g s; it must be above zero", h);
    if (!(fabs(t - s->t) <= 1e-3 * h)) return fail(ship, "a step from t = %g s, but the ship is at %g s", t, s->t);
    s->t = t;
    advance(s, h);
    s->t = t + h;
    outputs(s);
    for (i = 0; i < V_INPUTS; i++)
        if (!isfinite(s->v[i])) return fail(ship, "the state is no longer finite at t = %g s", s->t);
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c) { return fail(c, "no step is ever pending"); }

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* copy)
{
    if (!*copy) *copy = malloc(sizeof(State));
    if (!*copy) return fail(c, "no memory for a copy of the state");
    memcpy(*copy, &((Ship*)c)->s, sizeof(State));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate copy)
{
    memcpy(&((Ship*)c)->s, copy, sizeof(State));
    return fmi2OK;
}

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
    if (size < sizeof(State)) return fail(c, "%u bytes for a state of %u", (unsigned)size, (unsigned)sizeof(State));
    memcpy(bytes, copy, sizeof(State));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate* copy)
{
    if (size != sizeof(State)) return fail(c, "%u bytes are no state of %u", (unsigned)size, (unsigned)sizeof(State));
    if (!*copy) *copy = malloc(sizeof(State));
    if (!*copy) return fail(c, "no memory for a copy of the state");
    memcpy(*copy, bytes, sizeof(State));
    return fmi2OK;
}

/* What this slave does not have, as modelDescription.xml says. */
#define NONE(call) fmi2Status call { (void)at; (void)value; return n ? fail(c, "all variables are real") : fmi2OK; }
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
    return fail(c, "no directional derivatives");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference at[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    (void)at; (void)order; (void)value;
    return n ? fail(c, "inputs are held over a step; no derivatives of them") : fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference at[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    (void)at; (void)order; (void)value;
    return n ? fail(c, "no derivatives of outputs") : fmi2OK;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status* value)
{
    (void)kind; (void)value;
    return fail(c, "no step is ever pending");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* value)
{
    if (kind != fmi2LastSuccessfulTime) return fail(c, "no such status");
    *value = ((Ship*)c)->s.t;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer* value)
{
    (void)kind; (void)value;
    return fail(c, "no such status");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean* value)
{
    if (kind != fmi2Terminated) return fail(c, "no such status");
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String* value)
{
    (void)kind; (void)value;
    return fail(c, "no such status");
}
