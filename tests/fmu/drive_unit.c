/* drive_unit LIBRARY RESOURCES TOKEN INPUT OUTPUT STEPS [OTHER...]: a program that knows nothing of simflex moves a unit of FMI 2.0
   through as many steps of 10 ms, with the input k % 3 - 0.7, in two instances at once, and prints the output at the end
   of both, in hexadecimal digits, and the libraries that it has loaded. Of other outputs it prints the derivatives by 2 times
   the input, asked for before the last step. */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct callbacks {
    void (*logger)(void*, const char*, int, const char*, const char*, ...);
    void* (*allocate)(size_t, size_t);
    void (*release)(void*);
    void (*finished)(void*, int);
    void* environment;
};

static void hear(void* environment, const char* instance, int status, const char* category, const char* format, ...) {
    va_list arguments;
    (void)environment;
    va_start(arguments, format);
    printf("%s, %d, %s: ", instance, status, category);
    vprintf(format, arguments);
    printf("\n");
    va_end(arguments);
}

static void* find(void* library, const char* name) {
    void* symbol = dlsym(library, name);
    if (!symbol) {
        printf("no %s\n", name);
        exit(1);
    }
    return symbol;
}

static void require(int status, const char* what) {
    if (status == 0) return;
    printf("%s: status %d\n", what, status);
    exit(1);
}

int main(int argc, char** argv) {
    const struct callbacks callbacks = {hear, calloc, free, NULL, NULL};
    void *library, *units[2];
    char uri[4096], line[4096];
    unsigned input, output;
    FILE* maps;
    int i, k;
    if (argc < 7) return 2;
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        printf("%s\n", dlerror());
        return 1;
    }
    snprintf(uri, sizeof uri, "file://%s", argv[2]);
    input = (unsigned)atoi(argv[4]);
    output = (unsigned)atoi(argv[5]);
    for (i = 0; i < 2; ++i) {
        void* (*instantiate)(const char*, int, const char*, const char*, const struct callbacks*, int, int);
        int (*setup)(void*, int, double, double, int, double), (*enter)(void*), (*leave)(void*);
        *(void**)&instantiate = find(library, "fmi2Instantiate");
        *(void**)&setup = find(library, "fmi2SetupExperiment");
        *(void**)&enter = find(library, "fmi2EnterInitializationMode");
        *(void**)&leave = find(library, "fmi2ExitInitializationMode");
        units[i] = instantiate("unit", 1, argv[3], uri, &callbacks, 0, 1);
        if (!units[i]) return 1;
        require(setup(units[i], 0, 0, 0, 0, 0), "setup");
        require(enter(units[i]), "enter");
        require(leave(units[i]), "leave");
    }
    for (k = 0; k < atoi(argv[6]); ++k)
        for (i = 0; i < 2; ++i) {
            const double two = 2;
            const double value = k % 3 - 0.7;
            int (*set)(void*, const unsigned*, size_t, const double*), (*step)(void*, double, double, int);
            int other, (*derive)(void*, const unsigned*, size_t, const unsigned*, size_t, const double*, double*);
            *(void**)&derive = find(library, "fmi2GetDirectionalDerivative");
            *(void**)&set = find(library, "fmi2SetReal");
            *(void**)&step = find(library, "fmi2DoStep");
            require(set(units[i], &input, 1, &value), "set");
            for (other = 7; other < argc && i == 0 && k == atoi(argv[6]) - 1; ++other) {
                const unsigned reference = (unsigned)atoi(argv[other]);
                double derivative = 0;
                require(derive(units[i], &reference, 1, &input, 1, &two, &derivative), "derive");
                printf("%.9f\n", derivative);
            }
            require(step(units[i], 0.01 * k, 0.01, 1), "step");
        }
    for (i = 0; i < 2; ++i) {
        double value = 0;
        int (*get)(void*, const unsigned*, size_t, double*);
        void (*release)(void*);
        *(void**)&get = find(library, "fmi2GetReal");
        *(void**)&release = find(library, "fmi2FreeInstance");
        require(get(units[i], &output, 1, &value), "get");
        printf("%a\n", value);
        release(units[i]);
    }
    maps = fopen("/proc/self/maps", "r");
    while (maps && fgets(line, sizeof line, maps)) {
        const char* path = strchr(line, '/');
        if (path && strstr(path, ".so")) printf("loaded %s", path);
    }
    dlclose(library);
    return 0;
}
