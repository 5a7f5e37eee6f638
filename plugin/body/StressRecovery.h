#pragma once
/** @file
Stress, strain and motion of the nodes of a flexible body, from its modal coordinates:

    σ = S ξ,   ε = E ξ,   u = Φ ξ

with the stress of each mode that the part was reduced with (`simflex reduce --stress`, see
ReducedBody::ModalStress). Linear in ξ, and as exact as the modes are: loads on interfaces are
carried exactly in statics, loads elsewhere as well as the modes describe them.

    StressRecovery skin(crank);                  // all nodes with stress
    Array_<SymMat33> stress;
    skin.calcStress(state, stress);              // in the body's frame B
    StressRecovery fillet(crank, {118, 119});    // by their numbers in the deck
    Vector vonMises;
    fillet.calcVonMises(state, vonMises);

One is a workspace: each thread needs its own. Calls allocate nothing once their results have the
right size. O(nodes·n_f), in parallel for many nodes; the same bits for any number of threads. **/

#include <vector>

#include "simflex/body/FlexibleBody.h"

namespace simflex {

/** √(3/2 s:s) of the deviator s. **/
SimTK::Real calcVonMises(const SimTK::SymMat33& stress);
/** The same with the sign of the principal value that is largest in size, so that a cycle of
tension and compression is one. **/
SimTK::Real calcSignedVonMises(const SimTK::SymMat33& stress);
/** Principal values, largest first. **/
SimTK::Vec3 calcPrincipalValues(const SimTK::SymMat33& tensor);

class StressRecovery {
public:
    /** The axes in which tensors are expressed: those of the body's frame B (the deck's), or of
    Ground. **/
    enum class Axes { Body, Ground };

    /** At all nodes with stress; all nodes of the mesh if the part has none. **/
    explicit StressRecovery(const FlexibleBody& body);
    /** At the nodes with these numbers in the deck, in this order. Those without stress are
    allowed as long as only displacements are asked for.
    @throws std::out_of_range naming the body and a number that its mesh does not have. **/
    StressRecovery(const FlexibleBody& body, const std::vector<int>& nodeNumbers);
    /** At all nodes of the mesh. **/
    static StressRecovery atAllNodes(const FlexibleBody& body);

    const FlexibleBody& getBody() const { return m_body; }
    int getNumNodes() const { return int(m_nodes.size()); }
    int getNodeNumber(int k) const;
    /** Undeformed position in the deck's coordinates [m]. **/
    SimTK::Vec3 getNodePosition(int k) const;

    /** Nothing if there is stress at every node.
    @throws std::invalid_argument if the part was reduced without stress, or a node is none of those
        it was asked for: names both and says what to do. **/
    void checkStress() const;

    /** @name Stress and strain, one entry a node. Stage::Model; in Ground's axes Stage::Position.
    @throws as checkStress(). **/
    /**@{**/
    /** Cauchy stress [Pa]. **/
    void calcStress(const SimTK::State& state, SimTK::Array_<SimTK::SymMat33>& stress,
                    Axes axes = Axes::Body);
    /** Small strain (the tensor's shear, half the engineer's). **/
    void calcStrain(const SimTK::State& state, SimTK::Array_<SimTK::SymMat33>& strain,
                    Axes axes = Axes::Body);
    void calcVonMises(const SimTK::State& state, SimTK::Vector& vonMises);  ///< [Pa]
    /** Principal stresses, largest first [Pa]. **/
    void calcPrincipalStress(const SimTK::State& state, SimTK::Array_<SimTK::Vec3>& principal);
    /**@}**/

    /** @name Motion, one entry a node; of first order in ξ **/
    /**@{**/
    /** Φξ in B [m]. Stage::Model. **/
    void calcDisplacement(const SimTK::State& state, SimTK::Array_<SimTK::Vec3>& u_B);
    /** Location in Ground [m]. Stage::Position. **/
    void calcLocation(const SimTK::State& state, SimTK::Array_<SimTK::Vec3>& p_G);
    /** Velocity in Ground [m/s]. Stage::Velocity. **/
    void calcVelocity(const SimTK::State& state, SimTK::Array_<SimTK::Vec3>& v_G);
    /**@}**/

private:
    StressRecovery(const FlexibleBody& body, std::vector<int> nodes, std::nullptr_t);

    void takeModalCoordinates(const SimTK::State& state);
    void calcTensors(const SimTK::State& state, const std::vector<float>& modes);
    void calcTensors(const SimTK::State& state, const std::vector<float>& modes,
                     SimTK::Array_<SimTK::SymMat33>& tensors, Axes axes);
    void calcDisplacements();

    FlexibleBody m_body;
    std::vector<int> m_nodes;  ///< mesh indices
    std::vector<int> m_rows;   ///< place of each in the modal stress, −1: none
    std::vector<double> m_xi, m_values;
};

}  // namespace simflex
