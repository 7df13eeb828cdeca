/* An instance of a controller, and what FMI 2.0 and 3.0 alike do with it.
 *
 * model.h is written with each unit. It names the controller (MODEL_STATE, MODEL_READINGS, MODEL_INIT,
 * MODEL_STEP), its numbers of INPUTS and OUTPUTS, its INTERVAL (s), the unit's TOKEN, and the readings at
 * START. Value references: 0 is the time, then the inputs, then the outputs.
 */
#ifndef UNIT_H
#define UNIT_H

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#define TOLERANCE (1e-6 * INTERVAL) /* s, for times that a tool has summed up */

/* Readings are copied as an array: no compiler may leave gaps between them. */
typedef char readings_are_doubles[sizeof(MODEL_READINGS) == INPUTS * sizeof(double) ? 1 : -1];

enum mode { INSTANTIATED, INITIALISING, STEPPING, ENDED };

/* All that calls change, without pointers: a copy of it is the state of the unit. */
typedef struct {
    MODEL_STATE state;
    double readings[INPUTS];
    double force[OUTPUTS]; /* N */
    double time;           /* s */
    int32_t mode;
} Kept;

typedef struct {
    Kept kept;
    char problem[200]; /* why the last call was refused */
    void *environment; /* the tool's, as is its logger */
    void *logger;
    char *name;
} Unit;

/* Note why a call is refused; false, so that it can be returned. */
static bool refuse(Unit *unit, const char *format, ...) {
    va_list values;
    va_start(values, format);
    vsnprintf(unit->problem, sizeof unit->problem, format, values);
    va_end(values);
    return false;
}

static void begin(Unit *unit) {
    const double start[INPUTS] = START;
    memset(&unit->kept, 0, sizeof unit->kept);
    MODEL_INIT(&unit->kept.state);
    memcpy(unit->kept.readings, start, sizeof start);
    unit->kept.mode = INSTANTIATED;
}

static void release(Unit *unit) {
    if (unit) free(unit->name);
    free(unit);
}

/* A new instance; NULL where memory is short. */
static Unit *make(const char *name, void *environment) {
    Unit *unit = calloc(1, sizeof *unit);
    size_t letters = strlen(name ? name : "") + 1;
    if (!unit) return NULL;
    unit->name = calloc(letters, 1);
    if (!unit->name) {
        release(unit);
        return NULL;
    }
    if (name) memcpy(unit->name, name, letters);
    unit->environment = environment;
    begin(unit);
    return unit;
}

static bool change(Unit *unit, enum mode from, enum mode to, const char *call) {
    if (unit->kept.mode != (int32_t)from) return refuse(unit, "%s is not allowed at this point", call);
    unit->kept.mode = to;
    return true;
}

static bool get(Unit *unit, const uint32_t references[], size_t count, double values[]) {
    for (size_t k = 0; k < count; ++k) {
        uint32_t which = references[k];
        if (which > INPUTS + OUTPUTS)
            return refuse(unit, "no variable has the value reference %u", (unsigned)which);
        if (which == 0) values[k] = unit->kept.time;
        else if (which <= INPUTS) values[k] = unit->kept.readings[which - 1];
        else values[k] = unit->kept.force[which - INPUTS - 1];
    }
    return true;
}

static bool set(Unit *unit, const uint32_t references[], size_t count, const double values[]) {
    for (size_t k = 0; k < count; ++k) /* all of them or none */
        if (references[k] < 1 || references[k] > INPUTS)
            return refuse(unit, "no input has the value reference %u", (unsigned)references[k]);
    for (size_t k = 0; k < count; ++k) unit->kept.readings[references[k] - 1] = values[k];
    return true;
}

/* One control step for each interval of a tool's step, with the readings held. */
static bool advance(Unit *unit, double from, double length) {
    MODEL_READINGS readings;
    double steps = floor(length / INTERVAL + 0.5);
    if (unit->kept.mode != STEPPING)
        return refuse(unit, "a step needs an instance that is initialised and not ended");
    if (!(fabs(from - unit->kept.time) <= TOLERANCE))
        return refuse(unit, "the step begins at %.9g s, the controller is at %.9g s", from, unit->kept.time);
    if (!(steps >= 1 && fabs(length - steps * INTERVAL) <= TOLERANCE))
        return refuse(unit, "a step of %.9g s is not a whole number of intervals of %.9g s", length,
                      INTERVAL);
    memcpy(&readings, unit->kept.readings, sizeof readings);
    for (; steps > 0; --steps) MODEL_STEP(&unit->kept.state, &readings, unit->kept.force);
    unit->kept.time = from + length;
    return true;
}

static bool keep(Unit *unit, void **copy) {
    if (!*copy) *copy = malloc(sizeof unit->kept);
    if (!*copy) return refuse(unit, "there is no memory for a state");
    memcpy(*copy, &unit->kept, sizeof unit->kept);
    return true;
}

static bool put_back(Unit *unit, const void *copy) {
    if (!copy) return refuse(unit, "there is no state to go back to");
    memcpy(&unit->kept, copy, sizeof unit->kept);
    return true;
}

static bool drop(void **copy) {
    free(*copy);
    *copy = NULL;
    return true;
}

static bool serialise(Unit *unit, const void *copy, void *bytes, size_t size) {
    if (!copy || size < sizeof unit->kept) return refuse(unit, "a state has %zu bytes", sizeof unit->kept);
    memcpy(bytes, copy, sizeof unit->kept);
    return true;
}

static bool deserialise(Unit *unit, const void *bytes, size_t size, void **copy) {
    if (size != sizeof unit->kept)
        return refuse(unit, "a state has %zu bytes, and these are %zu", sizeof unit->kept, size);
    if (!keep(unit, copy)) return false;
    memcpy(*copy, bytes, size);
    return true;
}

#endif
