#include "support/HeapUse.h"

#include <malloc.h>

namespace simflex {
namespace testing {

std::size_t getHeapUse() {
    const struct mallinfo2 heap = mallinfo2();
    return heap.uordblks + heap.hblkhd;
}

}  // namespace testing
}  // namespace simflex
