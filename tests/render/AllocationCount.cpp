#include "AllocationCount.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<long> numAllocations{0};

}  // namespace

void* operator new(std::size_t size) {
    ++numAllocations;
    if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
    throw std::bad_alloc();
}

void operator delete(void* memory) noexcept {
    std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}

namespace simflex {
namespace test {

long getNumAllocations() {
    return numAllocations;
}

}  // namespace test
}  // namespace simflex
