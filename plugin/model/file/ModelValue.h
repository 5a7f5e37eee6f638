#pragma once
/** @file
A value of a model file that was read and checked against the schema, with its place in the file. A
cheap handle: copies refer to the same file.

    const ModelValue joint = model.get("joints").get("bearing");
    const std::string type = joint.get("type").getText();
    const SimTK::Vec3 axis = joint.get("axis").getVec3();
    if (axis.norm() == 0) joint.get("axis").fail("the axis has no direction");

A key missing from the file returns a value that is not isGiven() and has the schema's default. **/

#include <memory>
#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/model/file/Expression.h"
#include "simflex/model/file/ModelError.h"

namespace simflex {
namespace model {

class ModelValue {
public:
    enum class Kind { Missing, Scalar, List, Map };

    Kind getKind() const;
    bool isGiven() const { return getKind() != Kind::Missing; }
    bool isList() const { return getKind() == Kind::List; }
    bool isMap() const { return getKind() == Kind::Map; }
    bool isScalar() const { return getKind() == Kind::Scalar; }

    /** @name Maps; all other values act as empty maps. **/
    /**@{**/
    bool has(const std::string& key) const;
    /** @throws std::logic_error if the schema has no such key here. **/
    ModelValue get(const std::string& key) const;
    /** In the file's order. **/
    std::vector<std::string> getKeys() const;
    /**@}**/

    /** @name Lists; a scalar acts as a list of one. **/
    /**@{**/
    int getSize() const;
    ModelValue at(int index) const;
    /**@}**/

    /** @name Contents
    All throw ModelError for a value of another kind. Numbers are constant expressions. **/
    /**@{**/
    double getNumber() const;
    int getInteger() const;
    bool getBool() const;
    std::string getText() const;
    std::vector<double> getNumbers() const;
    std::vector<std::string> getTexts() const;
    SimTK::Vec3 getVec3() const;
    /** A function of time.
    @throws ModelError for a law that names quantities. **/
    Expression getExpression() const;
    /** True for a law that names quantities of the motion. **/
    bool isLaw() const;
    std::vector<Expression> getExpressions() const;
    /**@}**/

    /** A text as a file path; relative paths start at the model file's folder. **/
    std::string getFilePath() const;

    /** "joints.bearing.axis". **/
    std::string getPath() const;
    /** Last part of the path: the name of a body, joint … **/
    std::string getName() const;
    /** "crank.yaml:12:9"; for a missing value the place of the map that lacks it. **/
    std::string getPlace() const;

    /** All scalars below this value that were never used and so have no effect. **/
    std::vector<ModelValue> findUnread() const;
    /** @throws ModelError naming all unused scalars, if there are any. **/
    void checkRead() const;

    /** @throws ModelError "PLACE: PATH: message". **/
    [[noreturn]] void fail(const std::string& message) const;
    /** The same for an unknown name: suggests the nearest of the known names, or lists them all if
    there are few. `what`: "body", "joint" … **/
    [[noreturn]] void failUnknown(const std::string& what, const std::string& name,
                                  const std::vector<std::string>& known) const;

    struct Node;  ///< data made by the reader
    explicit ModelValue(std::shared_ptr<const Node> node);
    const Node& getNode() const { return *m_node; }

private:
    std::shared_ptr<const Node> m_node;
};

/** Evaluates a constant typed by a user (`30*deg`, `L/2`), with the parameters of `model`.
@throws std::invalid_argument. **/
double calcConstant(const ModelValue& model, const std::string& text);

}  // namespace model
}  // namespace simflex
