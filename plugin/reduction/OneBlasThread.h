#pragma once
/** @file
Restricts OpenBLAS to one thread. Internal to reduction. **/

#include <dlfcn.h>

#include <mutex>

namespace simflex {

/** Restricts OpenBLAS, if it is in use, to one thread while any object of this class exists: its
sums depend on the number of its threads. **/
class OneBlasThread {
public:
    OneBlasThread() { count(1); }
    ~OneBlasThread() { count(-1); }
    OneBlasThread(const OneBlasThread&) = delete;
    OneBlasThread& operator=(const OneBlasThread&) = delete;

private:
    static void count(int step) {
        static std::mutex mutex;
        static int number = 0, before = 0;
        const auto get = find<int (*)()>("openblas_get_num_threads");
        const auto set = find<void (*)(int)>("openblas_set_num_threads");
        if (!get || !set) return;
        const std::lock_guard<std::mutex> lock(mutex);
        if (number == 0) before = get();
        number += step;
        set(number == 0 ? before : 1);
    }

    template <class Function>
    static Function find(const char* name) {
        return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
    }
};

}  // namespace simflex
