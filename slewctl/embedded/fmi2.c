/*
 * @NAME@ as a functional mock-up unit: co-simulation of FMI 2.0, declared here as the standard
 * does. The controller is sampled: at every multiple of its sample time it reads its inputs, and
 * its command changes @DELAY@ s later. A command that is due at once is there as soon as the inputs
 * of that time are set, before the step that follows.
 */
#include "@NAME@.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define FMI2_EXPORT __declspec(dllexport)
#else
#define FMI2_EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi2Component;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;

#define SAMPLE_TIME @SAMPLE_TIME@
#define DELAY @DELAY@
#define INPUTS @INPUTS@ /* readings, reference angle, feedforward */
#define COMMAND @INPUTS@
#define START_ANGLE (COMMAND + 1)
#define FAULT (COMMAND + 2)
/* Times that differ by less are one: a master may add its steps up, or begin years from zero. */
#define SAME (1e-3 * SAMPLE_TIME)
/* Commands under way: as many as samples fit into the delay, and one. */
#define LATE @LATE@

typedef struct {
    @NAME@_controller controller;
    double inputs[INPUTS];
    double start_angle;
    double command;
    double due[LATE];   /* commands that were computed, oldest first */
    double due_at[LATE];
    int waiting;
    double began;
    double now;
    double samples; /* taken so far */
    int running;    /* whether it is initialized */
    int fresh;      /* whether inputs were set since the last step */
} Unit;

static const double SCALE[INPUTS + 1] = {@SCALES@};

static @NAME@_number number_of(double value, double scale)
{
@NUMBER_OF@
}

static double command_of(@NAME@_controller *controller, const double in[INPUTS])
{
    @NAME@_number y[INPUTS - 2];
    int k;
    for (k = 0; k < (INPUTS - 2); ++k) {
        y[k] = number_of(in[k], SCALE[k]);
    }
    return (double)@NAME@_step(controller, y, number_of(in[INPUTS - 2], SCALE[INPUTS - 2]),
               number_of(in[INPUTS - 1], SCALE[INPUTS - 1]))
        / SCALE[INPUTS];
}

static double tick(const Unit *unit)
{
    return unit->began + unit->samples * SAMPLE_TIME;
}

static void sample(Unit *unit)
{
    unit->due[unit->waiting] = command_of(&unit->controller, unit->inputs);
    unit->due_at[unit->waiting] = tick(unit) + DELAY;
    unit->waiting += 1;
    unit->samples += 1.0;
}

/* Put out what is due until a time, that time included. */
static void put_out(Unit *unit, double until)
{
    while ((unit->waiting > 0) && (unit->due_at[0] <= (until + SAME))) {
        unit->command = unit->due[0];
        unit->waiting -= 1;
        memmove(unit->due, unit->due + 1, sizeof(double) * (size_t)unit->waiting);
        memmove(unit->due_at, unit->due_at + 1, sizeof(double) * (size_t)unit->waiting);
    }
}

static void start(Unit *unit)
{
    unit->fresh = 1;
    @NAME@_init(&unit->controller, number_of(unit->start_angle, SCALE[INPUTS - 2]));
    unit->command = 0.0;
    unit->waiting = 0;
    unit->samples = 0.0;
    unit->now = unit->began;
}

