#pragma once
/** @file
Joint friction in the equations of motion (private header). Friction forces are multipliers: with
the gradients w of the sliding rates v and the load P due to the joint's own multipliers λ,

    r += w (s + c v),    sticking:  v = 0,  |s| ≤ μ_s P    s is a reaction
                         sliding:   s = μ P(λ) d           d = v/|v|

The mode of a contact is an unknown of Newton's method: it starts as at the end of the last step,
and changes where s exceeds its limit or v reverses relative to d. A sticking contact has a row of G
like a joint, so that it does not creep; a sliding one has the derivatives of s in its rows, those
with respect to λ in a coupling of the NewtonSystem.

A step across such a switch is not smooth, and leaves speeds wrong by the jump of accelerations
times its length. Where that is too much, contacts are held in the modes of the step's beginning;
the switch is the root of calcMargin() within the smooth step, which is cut there.

Rows, for each rate i: forceRow(i), with column w_i and multiplier s_i; slopeRow(i), for
∂(s_i + c v_i)/∂v·w and ∂s_i/∂λ, like the second row of a pair. **/

#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/JointTerms.h"

namespace simflex {

class FrictionTerms {
public:
    FrictionTerms(const Topology& topology, const Blocks& blocks, const JointTerms& joints);

    bool isEmpty() const { return m_contacts.empty(); }

    /** Computes gradients and rates where the blocks are realized. @pre joints have their
    Jacobians. **/
    void update();

    /** @name Modes of contacts **/
    /**@{**/
    /** Activates friction, which is inactive before, as in assemblies and equilibria. Contacts that
    move slide, the others stick, where the blocks are realized. **/
    void start();
    /** Accepts a step of length h: the modes at its end are those at the next one's beginning.
    0: restarts at the newest point. **/
    void keep(double h);
    /** Restores the kept modes. **/
    void recall();
    /** Scope of evaluations at a point between steps, with modes of its own. **/
    class Look;
    enum class By {
        Rates,         ///< within a step
        Accelerations  ///< at one instant; rates matter only where nonzero
    };
    /** Decides the modes for these multipliers, and writes the forces of sliding contacts into
    them.
    @returns true if the last matrix is of no use for that **/
    bool decide(By by, double* lambda);
    /** Whether decide() would leave the modes unchanged. **/
    bool isSettled(const double* lambda);
    /** Writes the forces at a stage of a step, in the modes decided for its end. **/
    void follow(double* lambda);
    class Hold;
    /** Longest time for which contacts with dry friction that switched in this step had kept their
    mode [s]; 0: none has switched, or they have switched at its beginning. **/
    double calcEndedPhase() const;
    /** Distance of a contact from leaving the mode that it had at the last step's end, where the
    blocks are realized: its speed along its direction [m/s, rad/s], or the reserve of a sticking
    force below its limit [N, N m]. Negative beyond; infinite without dry friction. **/
    double calcMargin(int contact, const double* lambda);
    /** Marks the end of the last step as a switch of this contact.
    @param isAtRest  its speed is zero there but for round-off **/
    void noteSwitch(int contact, bool isAtRest);
    /** True until forgetSwitch() if the newest point is a switch: start() then keeps the modes of
    the other contacts. **/
    bool isAtSwitch() const;
    void forgetSwitch();
    /** Whether it stuck at the last step's end. **/
    bool wasSticking(int contact) const { return m_contacts[size_t(contact)].kept == Mode::Stick; }
    /** Magnitude of its rates where the blocks are realized [m/s, rad/s]. **/
    double getSpeed(int contact) const { return m_contacts[size_t(contact)].rates.norm(); }
    int size() const { return int(m_contacts.size()); }
    /** A contact that has switched too often within a step, or −1. **/
    int findUndecided() const;
    /** Whether it slides with dry friction. **/
    bool isSliding(int contact) const {
        return m_contacts[size_t(contact)].mode == Mode::Slip && isDry(m_contacts[size_t(contact)]);
    }
    /**@}**/

