/* A ship as a co-simulation slave, without the words of any one version of the interface.

   A function that may be refused returns NULL where it did what was asked for, else what is wrong, in one line. */
#ifndef SEATRIAL_SLAVE_H
#define SEATRIAL_SLAVE_H

#include "ship.h"

#include <stddef.h>

#define TEXT 256

typedef enum { MADE, INITIALISING, RUNNING, ENDED } Mode;

/* All that a run depends on: a copy of it is the state of the slave. */
typedef struct {
    char guid[sizeof SHIP_GUID]; /* of the ship that it is a state of */
    double v[NV];            /* outputs, inputs, parameters, starts: by value reference */
    double x[NX];            /* state at the end of the last whole step */
    double now[NX];          /* state at the communication point */
    double u[NU], e[NE];     /* what acts over the step under way */
    double a[NA + 1], a_next[NA + 1]; /* memory of the actuators before and after that step */
#if SAMPLED
    double dx[NX];           /* rates over that step */
    double m[NM + 1], m_next[NM + 1]; /* memory of the model before and after it */
#endif
    double t_start, t;
    long long steps;         /* whole steps since the start */
    int begun;               /* whether a step is under way */
    int stale;               /* whether inputs were set since the outputs were found */
    Mode mode;
} State;

typedef struct {
    State s;
    char told[TEXT]; /* what was wrong last */
    int kept;        /* whether what was wrong last changed nothing, so that the run may go on: bad input */
} Slave;

const char* slave_told(Slave*, const char* form, ...);
void slave_fresh(Slave*);
const char* slave_begin_at(Slave*, double t);
const char* slave_enter(Slave*);
const char* slave_leave(Slave*);
const char* slave_get(Slave*, const unsigned at[], size_t n, double value[]);
const char* slave_set(Slave*, const unsigned at[], size_t n, const double value[]);
const char* slave_step(Slave*, double t, double h);

/* Copies of the state; `copy` points to NULL, or to an earlier copy, which is written over. */
const char* slave_save(Slave*, void** copy);
const char* slave_restore(Slave*, const void* copy);
const char* slave_to_bytes(Slave*, const void* copy, void* bytes, size_t size);
const char* slave_from_bytes(Slave*, const void* bytes, size_t size, void** copy);

#endif