FMI2_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(
    fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[])
{
    (void)c, (void)on, (void)count, (void)categories;
    return fmi2OK;
}

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, int kind, fmi2String guid,
    fmi2String resources, const void *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    Unit *unit = NULL;
    (void)name, (void)resources, (void)functions, (void)visible, (void)logging;
    if ((kind == 1) && (guid != NULL) && (strcmp(guid, "@GUID@") == 0)) {
        unit = (Unit *)calloc(1, sizeof(Unit));
        if (unit != NULL) {
            start(unit);
        }
    }
    return unit;
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance,
    fmi2Real tolerance, fmi2Real from, fmi2Boolean has_end, fmi2Real until)
{
    Unit *unit = (Unit *)c;
    (void)has_tolerance, (void)tolerance, (void)has_end, (void)until;
    unit->began = from;
    unit->now = from;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    start((Unit *)c);
    ((Unit *)c)->running = 1;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    Unit *unit = (Unit *)c;
    memset(unit, 0, sizeof(*unit));
    start(unit);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetReal(
    fmi2Component c, const fmi2ValueReference names[], size_t count, fmi2Real values[])
{
    const Unit *unit = (const Unit *)c;
    size_t k;
    for (k = 0; k < count; ++k) {
        if (names[k] < INPUTS) {
            values[k] = unit->inputs[names[k]];
        } else if (names[k] == START_ANGLE) {
            values[k] = unit->start_angle;
        } else if (names[k] != COMMAND) {
            return fmi2Error;
        } else if ((DELAY <= SAME) && (unit->fresh != 0) && (fabs(tick(unit) - unit->now) <= SAME)) {
            /* What the sample that is due now will command; its inputs are those of now. */
            @NAME@_controller copy = unit->controller;
            values[k] = command_of(&copy, unit->inputs);
        } else {
            values[k] = unit->command;
        }
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetReal(
    fmi2Component c, const fmi2ValueReference names[], size_t count, const fmi2Real values[])
{
    Unit *unit = (Unit *)c;
    size_t k;
    for (k = 0; k < count; ++k) {
        if (names[k] < INPUTS) {
            unit->inputs[names[k]] = values[k];
            unit->fresh = 1;
        } else if ((names[k] == START_ANGLE) && (unit->running == 0)) {
            unit->start_angle = values[k];
            start(unit);
        } else {
            return fmi2Error;
        }
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetInteger(
    fmi2Component c, const fmi2ValueReference names[], size_t count, fmi2Integer values[])
{
    size_t k;
    for (k = 0; k < count; ++k) {
        if (names[k] != FAULT) {
            return fmi2Error;
        }
        values[k] = (fmi2Integer)((const Unit *)c)->controller.fault;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DoStep(
    fmi2Component c, fmi2Real at, fmi2Real step, fmi2Boolean no_way_back)
{
    Unit *unit = (Unit *)c;
    const double end = at + step;
    (void)no_way_back;
    if ((unit->running == 0) || !(step >= 0.0) || !isfinite(end)
        || (fabs(at - unit->now) > SAME)) {
        return fmi2Error;
    }
    while (tick(unit) < (end - SAME)) {
        put_out(unit, tick(unit));
        sample(unit);
    }
    put_out(unit, end);
    unit->now = end;
    if (step > 0.0) {
        unit->fresh = 0;
    }
    return fmi2OK;
}

/* What this unit has none of. */

FMI2_EXPORT fmi2Status fmi2GetBoolean(
    fmi2Component c, const fmi2ValueReference names[], size_t count, fmi2Boolean values[])
{
    (void)c, (void)names, (void)values;
    return (count == 0u) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetString(
    fmi2Component c, const fmi2ValueReference names[], size_t count, fmi2String values[])
{
    (void)c, (void)names, (void)values;
    return (count == 0u) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SetInteger(
    fmi2Component c, const fmi2ValueReference names[], size_t count, const fmi2Integer values[])
{
    (void)c, (void)names, (void)values;
    return (count == 0u) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SetBoolean(
    fmi2Component c, const fmi2ValueReference names[], size_t count, const fmi2Boolean values[])
{
    (void)c, (void)names, (void)values;
    return (count == 0u) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SetString(
    fmi2Component c, const fmi2ValueReference names[], size_t count, const fmi2String values[])
{
    (void)c, (void)names, (void)values;
    return (count == 0u) ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c,
    const fmi2ValueReference names[], size_t count, const fmi2Integer order[],
    const fmi2Real values[])
{
    (void)c, (void)names, (void)count, (void)order, (void)values;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c,
    const fmi2ValueReference names[], size_t count, const fmi2Integer order[], fmi2Real values[])
{
    (void)c, (void)names, (void)count, (void)order, (void)values;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c,
    const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[],
    size_t knowns, const fmi2Real seed[], fmi2Real values[])
{
    (void)c, (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)seed, (void)values;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (*state == NULL) {
        *state = malloc(sizeof(Unit));
    }
    if (*state == NULL) {
        return fmi2Error;
    }
    memcpy(*state, c, sizeof(Unit));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(Unit));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(
    fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Unit);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(
    fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(Unit)) {
        return fmi2Error;
    }
    memcpy(bytes, state, sizeof(Unit));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(
    fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    (void)c;
    *state = (size == sizeof(Unit)) ? malloc(sizeof(Unit)) : NULL;
    if (*state == NULL) {
        return fmi2Error;
    }
    memcpy(*state, bytes, sizeof(Unit));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    (void)c;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, int kind, fmi2Status *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, int kind, fmi2Real *value)
{
    if (kind != 2) { /* the last time that succeeded */
        return fmi2Discard;
    }
    *value = ((const Unit *)c)->now;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, int kind, fmi2Integer *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, int kind, fmi2Boolean *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, int kind, fmi2String *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}
