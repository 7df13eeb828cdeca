/* A controller as a co-simulation unit of FMI 3.0; unit.h does the work. */
#include "fmi3.h"
#include "unit.h"

static fmi3Status answer(void *instance, bool done) {
    Unit *unit = instance;
    fmi3LogMessageCallback logger;
    if (done) return fmi3OK;
    memcpy(&logger, &unit->logger, sizeof logger);
    if (logger) logger(unit->environment, fmi3Error, "logStatusError", unit->problem);
    return fmi3Error;
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance unit, fmi3Boolean on, size_t count,
                                      const fmi3String categories[]) {
    return fmi3OK; /* only errors are logged, and always */
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                fmi3Boolean visible, fmi3Boolean on, fmi3Boolean events,
                                                fmi3Boolean early, const fmi3ValueReference intermediate[],
                                                size_t count, fmi3InstanceEnvironment environment,
                                                fmi3LogMessageCallback logger,
                                                fmi3IntermediateUpdateCallback update) {
    Unit *unit = make(name, environment);
    if (!unit) return NULL;
    memcpy(&unit->logger, &logger, sizeof unit->logger);
    if (token && !strcmp(token, TOKEN) && !events && count == 0) return unit;
    answer(unit,
           refuse(unit, "the unit has no event mode and no intermediate values; its token is %s", TOKEN));
    release(unit);
    return NULL;
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                 fmi3Boolean visible, fmi3Boolean on,
                                                 fmi3InstanceEnvironment environment,
                                                 fmi3LogMessageCallback logger) {
    return NULL;
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean on,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    return NULL;
}

EXPORT void fmi3FreeInstance(fmi3Instance unit) { release(unit); }

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean defined,
                                              fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean ends,
                                              fmi3Float64 stop) {
    Unit *unit = instance;
    if (!change(unit, INSTANTIATED, INITIALISING, "fmi3EnterInitializationMode")) return answer(unit, false);
    unit->kept.time = start;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance unit) {
    return answer(unit, change(unit, INITIALISING, STEPPING, "fmi3ExitInitializationMode"));
}

EXPORT fmi3Status fmi3Terminate(fmi3Instance unit) {
    return answer(unit, change(unit, STEPPING, ENDED, "fmi3Terminate"));
}

EXPORT fmi3Status fmi3Reset(fmi3Instance unit) {
    begin(unit);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance unit, const fmi3ValueReference which[], size_t count,
                                 fmi3Float64 values[], size_t size) {
    return answer(unit, size == count ? get(unit, which, count, values)
                                      : refuse(unit, "every variable is a scalar"));
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance unit, const fmi3ValueReference which[], size_t count,
                                 const fmi3Float64 values[], size_t size) {
    return answer(unit, size == count ? set(unit, which, count, values)
                                      : refuse(unit, "every variable is a scalar"));
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance unit, fmi3FMUState *copy) {
    return answer(unit, keep(unit, copy));
}
EXPORT fmi3Status fmi3SetFMUState(fmi3Instance unit, fmi3FMUState copy) {
    return answer(unit, put_back(unit, copy));
}
EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance unit, fmi3FMUState *copy) { return answer(unit, drop(copy)); }

EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance unit, fmi3FMUState copy, size_t *size) {
    *size = sizeof(Kept);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance unit, fmi3FMUState copy, fmi3Byte bytes[], size_t size) {
    return answer(unit, serialise(unit, copy, bytes, size));
}

EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance unit, const fmi3Byte bytes[], size_t size,
                                          fmi3FMUState *copy) {
    return answer(unit, deserialise(unit, bytes, size, copy));
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 from, fmi3Float64 length, fmi3Boolean final,
                             fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                             fmi3Float64 *reached) {
    Unit *unit = instance;
    bool done = advance(unit, from, length);
    *event = *terminate = *early = false;
    *reached = unit->kept.time;
    return answer(unit, done);
}

/* What the unit has none of: values of other types, events, clocks, derivatives, and other kinds of
 * simulation. */
