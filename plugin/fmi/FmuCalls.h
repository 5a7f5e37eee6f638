#pragma once
/** @file
Calls and replies of an FMU instance, in this process or another: FmuLibrary and FmuProcess
implement the same calls. Internal. **/

#include <cstdint>
#include <string>
#include <vector>

#include "simflex/base/Archive.h"

namespace simflex {

/** A library and the instance to create. **/
struct FmuInstanceSetup {
    int version = 2;  ///< FMI version: 2 or 3
    std::string library, resources, token, name;

    void visit(Archive& archive) { archive.visit(version, library, resources, token, name); }
};

struct FmuCall {
    enum Kind {
        EnterInitialization,
        ExitInitialization,
        Reset,
        SetReal,
        SetInteger,
        SetBoolean,
        GetReal,
        GetInteger,
        GetBoolean,
        DoStep,
        Save,
        Restore,
        NumKinds
    };
    int kind = Reset;
    std::string what;  ///< for messages: "a step"
    std::uint32_t reference = 0;
    double value = 0;        ///< of a variable; DoStep and EnterInitialization: the time [s]
    double length = 0;       ///< of DoStep [s]
    std::string bytes = {};  ///< of Restore

    void visit(Archive& archive) {
        archive.visitWithin(kind, 0, NumKinds - 1, "the kind of a call");
        archive.visit(what, reference, value, length, bytes);
    }
};

struct FmuAnswer {
    double value = 0;   ///< of a variable; DoStep: 0 if the unit requests the end of the simulation
    std::string bytes;  ///< of Save

    void visit(Archive& archive) { archive.visit(value, bytes); }
};

/** Replies to calls in order, up to the first that failed or ended the simulation. **/
struct FmuReply {
    std::vector<FmuAnswer> answers;
    std::string error;   ///< "a step has failed: no convergence"; empty: none
    double seconds = 0;  ///< spent in the library

    void visit(Archive& archive);
};

class FmuInstanceCalls {
public:
    virtual ~FmuInstanceCalls() = default;
    /** @throws Cancelled if the user cancels the call. **/
    virtual FmuReply ask(const std::vector<FmuCall>& calls) = 0;
};

/** Visits items in the format of a frame. **/
template <class Item>
void visitItems(Archive& archive, std::vector<Item>& items) {
    items.resize(archive.visitSize(items.size(), sizeof(std::uint64_t)));
    for (Item& item : items) item.visit(archive);
}

inline void FmuReply::visit(Archive& archive) {
    visitItems(archive, answers);
    archive.visit(error, seconds);
}

}  // namespace simflex
