#pragma once
/** @file
Parts with some of their modes.

A mode that is left out is one whose coordinate and speed stay zero: mass properties, the other
modes' frequencies, shapes and invariants, and geometric stiffening among them, are the full part's.
Bodies of the smaller part cost less; the part on file need not be reduced anew.

    auto crank = std::make_shared<const ReducedBody>(
        selectModesInBand(readReducedBody("crank.h5"), 0, 2000));

Whatever the modes left out would have given way is lost: joints and loads then find a stiffer part.
The highest modes of a part carry the static deflection of its interfaces; for a small part that is
right under load, reduce with fewer normal modes instead (`simflex reduce --modes`).

Modes are counted from 0 in ascending frequency, as in FlexibleBody's modal coordinates. To switch a
whole body at run time see FlexibleBody::setRigid(). **/

#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** The part with the listed modes, in ascending order whatever the order of the list. None at all
makes a rigid part.
@throws std::invalid_argument that names the part and its number of modes if a mode does not exist
    or is listed twice. **/
ReducedBody selectModes(ReducedBody part, std::vector<int> modes);

/** The part with its `count` lowest modes.
@throws std::invalid_argument if it has fewer, or for a negative count. **/
ReducedBody selectLowestModes(ReducedBody part, int count);

/** The part with its modes of frequencies from `from` to `to` [Hz], both included.
@throws std::invalid_argument that names the part, the band and the part's own range of frequencies
    if no mode is in it. **/
ReducedBody selectModesInBand(ReducedBody part, double from, double to);

/** The modes of frequencies from `from` to `to` [Hz], both included; ascending. **/
std::vector<int> findModesInBand(const ReducedBody& part, double from, double to);

}  // namespace simflex
