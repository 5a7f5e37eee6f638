/** @file
Preloaded into one of several processes: the PETSc or SLEPc function named by $FAILS_IN fails there,
as if out of memory. **/

#include <dlfcn.h>

#include <cstdlib>
#include <cstring>

namespace {

constexpr int OutOfMemory = 55;  // PETSC_ERR_MEM

template <class... Pointers>
int call(const char* name, Pointers... pointers) {
    const char* failing = std::getenv("FAILS_IN");
    if (failing && std::strcmp(failing, name) == 0) return OutOfMemory;
    return reinterpret_cast<int (*)(Pointers...)>(dlsym(RTLD_NEXT, name))(pointers...);
}

}  // namespace

extern "C" {
int MatCholeskyFactorNumeric(void* factor, void* matrix, void* info) {
    return call("MatCholeskyFactorNumeric", factor, matrix, info);
}
int MatSolve(void* factor, void* b, void* x) {
    return call("MatSolve", factor, b, x);
}
int EPSSolve(void* eps) {
    return call("EPSSolve", eps);
}
}