#define REFUSED_CALL(NAME)                                                                                   \
    EXPORT fmi3Status NAME(fmi3Instance unit) { return answer(unit, refuse(unit, "there is no " #NAME)); }
#define REFUSED(NAME, ...)                                                                                   \
    EXPORT fmi3Status NAME(fmi3Instance unit, __VA_ARGS__) {                                                 \
        return answer(unit, refuse(unit, "there is no " #NAME));                                             \
    }
#define WHICH const fmi3ValueReference which[], size_t count
#define TYPED(KIND)                                                                                          \
    REFUSED(fmi3Get##KIND, WHICH, fmi3##KIND values[], size_t size)                                          \
    REFUSED(fmi3Set##KIND, WHICH, const fmi3##KIND values[], size_t size)

TYPED(Float32)
TYPED(Int8)
TYPED(UInt8)
TYPED(Int16)
TYPED(UInt16)
TYPED(Int32)
TYPED(UInt32)
TYPED(Int64)
TYPED(UInt64)
TYPED(Boolean)
TYPED(String)
REFUSED(fmi3GetBinary, WHICH, size_t sizes[], fmi3Binary values[], size_t size)
REFUSED(fmi3SetBinary, WHICH, const size_t sizes[], const fmi3Binary values[], size_t size)
REFUSED(fmi3GetClock, WHICH, fmi3Clock values[])
REFUSED(fmi3SetClock, WHICH, const fmi3Clock values[])
REFUSED(fmi3GetIntervalDecimal, WHICH, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
REFUSED(fmi3GetIntervalFraction, WHICH, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
        fmi3IntervalQualifier qualifiers[])
REFUSED(fmi3GetShiftDecimal, WHICH, fmi3Float64 shifts[])
REFUSED(fmi3GetShiftFraction, WHICH, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
REFUSED(fmi3SetIntervalDecimal, WHICH, const fmi3Float64 intervals[])
REFUSED(fmi3SetIntervalFraction, WHICH, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSED(fmi3SetShiftDecimal, WHICH, const fmi3Float64 shifts[])
REFUSED(fmi3SetShiftFraction, WHICH, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSED(fmi3GetNumberOfVariableDependencies, fmi3ValueReference dependent, size_t *count)
REFUSED(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t elements[],
        fmi3ValueReference independents[], size_t indices[], fmi3DependencyKind kinds[], size_t count)
REFUSED(fmi3GetDirectionalDerivative, WHICH, const fmi3ValueReference knowns[], size_t n,
        const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[], size_t size)
REFUSED(fmi3GetAdjointDerivative, WHICH, const fmi3ValueReference knowns[], size_t n,
        const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[], size_t size)
REFUSED(fmi3GetOutputDerivatives, WHICH, const fmi3Int32 orders[], fmi3Float64 values[], size_t size)
REFUSED(fmi3UpdateDiscreteStates, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
        fmi3Boolean *values, fmi3Boolean *defined, fmi3Float64 *next)
REFUSED(fmi3CompletedIntegratorStep, fmi3Boolean final, fmi3Boolean *event, fmi3Boolean *terminate)
REFUSED(fmi3SetTime, fmi3Float64 time)
REFUSED(fmi3SetContinuousStates, const fmi3Float64 states[], size_t count)
REFUSED(fmi3GetContinuousStateDerivatives, fmi3Float64 derivatives[], size_t count)
REFUSED(fmi3GetEventIndicators, fmi3Float64 indicators[], size_t count)
REFUSED(fmi3GetContinuousStates, fmi3Float64 states[], size_t count)
REFUSED(fmi3GetNominalsOfContinuousStates, fmi3Float64 nominals[], size_t count)
REFUSED(fmi3GetNumberOfEventIndicators, size_t *count)
REFUSED(fmi3GetNumberOfContinuousStates, size_t *count)
REFUSED(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
REFUSED_CALL(fmi3EnterEventMode)
REFUSED_CALL(fmi3EnterStepMode)
REFUSED_CALL(fmi3EnterConfigurationMode)
REFUSED_CALL(fmi3ExitConfigurationMode)
REFUSED_CALL(fmi3EvaluateDiscreteStates)
REFUSED_CALL(fmi3EnterContinuousTimeMode)
