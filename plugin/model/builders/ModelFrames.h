#pragma once
/** @file
The frames of a model file: `ground`, `BODY`, `BODY.INTERFACE`, names under `frames`, and maps. A
body's own coordinates D are those of its part (deck) for a flexible body, and its body frame for a
rigid body. **/

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "simflex/model/builders/ModelSystem.h"

namespace simflex {
namespace model {

/** A frame on a body, one of its interfaces or nodes. **/
struct FrameOnBody {
    static constexpr int Ground = -1;
    int body = Ground;        ///< index in the file's order
    std::string interface;    ///< of a flexible body; may be empty
    std::optional<int> node;  ///< of a flexible body
    SimTK::Transform X_base;  ///< of the frame in the interface, node or coordinates D

    /** The frame displaced by X. **/
    FrameOnBody moved(const SimTK::Transform& X) const;
};

class ModelFrames {
public:
    /** Reads only names; frames are resolved on first use. **/
    ModelFrames(const ModelValue& file, const Parts& parts);

    const std::vector<std::string>& getBodyNames() const { return m_names; }
    /** Null for a rigid body. **/
    const ReducedBody* getPart(int body) const { return m_parts[size_t(body)].get(); }
    /** @throws ModelError. **/
    int findBody(const ModelValue& name) const;

    /** @param own  a body whose interfaces may be named without it; −2: none
    @throws ModelError. **/
    FrameOnBody find(const ModelValue& frame, int own = NoBody) const;
    /** @param fail  called with an unknown name and the known ones; must throw. **/
    using Unknown = std::function<void(const std::string& what, const std::string& name,
                                       const std::vector<std::string>& known)>;
    FrameOnBody find(const std::string& name, const Unknown& fail, int own = NoBody) const;

    /** Pose in the body's own coordinates D (in Ground for Ground), undeformed. **/
    SimTK::Transform calcPose(const FrameOnBody& frame) const;
    /** Pose of frame B in D; the origin is the centre of mass of a flexible part. **/
    SimTK::Transform calcBodyFrame(int body) const;

    Attachment attach(const FrameOnBody& frame, const ModelSystem& system) const;
    /** "ground", "crank", "crank.shaft" or "crank node 12". **/
    std::string describe(const FrameOnBody& frame) const;

    static constexpr int NoBody = -2;

private:
    /** Adds an entry of `frames` to m_resolved, and those that it is on. **/
    void resolve(const std::string& frame) const;
    FrameOnBody findMap(const ModelValue& frame, int own) const;
    std::vector<std::string> listKnown(int own) const;

    ModelValue m_file;
    std::vector<std::string> m_names;
    std::map<std::string, int> m_numbers;  ///< of bodies, by name
    std::vector<std::shared_ptr<const ReducedBody>> m_parts;
    mutable std::map<std::string, FrameOnBody> m_resolved;
};

}  // namespace model
}  // namespace simflex
