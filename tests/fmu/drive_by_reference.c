/* drive_by_reference VERSION LIBRARY RESOURCES TOKEN INPUT OUTPUT STEPS: as drive_unit, by the importer of the standard's
   own reference, FMI 2.0 or 3.0; half way it goes back ten steps and does them again. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "FMI2.h"
#include "FMI3.h"

static void hear(FMIInstance* instance, FMIStatus status, const char* category, const char* message) {
    (void)instance;
    printf("%d, %s: %s\n", status, category, message);
}

static void require(FMIStatus status, const char* what) {
    if (status == FMIOK) return;
    printf("%s: status %d\n", what, status);
    exit(1);
}

int main(int argc, char** argv) {
    FMIInstance* unit;
    FMIValueReference input, output;
    double value = 0;
    void* kept = NULL;
    int isThird, steps, k, went = 0;
    if (argc != 8) return 2;
    isThird = atoi(argv[1]) == 3;
    input = (FMIValueReference)atoi(argv[5]);
    output = (FMIValueReference)atoi(argv[6]);
    steps = atoi(argv[7]);
    unit = FMICreateInstance("unit", hear, NULL);
    require(FMILoadPlatformBinary(unit, argv[2]), "load");
    if (isThird) {
        require(FMI3InstantiateCoSimulation(unit, argv[4], argv[3], false, true, false, false, NULL, 0, NULL),
                "instantiate");
        require(FMI3EnterInitializationMode(unit, false, 0, 0, false, 0), "enter");
        require(FMI3ExitInitializationMode(unit), "leave");
    } else {
        char uri[4096];
        snprintf(uri, sizeof uri, "file://%s", argv[3]);
        require(FMI2Instantiate(unit, uri, fmi2CoSimulation, argv[4], 0, 1), "instantiate");
        require(FMI2SetupExperiment(unit, 0, 0, 0, 0, 0), "setup");
        require(FMI2EnterInitializationMode(unit), "enter");
        require(FMI2ExitInitializationMode(unit), "leave");
    }
    for (k = 0; k < steps; ++k) {
        double now = 0.01 * k;
        value = k % 3 - 0.7;
        if (k == steps / 2 - 10 && !went)
            require(isThird ? FMI3GetFMUState(unit, &kept) : FMI2GetFMUstate(unit, &kept), "keep");
        if (k == steps / 2 && !went) {
            require(isThird ? FMI3SetFMUState(unit, kept) : FMI2SetFMUstate(unit, kept), "restore");
            require(isThird ? FMI3FreeFMUState(unit, &kept) : FMI2FreeFMUstate(unit, &kept), "free");
            k -= 11;
            went = 1;
            continue;
        }
        if (isThird) {
            bool needsEvent, isOver, isEarly;
            double reached;
            require(FMI3SetFloat64(unit, &input, 1, &value, 1), "set");
            require(FMI3DoStep(unit, now, 0.01, true, &needsEvent, &isOver, &isEarly, &reached), "step");
        } else {
            require(FMI2SetReal(unit, &input, 1, &value), "set");
            require(FMI2DoStep(unit, now, 0.01, 1), "step");
        }
    }
    require(isThird ? FMI3GetFloat64(unit, &output, 1, &value, 1) : FMI2GetReal(unit, &output, 1, &value), "get");
    printf("%a\n", value);
    require(isThird ? FMI3Terminate(unit) : FMI2Terminate(unit), "terminate");
    if (isThird)
        FMI3FreeInstance(unit);
    else
        FMI2FreeInstance(unit);
    FMIFreeInstance(unit);
    return 0;
}
