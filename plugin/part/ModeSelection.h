#pragma once
/** @file
Parts with a subset of their modes.

Removing a mode is equivalent to holding its coordinate and speed at zero. Mass properties and the
other modes' frequencies, shapes, invariants and geometric stiffening are unchanged. Bodies of the
smaller part cost less, and the part on file need not be reduced again.

    auto crank = std::make_shared<const ReducedBody>(
        selectModesInBand(readReducedBody("crank.h5"), 0, 2000));

The compliance of removed modes is lost: joints and loads see a stiffer part. The highest modes of a
part carry the static deflection of its interfaces. For a small part that is accurate under load,
reduce with fewer normal modes instead (`simflex reduce --modes`).

Modes are counted from 0 in ascending frequency, as FlexibleBody's modal coordinates are. To switch
a whole body at run time see FlexibleBody::setRigid(). **/

#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** Returns the part with the listed modes, in ascending order for any order of the list. An empty
list gives a rigid part.
@throws std::invalid_argument naming the part and its number of modes if a mode does not exist or is
listed twice. **/
ReducedBody selectModes(ReducedBody part, std::vector<int> modes);

/** Returns the part with its `count` lowest modes.
@throws std::invalid_argument if it has fewer, or for a negative count. **/
ReducedBody selectLowestModes(ReducedBody part, int count);

/** Returns the part with its modes at frequencies from `from` to `to` [Hz], inclusive.
@throws std::invalid_argument naming the part, the band and the part's own range of frequencies if
the band contains no mode. **/
ReducedBody selectModesInBand(ReducedBody part, double from, double to);

/** Returns the modes at frequencies from `from` to `to` [Hz], inclusive; ascending. **/
std::vector<int> findModesInBand(const ReducedBody& part, double from, double to);

}  // namespace simflex
