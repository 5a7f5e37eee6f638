#pragma once
/** @file
Stress, strain and motion at the nodes of a flexible body, from its modal coordinates:

    σ = S ξ,   ε = E ξ,   u = Φ ξ

S is the modal stress computed by the reduction (`simflex reduce --stress`, see
ReducedBody::ModalStress). The result is linear in ξ and as accurate as the modes: exact in statics
for loads on interfaces, approximate for other loads.

    StressRecovery skin(crank);                  // all nodes with stress
    Array_<SymMat33> stress;
    skin.calcStress(state, stress);              // in the body's frame B
    StressRecovery fillet(crank, {118, 119});    // by their numbers in the deck
    Vector vonMises;
    fillet.calcVonMises(state, vonMises);

An object is a workspace: each thread needs its own. Calls do not allocate once their results have
the right size. O(nodes·n_f), in parallel for many nodes; bit-identical for any number of
threads. **/

#include <vector>

#include "simflex/body/FlexibleBody.h"

namespace simflex {

/** Returns √(3/2 s:s) of the deviator s. **/
SimTK::Real calcVonMises(const SimTK::SymMat33& stress);
/** As calcVonMises(), with the sign of the principal value of largest magnitude, so that cycles
between tension and compression are counted as one. **/
SimTK::Real calcSignedVonMises(const SimTK::SymMat33& stress);
/** Returns the principal values, largest first. **/
SimTK::Vec3 calcPrincipalValues(const SimTK::SymMat33& tensor);

class StressRecovery {
public:
    /** Axes of tensors: those of the body's frame B (the deck's) or of Ground. **/
    enum class Axes { Body, Ground };

    /** All nodes with stress; all nodes of the mesh if the part has none. **/
    explicit StressRecovery(const FlexibleBody& body);
    /** The nodes with these deck numbers, in this order. Nodes without stress are allowed if only
    displacements are requested.
    @throws std::out_of_range naming the body and a number that its mesh does not have. **/
    StressRecovery(const FlexibleBody& body, const std::vector<int>& nodeNumbers);
    /** All nodes of the mesh. **/
    static StressRecovery atAllNodes(const FlexibleBody& body);

    const FlexibleBody& getBody() const { return m_body; }
    int getNumNodes() const { return int(m_nodes.size()); }
    int getNodeNumber(int k) const;
    /** Undeformed position in the deck's coordinates [m]. **/
    SimTK::Vec3 getNodePosition(int k) const;

    /** @throws std::invalid_argument unless every node has stress, naming the part and node and
    saying what to do. **/
    void checkStress() const;

    /** @name Stress and strain, one entry per node. Stage::Model; in Ground's axes Stage::Position.
    @throws as checkStress(). **/
    /**@{**/
    /** Cauchy stress [Pa]. **/
    void calcStress(const SimTK::State& state, SimTK::Array_<SimTK::SymMat33>& stress,
                    Axes axes = Axes::Body);
    /** Small strain (tensor shear, half the engineering shear). **/
    void calcStrain(const SimTK::State& state, SimTK::Array_<SimTK::SymMat33>& strain,
                    Axes axes = Axes::Body);
    void calcVonMises(const SimTK::State& state, SimTK::Vector& vonMises);  ///< [Pa]
    /** Principal stresses, largest first [Pa]. **/
    void calcPrincipalStress(const SimTK::State& state, SimTK::Array_<SimTK::Vec3>& principal);
    /**@}**/

    /** @name Motion, one entry per node; of first order in ξ **/
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
    std::vector<int> m_rows;   ///< row of each node in the modal stress, −1: none
    std::vector<double> m_xi, m_values;
};

}  // namespace simflex