    /** @name In the current modes **/
    /**@{**/
    /** Rates of sticking contacts; zero in the other rows. **/
    void calcErrors(double* c) const;
    /** The same for accelerations. @pre JointTerms::calcErrorDotDots() **/
    void calcErrorDots(const double* u, const double* uDot, double* gDotDot);
    void addInForces(const double* lambda, double* r) const;
    /** Forms columns and couplings; after J and the columns of joints.
    @param by  whether the unknowns are speeds or accelerations **/
    void form(By by, NewtonSystem& system);
    /** The same with all contacts inactive. **/
    void formReleased(NewtonSystem& system) const;
    void addInPower(const double* lambda, double& power) const;
    /** Largest change of s of a contact with multiplier k of its joint, per μ. **/
    double getLoadSlope(int contact, int k) const {
        return m_contacts[size_t(contact)].loadSlope[size_t(k)];
    }
    /**@}**/

    void visit(Checkpoint& checkpoint);

private:
    static constexpr int MaxRates = FrictionEquations::MaxRates;
    using Vector = Eigen::Vector3d;  ///< entries beyond the rates are zero
    enum class Mode : char { Released, Stick, Slip };
    struct Contact {
        const FrictionEquations* equations;
        int numRates;
        FrameRef F, M;
        SimTK::SpatialVec D[2][MaxRates];       ///< w, for F and M
        SimTK::SpatialVec slopes[2][MaxRates];  ///< Σ_k ∂s_i/∂v_k w_k
        Vector rates = Vector::Zero(), accelerations = Vector::Zero();
        double load = 0;
        std::vector<double> loadSlope;  ///< ∂P/∂λ, by the joint's multipliers
        Mode mode = Mode::Released, kept = Mode::Released;
        Vector direction = Vector::Zero(), keptDirection = Vector::Zero();  ///< d
        int numChanges = 0;
        double phase = SimTK::Infinity;           ///< time since its last switch or the start
        bool switches = false, isAtRest = false;  ///< at the newest point

        /** Mode and values with which the last matrix was formed. **/
        Mode formedMode = Mode::Released;
        Vector formedDirection = Vector::Zero();
        bool hasColumns = false;
        std::vector<double> formedSlope;
    };
    void updateLoad(int contact, const double* lambda);
    void writeForce(int contact, const Vector& force, double* lambda) const;
    Vector calcSlidingForce(const Contact& contact, const Vector& direction) const;
    static bool isOutdated(const Contact& contact);
    /** Whether its mode differs from that at the last step's end. **/
    static bool hasSwitched(const Contact& contact);
    static bool isDry(const Contact& contact);
    /** Whether a sticking contact slips at this force. **/
    static bool tearsOff(const Contact& contact, const Vector& force);
    /** Reserve of a sticking force below its limit. **/
    static double calcReserve(const Contact& contact, const Vector& force);
    Vector getForce(int contact, const double* lambda) const;
    /** Whether a sliding contact moves, or is accelerated, against its direction. **/
    static bool turnsBack(const Contact& contact, const Vector& motion);
    /** s + c v of a rate. **/
    double calcForce(int contact, int rate, const double* lambda) const;
    void setColumns(NewtonSystem& system, bool areActive) const;

    const Topology& m_topology;
    const Blocks& m_blocks;
    const JointTerms& m_joints;
    std::vector<Contact> m_contacts;  ///< as in the topology
    std::vector<double> m_diagonals;  ///< by row
    bool m_areHeld = false;
};

class FrictionTerms::Look {
public:
    explicit Look(FrictionTerms& frictions)
        : m_frictions(frictions), m_contacts(frictions.m_contacts) {}
    ~Look() { m_frictions.m_contacts.swap(m_contacts); }
    Look(const Look&) = delete;
    Look& operator=(const Look&) = delete;

private:
    FrictionTerms& m_frictions;
    std::vector<Contact> m_contacts;  ///< those of the steps
};

/** While on, contacts keep the modes of the last step's end regardless of forces. **/
class FrictionTerms::Hold {
public:
    explicit Hold(FrictionTerms& frictions) : m_frictions(frictions) {}
    ~Hold() { set(false); }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

    void set(bool isOn) { m_frictions.m_areHeld = isOn; }
    bool isOn() const { return m_frictions.m_areHeld; }

private:
    FrictionTerms& m_frictions;
};

}  // namespace simflex
