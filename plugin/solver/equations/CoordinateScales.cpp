#include "simflex/solver/equations/CoordinateScales.h"

#include <algorithm>
#include <cmath>

#include "simflex/solver/equations/Blocks.h"

namespace simflex {

CoordinateScales::CoordinateScales(const Blocks& blocks)
    : metres(size_t(blocks.numU())), step(size_t(blocks.numU())), rate(size_t(blocks.numU())) {
    const int numFlexible = int(blocks.flexible.size());
    double largestPart = 0;
    for (int b = 0; b < int(blocks.all.size()); ++b) {
        const Block& block = *blocks.all[size_t(b)];
        std::vector<double> unit(size_t(block.numU), 0);
        double largest = 0;
        block.getDisplacements(metres.data() + block.firstU);
        for (int i = 0; i < block.numU; ++i) {
            const double displacement = metres[size_t(block.firstU + i)];
            unit[size_t(i)] = 1;
            const double duration = block.calcUDisplacement(unit.data(), 1) / displacement;
            unit[size_t(i)] = 0;
            rate[size_t(block.firstU + i)] = std::isfinite(duration) ? 1 / duration : 1;
            if (b >= numFlexible || i < 3) largest = std::max(largest, displacement);
        }
        lengths.push_back(largest);
        for (const FrameMotion& frame : block.frames)
            originDistance = std::max(originDistance, double(frame.X.p().norm()));
        if (b < numFlexible) largestPart = std::max(largestPart, largest);
    }
    const double size = lengths.empty() ? 0 : *std::max_element(lengths.begin(), lengths.end());
    originDistance = size > 0 && std::isfinite(originDistance) ? originDistance / size : 0;
    for (int b = 0; b < int(blocks.all.size()); ++b) {
        const Block& block = *blocks.all[size_t(b)];
        const bool isRigid = b >= numFlexible;
        const double length = isRigid ? (largestPart > 0 ? largestPart : 1.0) : lengths[size_t(b)];
        for (int i = block.firstU; i < block.firstU + block.numU; ++i) {
            const double h = StepFraction * length / std::max(metres[size_t(i)], 1e-12);
            step[size_t(i)] = isRigid ? std::min(StepFraction, h) : h;
        }
    }
}

}  // namespace simflex
