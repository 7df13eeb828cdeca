/* A controller as a co-simulation unit of FMI 2.0; unit.h does the work. */
#include "fmi2.h"
#include "unit.h"

static fmi2Status answer(void *instance, bool done) {
    Unit *unit = instance;
    fmi2CallbackLogger logger;
    if (done) return fmi2OK;
    memcpy(&logger, &unit->logger, sizeof logger);
    /* The message is a format, and has no percent sign: not every tool can fill one in. */
    if (logger) logger(unit->environment, unit->name, fmi2Error, "logStatusError", unit->problem);
    return fmi2Error;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count,
                                      const fmi2String categories[]) {
    return fmi2OK; /* only errors are logged, and always */
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                                     const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                                     fmi2Boolean on) {
    Unit *unit = make(name, functions ? functions->componentEnvironment : NULL);
    if (!unit) return NULL;
    if (functions) memcpy(&unit->logger, &functions->logger, sizeof unit->logger);
    if (type == fmi2CoSimulation && token && !strcmp(token, TOKEN)) return unit;
    answer(unit, refuse(unit, "the unit is for co-simulation, with the token %s", TOKEN));
    release(unit);
    return NULL;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { release(c); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, fmi2Real tolerance,
                                      fmi2Real start, fmi2Boolean ends, fmi2Real stop) {
    Unit *unit = c;
    if (!change(unit, INSTANTIATED, INSTANTIATED, "fmi2SetupExperiment")) return answer(c, false);
    unit->kept.time = start;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return answer(c, change(c, INSTANTIATED, INITIALISING, "fmi2EnterInitializationMode"));
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return answer(c, change(c, INITIALISING, STEPPING, "fmi2ExitInitializationMode"));
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c) {
    return answer(c, change(c, STEPPING, ENDED, "fmi2Terminate"));
}

EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    begin(c);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference which[], size_t count,
                              fmi2Real values[]) {
    return answer(c, get(c, which, count, values));
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference which[], size_t count,
                              const fmi2Real values[]) {
    return answer(c, set(c, which, count, values));
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *copy) { return answer(c, keep(c, copy)); }
EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate copy) { return answer(c, put_back(c, copy)); }
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *copy) { return answer(c, drop(copy)); }

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate copy, size_t *size) {
    *size = sizeof(Kept);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate copy, fmi2Byte bytes[], size_t size) {
    return answer(c, serialise(c, copy, bytes, size));
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                          fmi2FMUstate *copy) {
    return answer(c, deserialise(c, bytes, size, copy));
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real from, fmi2Real length, fmi2Boolean final) {
    return answer(c, advance(c, from, length));
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Unit *)c)->kept.time;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = 0;
    return fmi2OK;
}

/* What the unit has none of: values of other types, derivatives, and steps that go on after a call. */
#define REFUSED(NAME, ...)                                                                                   \
    EXPORT fmi2Status NAME(fmi2Component c, __VA_ARGS__) {                                                   \
        return answer(c, refuse(c, "there is no " #NAME));                                                   \
    }
#define TYPED(KIND)                                                                                          \
    REFUSED(fmi2Get##KIND, const fmi2ValueReference which[], size_t count, fmi2##KIND values[])              \
    REFUSED(fmi2Set##KIND, const fmi2ValueReference which[], size_t count, const fmi2##KIND values[])
#define STATUS(KIND, TYPE)                                                                                   \
    EXPORT fmi2Status fmi2Get##KIND(fmi2Component c, const fmi2StatusKind kind, TYPE *value) {               \
        return fmi2Discard;                                                                                  \
    }

TYPED(Integer)
TYPED(Boolean)
TYPED(String)
REFUSED(fmi2GetDirectionalDerivative, const fmi2ValueReference unknown[], size_t unknowns,
        const fmi2ValueReference known[], size_t knowns, const fmi2Real changes[], fmi2Real values[])
REFUSED(fmi2SetRealInputDerivatives, const fmi2ValueReference which[], size_t count,
        const fmi2Integer order[], const fmi2Real values[])
REFUSED(fmi2GetRealOutputDerivatives, const fmi2ValueReference which[], size_t count,
        const fmi2Integer order[], fmi2Real values[])
STATUS(Status, fmi2Status)
STATUS(IntegerStatus, fmi2Integer)
STATUS(StringStatus, fmi2String)

EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
    return answer(c, refuse(c, "no step goes on after its call"));
}
