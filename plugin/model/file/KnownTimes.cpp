#include "simflex/model/file/KnownTimes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "simflex/base/NumberText.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/file/VariableFormula.h"

namespace simflex {
namespace model {

namespace {

const double Never = std::numeric_limits<double>::infinity();
/** Length of the first stretch [s]; nothing is searched once stretches are longer than the largest.
 **/
const double FirstLength = 1e-3, LargestLength = 1e12;
/** Stretches with fewer times than this double in length. **/
const std::size_t FewTimes = 1000;
/** Relative tolerance for locating the end of a function's domain. **/
const double Shortest = 1e-9;

/** Visits the functions in a value and below it. **/
void visitFunctions(const ModelValue& value,
                    const std::function<void(const ModelValue& function)>& visit) {
    if (value.isMap())
        for (const std::string& key : value.getKeys()) visitFunctions(value.get(key), visit);
    if (value.isList())
        for (int i = 0; i < value.getSize(); ++i) visitFunctions(value.at(i), visit);
    if (value.isScalar() && value.getNode().form->kind == SchemaForm::Kind::Function) visit(value);
}

using Search = std::function<std::vector<double>(double from, double to)>;

}  // namespace

struct KnownTimes::Stretch {
    std::vector<Search> functions;
    double from = Never, to = -Never, length = FirstLength;
    std::vector<double> times;  ///< in (from, to], increasing

    void look(double begin) {
        from = begin;
        to = begin + length;
        while (!lookWithin()) {
            if (to - from < Shortest * std::max(1.0, std::abs(from))) {
                times = {to};
                return;
            }
            to = from + (to - from) / 2;
        }
        std::sort(times.begin(), times.end());
        if (times.size() < FewTimes) length *= 2;
    }

    /** @returns false if a function has no value somewhere in (from, to], an error that the run
    reports if it gets there. **/
    bool lookWithin() {
        times.clear();
        try {
            for (const Search& search : functions) {
                const std::vector<double> found = search(from, to);
                times.insert(times.end(), found.begin(), found.end());
            }
        } catch (const std::exception&) {
            return false;
        }
        return true;
    }
};

KnownTimes::KnownTimes(const ModelValue& file) : m_stretch(std::make_shared<Stretch>()) {
    const auto add = [&](const ModelValue& value) {
        const auto find = [](const auto& function) {
            return [function](double from, double to) { return function.findSwitches(from, to); };
        };
        if (value.isLaw())
            m_stretch->functions.push_back(find(VariableFormula(value)));
        else if (!value.getExpression().isConstant())
            m_stretch->functions.push_back(find(value.getExpression()));
    };
    for (const char* key : {"loads", "motions", "connectors", "states", "controllers", "events"})
        visitFunctions(file.get(key), add);
}

double KnownTimes::operator()(double time) const {
    Stretch& stretch = *m_stretch;
    if (stretch.functions.empty()) return Never;
    if (!(time >= stretch.from && time < stretch.to)) stretch.look(time);
    for (;;) {
        const auto next = std::upper_bound(stretch.times.begin(), stretch.times.end(), time);
        if (next != stretch.times.end()) return *next;
        if (stretch.length > LargestLength) return Never;
        stretch.look(stretch.to);
    }
}

void checkMotions(const ModelValue& file, double from, double to) {
    visitFunctions(file.get("motions"), [&](const ModelValue& motion) {
        const std::optional<Expression::Kink> kink = motion.getExpression().findKink(from, to);
        if (!kink) return;
        const std::string time = " at t = " + writeGeneral(kink->time, 6);
        const std::string change =
            " from " + writeGeneral(kink->before, 6) + " to " + writeGeneral(kink->after, 6);
        motion.fail(kink->order == 0
                        ? "the motion jumps" + time + change +
                              ", which no finite force can do; step(t, t0, y0, t1, y1) goes "
                              "from one value to another"
                        : "the motion's speed jumps" + time + change +
                              ", which asks for infinite force; let it change over a while: "
                              "step(t, t0, y0, t1, y1), a spline through a table's points");
    });
}

}  // namespace model
}  // namespace simflex
