#pragma once
/** @file
One thread for OpenBLAS. Internal to reduction. **/

#include <dlfcn.h>

namespace simflex {

/** Keeps OpenBLAS, if that is the BLAS, to one thread while this lives: solves with one vector are
bound by memory, and its waiting threads made them 1.2 to 4 times slower. **/
class OneBlasThread {
public:
    OneBlasThread() : _set(find<void (*)(int)>("openblas_set_num_threads")) {
        const auto get = find<int (*)()>("openblas_get_num_threads");
        if (!_set || !get) return;
        _before = get();
        _set(1);
    }
    ~OneBlasThread() {
        if (_before > 0) _set(_before);
    }
    OneBlasThread(const OneBlasThread&) = delete;
    OneBlasThread& operator=(const OneBlasThread&) = delete;

private:
    template <class Function>
    static Function find(const char* name) {
        return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
    }

    void (*_set)(int);
    int _before = 0;
};

}  // namespace simflex
