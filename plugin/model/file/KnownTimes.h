#pragma once
/** @file
Times that follow from the functions of time that drive a model, its loads and motions.

    integrator.addBreakTimes(KnownTimes(model.getFile()));
    checkMotions(model.getFile(), 0, 2.5); **/

#include <memory>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** Where any of these functions changes its course: looked for a stretch at a time, as far as is
asked for. Copies share what was found; for one thread. **/
class KnownTimes {
public:
    explicit KnownTimes(const ModelValue& file);

    /** The first one after a time; infinity: none. **/
    double operator()(double time) const;

private:
    struct Stretch;
    std::shared_ptr<Stretch> m_stretch;
};

/** @throws ModelError if a motion jumps, or its speed does, between these times. **/
void checkMotions(const ModelValue& file, double from, double to);

}  // namespace model
}  // namespace simflex
