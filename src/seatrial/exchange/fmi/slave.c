/* A ship as a co-simulation slave: the run, between the functions of ship.h and those of an interface.

   Memory is taken when an instance or a copy of its state is made, never in a step.  Instances share nothing. */
#include "slave.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Share of an internal step that is as good as on its end; at a late time more, as its digits leave no better. */
static double near(const State* s) { return fmax(1e-6, 4.0 * DBL_EPSILON * fabs(s->t) / STEP); }

const char* slave_told(Slave* slave, const char* form, ...)
{
    va_list rest;
    va_start(rest, form);
    vsnprintf(slave->told, sizeof slave->told, form, rest);
    va_end(rest);
    return slave->told;
}

#if SAMPLED
/* Rates hold from one sample to the next, and so does what the model remembers. */
static void move(const State* s, const double x[], double h, double x_next[])
{
    int i;
    for (i = 0; i < NX; i++) x_next[i] = x[i] + h * s->dx[i];
}
#else
static void move(const State* s, const double x[], double h, double x_next[])
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
#endif

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
#if SAMPLED
    ship_sample(s->x, s->u, s->e, s->m, s->dx, s->m_next);
#endif
    s->begun = 1;
}

/* Outputs at the communication point, under what acts there; rates of a sampled model are those up to it. */
static void outputs(State* s)
{
    int i;
#if SAMPLED
    const double* rates = s->dx;
#else
    double rates[NX], u[NU], e[NE];
    ship_inputs(s->v + V_INPUTS, u, e);
    for (i = 0; i < NA; i++) if (ship_control_of[i] >= 0) u[ship_control_of[i]] = s->a[i];
    ship_rates(s->now, u, e, s->v + V_NUMBERS, rates);
#endif
    for (i = 0; i < NX; i++) s->v[i] = s->now[i];
    for (i = 0; i < 3; i++) s->v[NX + i] = rates[3 + i];
    for (i = 0; i < NA; i++) if (ship_control_of[i] >= 0) s->v[NX + 3 + ship_control_of[i]] = s->a[i];
    s->stale = 0;
}

#if NA > 0
/* Orders and dead times live on the grid of the internal step; a point within it is reached by a shorter last one. */
static void advance(State* s, double h)
{
    const double at = (s->t + h - s->t_start) / STEP;
    const double whole = floor(at + near(s));
    double rest = (at - whole) * STEP;
    if (rest < near(s) * STEP) rest = 0.0;
    while ((double)s->steps < whole) {
        if (!s->begun) begin(s);
        move(s, s->x, STEP, s->x);
        memcpy(s->a, s->a_next, sizeof s->a);
#if SAMPLED
        memcpy(s->m, s->m_next, sizeof s->m);
#endif
        s->steps++;
        s->begun = 0;
    }
    if (rest > 0.0 && !s->begun) begin(s);
    if (rest > 0.0) move(s, s->x, rest, s->now);
    else memcpy(s->now, s->x, sizeof s->now);
}
#else
/* Forces act from one communication point to the next, in equal steps no longer than the internal one. */
static void advance(State* s, double h)
{
    const double pieces = h > STEP ? ceil(h / STEP - near(s)) : 1.0;
    double k;
    begin(s);
    for (k = 0.0; k < pieces; k += 1.0) { move(s, s->x, h / pieces, s->x); s->steps++; }
    memcpy(s->now, s->x, sizeof s->now);
}
#endif

static void start(State* s)
{
    int i;
    for (i = 0; i < NX; i++) s->x[i] = s->now[i] = s->v[V_STARTS + i];
    for (i = 0; i < NA; i++) s->a[i] = ship_start_of[i] >= 0 ? s->v[V_STARTS + NX + ship_start_of[i]] : 0.0;
#if SAMPLED
    memset(s->m, 0, sizeof s->m);
    begin(s);
#endif
    s->t = s->t_start;
    s->steps = 0;
    s->begun = 0;
    outputs(s);
}

void slave_fresh(Slave* slave)
{
    memset(slave, 0, sizeof *slave);
    memcpy(slave->s.guid, SHIP_GUID, sizeof SHIP_GUID);
    memcpy(slave->s.v, ship_values, sizeof slave->s.v);
    slave->s.mode = MADE;
}

const char* slave_begin_at(Slave* slave, double t)
{
    if (slave->s.mode != MADE) return slave_told(slave, "initialised already; reset first");
    if (!isfinite(t)) return slave_told(slave, "a start time that is no finite number");
    slave->s.t = slave->s.t_start = t;
    return NULL;
}

const char* slave_enter(Slave* slave)
{
    if (slave->s.mode != MADE) return slave_told(slave, "initialised already; reset first");
    slave->s.mode = INITIALISING;
    return NULL;
}

