#pragma once
/** @file
Break times of the functions of time that drive a model, its loads and motions.

    integrator.addBreakTimes(KnownTimes(model.getFile()));
    checkMotions(model.getFile(), 0, 2.5);  **/

#include <memory>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Times at which any of these functions changes course. They are found one stretch at a time, as
far as requested. Copies share the results; for one thread. **/
class KnownTimes {
public:
    explicit KnownTimes(const ModelValue& file);

    /** The first such time after `time`; infinity if none. **/
    double operator()(double time) const;

private:
    struct Stretch;
    std::shared_ptr<Stretch> m_stretch;
};

/** @throws ModelError if a motion or its speed jumps between these times. **/
void checkMotions(const ModelValue& file, double from, double to);

}  // namespace model
}  // namespace simflex
