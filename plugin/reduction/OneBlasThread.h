#pragma once
/** @file
One thread for OpenBLAS. Internal to reduction. **/

#include <dlfcn.h>

namespace simflex {

/** Keeps OpenBLAS, if that is the BLAS, to one thread while this lives: solves with one vector are
bound by memory, and its waiting threads made them 1.2 to 4 times slower. **/
class OneBlasThread {
public:
    OneBlasThread() : m_set(find<void (*)(int)>("openblas_set_num_threads")) {
        const auto get = find<int (*)()>("openblas_get_num_threads");
        if (!m_set || !get) return;
        m_before = get();
        m_set(1);
    }
    ~OneBlasThread() {
        if (m_before > 0) m_set(m_before);
    }
    OneBlasThread(const OneBlasThread&) = delete;
    OneBlasThread& operator=(const OneBlasThread&) = delete;

private:
    template <class Function>
    static Function find(const char* name) {
        return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
    }

    void (*m_set)(int);
    int m_before = 0;
};

}  // namespace simflex
