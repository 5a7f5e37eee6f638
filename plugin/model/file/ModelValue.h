#pragma once
/** @file
A value of a model file that was read and checked against the schema, with the place where it
stands. A cheap handle: copies refer to the same file.

    const ModelValue joint = model.get("joints").get("bearing");
    const std::string type = joint.get("type").getText();
    const SimTK::Vec3 axis = joint.get("axis").getVec3();
    if (axis.norm() == 0) joint.get("axis").fail("the axis has no direction");

A key that the file leaves out gives a value that is not isGiven() and has the schema's default. **/

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

    /** @name Maps; of anything else they are empty. **/
    /**@{**/
    bool has(const std::string& key) const;
    /** @throws std::logic_error if the schema has no such key here. **/
    ModelValue get(const std::string& key) const;
    /** In the file's order. **/
    std::vector<std::string> getKeys() const;
    /**@}**/

    /** @name Lists; a scalar counts as a list of one. **/
    /**@{**/
    int getSize() const;
    ModelValue at(int index) const;
    /**@}**/

    /** @name Contents
    All throw ModelError for what is of another kind. Numbers are constant expressions. **/
    /**@{**/
    double getNumber() const;
    int getInteger() const;
    bool getBool() const;
    std::string getText() const;
    std::vector<double> getNumbers() const;
    std::vector<std::string> getTexts() const;
    SimTK::Vec3 getVec3() const;
    /** A function of time; fails for a law that names quantities. **/
    Expression getExpression() const;
    /** True if it is a law that names quantities of the motion. **/
    bool isLaw() const;
    /** One for each item of a list. **/
    std::vector<Expression> getExpressions() const;
    /**@}**/

    /** A text as the path of a file: relative ones begin at the model file's folder. **/
    std::string getFilePath() const;

    /** "joints.bearing.axis". **/
    std::string getPath() const;
    /** Last part of the path: the name of a body, joint … **/
    std::string getName() const;
    /** "crank.yaml:12:9"; of a missing value that of the map which lacks it. **/
    std::string getPlace() const;

    /** All scalars in here that nobody has asked for: they have no effect. **/
    std::vector<ModelValue> findUnread() const;
    /** @throws ModelError that names them all if there are any. **/
    void checkRead() const;

    /** @throws ModelError "PLACE: PATH: message". **/
    [[noreturn]] void fail(const std::string& message) const;
    /** The same for a name that is not among those there are: proposes the nearest, or lists them
    all if they are few. `what`: "body", "joint" … **/
    [[noreturn]] void failUnknown(const std::string& what, const std::string& name,
                                  const std::vector<std::string>& known) const;

    struct Node;  ///< what the reader made
    explicit ModelValue(std::shared_ptr<const Node> node);
    const Node& getNode() const { return *m_node; }

private:
    std::shared_ptr<const Node> m_node;
};

/** A constant as typed by a user (`30*deg`, `L/2`), with the parameters of `model`.
@throws std::invalid_argument. **/
double calcConstant(const ModelValue& model, const std::string& text);

}  // namespace model
}  // namespace simflex