const char* slave_leave(Slave* slave)
{
    if (slave->s.mode != INITIALISING) return slave_told(slave, "not in initialisation");
    start(&slave->s);
    slave->s.mode = RUNNING;
    return NULL;
}

const char* slave_get(Slave* slave, const unsigned at[], size_t n, double value[])
{
    size_t i;
    if (slave->s.mode < RUNNING) start(&slave->s);
    else if (slave->s.stale) outputs(&slave->s); /* accelerations depend on the inputs at once */
    for (i = 0; i < n; i++) {
        if (at[i] >= NV) return slave_told(slave, "no real variable %u; the last is %d", at[i], NV - 1);
        value[i] = slave->s.v[at[i]];
    }
    return NULL;
}

const char* slave_set(Slave* slave, const unsigned at[], size_t n, const double value[])
{
    size_t i;
    for (i = 0; i < n; i++) {
        if (at[i] >= NV) return slave_told(slave, "no real variable %u; the last is %d", at[i], NV - 1);
        if (at[i] < V_INPUTS) return slave_told(slave, "variable %u is an output and cannot be set", at[i]);
        if (at[i] >= V_NUMBERS && slave->s.mode >= RUNNING)
            return slave_told(slave, "variable %u is fixed once the run has begun; set it before, or reset", at[i]);
        if (!isfinite(value[i])) {
            slave->kept = 1;
            return slave_told(slave, "variable %u set to what is no finite number; it keeps its value", at[i]);
        }
    }
    for (i = 0; i < n; i++) slave->s.v[at[i]] = value[i];
    slave->s.stale = 1;
    return NULL;
}

const char* slave_step(Slave* slave, double t, double h)
{
    State* s = &slave->s;
    int i;
    if (s->mode != RUNNING) return slave_told(slave, "a step outside a run; initialise first");
    if (!(h > 0.0) || !isfinite(h)) return slave_told(slave, "a step of %g s; it must be above zero", h);
    if (!(fabs(t - s->t) <= 1e-3 * h))
        return slave_told(slave, "a step from t = %g s, but the ship is at %g s", t, s->t);
    s->t = t;
    advance(s, h);
    s->t = t + h;
    outputs(s);
    for (i = 0; i < V_INPUTS; i++)
        if (!isfinite(s->v[i])) return slave_told(slave, "the state is no longer finite at t = %g s", s->t);
    return NULL;
}

static const char* copied(Slave* slave, const void* from, void** to)
{
    if (!*to) *to = malloc(sizeof(State));
    if (!*to) return slave_told(slave, "no memory for a copy of the state");
    memcpy(*to, from, sizeof(State));
    return NULL;
}

const char* slave_save(Slave* slave, void** copy) { return copied(slave, &slave->s, copy); }

const char* slave_restore(Slave* slave, const void* copy)
{
    if (!copy) return slave_told(slave, "no copy of a state to restore");
    memcpy(&slave->s, copy, sizeof(State));
    return NULL;
}

const char* slave_to_bytes(Slave* slave, const void* copy, void* bytes, size_t size)
{
    const unsigned needed = (unsigned)sizeof(State);
    if (!copy) return slave_told(slave, "no copy of a state to serialise");
    if (size < needed) return slave_told(slave, "%u bytes for a state of %u", (unsigned)size, needed);
    memcpy(bytes, copy, sizeof(State));
    return NULL;
}

/* Limits of actuators may be infinite; nothing is ever NaN, and states are finite. */
static int sound(const State* s)
{
    int i;
    for (i = 0; i < NV; i++) if (isnan(s->v[i])) return 0;
    for (i = 0; i < NA; i++) if (isnan(s->a[i])) return 0;
    for (i = 0; i < NX; i++) if (!isfinite(s->v[i]) || !isfinite(s->x[i]) || !isfinite(s->now[i])) return 0;
    return isfinite(s->t) && isfinite(s->t_start) && s->mode >= MADE && s->mode <= ENDED && s->steps >= 0;
}

const char* slave_from_bytes(Slave* slave, const void* bytes, size_t size, void** copy)
{
    const unsigned needed = (unsigned)sizeof(State);
    State s;
    if (size != needed) return slave_told(slave, "%u bytes are no state of %u", (unsigned)size, needed);
    memcpy(&s, bytes, sizeof s); /* bytes need not lie as a state must */
    if (memcmp(s.guid, SHIP_GUID, sizeof SHIP_GUID) != 0)
        return slave_told(slave, "the bytes are the state of another FMU, or of none; this one is %s", SHIP_GUID);
    if (!sound(&s)) return slave_told(slave, "the bytes are a state with what is no finite number, or no mode");
    return copied(slave, &s, copy);
}
