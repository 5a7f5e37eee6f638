/* An FMU (2.0, co-simulation) that says when its library is loaded, and does one of many wrongs after 0.05 s: the one that
   resources/fault.txt names. Until then it puts out -2 sin(angle) and a fraction of the sum of all angles. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct {
    double angle, torque, sum;
} State;
typedef struct {
    State state;
    char fault[20];
} Unit;

__attribute__((constructor)) static void leaveTrace(void) {
    FILE *file = fopen("library_was_loaded", "w");
    if (file) fclose(file);
}

static int has(const Unit *unit, const char *fault) {
    return strcmp(unit->fault, fault) == 0;
}

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources, const void *callbacks, int visible,
                      int logging) {
    char path[2000];
    Unit *unit = calloc(1, sizeof(Unit));
    (void)name, (void)kind, (void)guid, (void)callbacks, (void)visible, (void)logging;
    snprintf(path, sizeof path, "%s/fault.txt", resources + strlen("file://"));
    FILE *file = fopen(path, "r");
    if (file && fscanf(file, "%19s", unit->fault) != 1) unit->fault[0] = 0;
    if (file) fclose(file);
    return has(unit, "no_instance") ? NULL : unit;
}
void fmi2FreeInstance(void *unit) {
    free(unit);
}
int fmi2SetupExperiment(void *unit, int a, double b, double c, int d, double e) {
    return (void)unit, (void)a, (void)b, (void)c, (void)d, (void)e, 0;
}
int fmi2EnterInitializationMode(void *unit) {
    return has(unit, "no_start") ? 3 : 0;
}
int fmi2ExitInitializationMode(void *unit) {
    return (void)unit, 0;
}
int fmi2SetReal(void *unit, const unsigned *references, size_t count, const double *values) {
    (void)references;
    if (count > 0) ((Unit *)unit)->state.angle = values[0];
    return 0;
}
int fmi2GetReal(void *unit, const unsigned *references, size_t count, double *values) {
    (void)references;
    if (count > 0) values[0] = ((Unit *)unit)->state.torque;
    return 0;
}
int fmi2DoStep(void *given, double time, double length, int noPrevious) {
    Unit *const unit = given;
    State *const state = &unit->state;
    (void)noPrevious;
    state->sum += length * state->angle;
    state->torque = -2 * sin(state->angle) - 0.1 * state->sum;
    printf("an FMU's own words\n");
    if (time < 0.05) return 0;
    if (has(unit, "crash")) *(volatile int *)0 = 1;
    if (has(unit, "abort")) abort();
    if (has(unit, "exit")) exit(0);
    if (has(unit, "leave")) _exit(0);
    for (volatile int i = 0; has(unit, "loop");) (void)i;
    for (int i = 0; i < 100 && has(unit, "close"); ++i) close(i);
    if (has(unit, "nan")) state->torque = NAN;
    return has(unit, "discard") ? 2 : has(unit, "fail") ? 3 : has(unit, "fatal") ? 4 : 0;
}
int fmi2GetBooleanStatus(void *unit, int kind, int *value) {
    return (void)unit, (void)kind, *value = 0;
}
int fmi2GetFMUstate(void *unit, void **kept) {
    *kept = malloc(sizeof(State));
    memcpy(*kept, &((Unit *)unit)->state, sizeof(State));
    return 0;
}
int fmi2SetFMUstate(void *unit, void *kept) {
    memcpy(&((Unit *)unit)->state, kept, sizeof(State));
    return 0;
}
int fmi2FreeFMUstate(void *unit, void **kept) {
    (void)unit;
    free(*kept);
    *kept = NULL;
    return 0;
}
int fmi2SerializedFMUstateSize(void *unit, void *kept, size_t *size) {
    (void)unit, (void)kept;
    *size = sizeof(State);
    return 0;
}
int fmi2SerializeFMUstate(void *unit, void *kept, char *bytes, size_t size) {
    (void)unit;
    memcpy(bytes, kept, size);
    return 0;
}
int fmi2DeSerializeFMUstate(void *unit, const char *bytes, size_t size, void **kept) {
    (void)unit;
    *kept = malloc(size);
    memcpy(*kept, bytes, size);
    return 0;
}
