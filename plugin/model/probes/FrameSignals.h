#pragma once
/** @file
Signals of probes of how frames move (private header): laws, records and linear outputs share them.
**/

#include <string>
#include <vector>

#include "simflex/forces/Signal.h"
#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** A kind of probe of one frame whose columns x, y, z are signals. **/
struct FrameSignalKind {
    const char* key;
    const char* unit;
    Signal (*make)(const Attachment& F, const Attachment& M, SimTK::CoordinateAxis axis);
};
/** Kind of a probe's entry; null: none of these. **/
const FrameSignalKind* findFrameSignalKind(const ModelValue& entry);
/** Of M as seen from F, in F's axes: x, y and z, or the one number that `component` of the entry
chooses. **/
std::vector<Signal> makeFrameSignals(const FrameSignalKind& kind, const ModelValue& entry,
                                     const Attachment& F, const Attachment& M);

/** The same for two points. **/
struct DistanceSignalKind {
    const char* key;
    const char* unit;
    Signal (*make)(const Attachment& from, const Attachment& to);
};
const DistanceSignalKind* findDistanceSignalKind(const ModelValue& entry);

}  // namespace model
}  // namespace simflex
