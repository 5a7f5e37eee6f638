#pragma once
/** @file
Friction of joints in the equations of motion (private header). Its forces are multipliers: with the
gradients w of the sliding rates v and the load P that the joint's own multipliers λ make,

    r += w (s + c v),    sticking:  v = 0,  |s| ≤ μ_s P    s is what it takes
                         sliding:   s = μ P(λ) d           d = v/|v|

Which of the two a contact does is part of what Newton's method looks for: it begins as the last
step ended, and changes where s exceeds its limit or v turns against d. A contact that sticks has a
row of G as a joint has, so that it does not creep; one that slides has the derivatives of s in its
rows, those by λ in a coupling of the NewtonSystem.

A step over such a switch is not smooth, and leaves speeds wrong by the jump of accelerations times
its length. Where that is too much, contacts are held to what they did at the step's beginning; the
switch is the root of calcMargin() within the smooth step, which ends there.

Rows, for each rate i: forceRow(i), whose column is w_i and whose multiplier is s_i; slopeRow(i), by
which ∂(s_i + c v_i)/∂v·w and ∂s_i/∂λ enter, as the second row of a pair does. **/

#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/JointTerms.h"

namespace simflex {

class FrictionTerms {
public:
    FrictionTerms(const Topology& topology, const Blocks& blocks, const JointTerms& joints);

    bool isEmpty() const { return m_contacts.empty(); }

    /** Gradients and rates where the blocks are. @pre joints have their Jacobians. **/
    void update();

    /** @name What contacts do **/
    /**@{**/
    /** Until then none acts, as in assemblies and equilibria. Those sliding that move, the others
     * sticking, where the blocks are. **/
    void start();
    /** A step of length h is taken: what contacts do at its end is what the next one begins with.
    0: the newest point is begun anew. **/
    void keep(double h);
    /** Back to that. **/
    void recall();
    /** A point between steps is looked at: until it goes, what contacts do is of that point. **/
    class Look;
    enum class By {
        Rates,         ///< of a step
        Accelerations  ///< at one moment; rates matter only where they are not zero
    };
    /** Decides for these multipliers, and writes the forces of those that slide among them.
    @returns true if the last matrix is of no use for that **/
    bool decide(By by, double* lambda);
    /** Whether decide() would leave what contacts do as it is. **/
    bool isSettled(const double* lambda);
    /** Writes the forces of a stage of a step, as decided for its end. **/
    void follow(double* lambda);
    class Hold;
    /** How long the contacts have done the same, by dry friction, that stick or slide otherwise
    than at the last step's end: the longest [s]; 0: none does, or they have switched right there.
    **/
    double calcEndedPhase() const;
    /** How far a contact is from ceasing to do what it did at the last step's end, where the blocks
    are: its speed along its direction [m/s, rad/s], or by how much a force that holds is below its
    limit [N, N m]. Negative beyond; infinite where there is no dry friction. **/
    double calcMargin(int contact, const double* lambda);
    /** The last step ends where this contact switches.
    @param isAtRest  it has no speed there but round-off **/
    void noteSwitch(int contact, bool isAtRest);
    /** Until it is left, the newest point is where a contact switches: start() lets the others go
    on as they did. **/
    bool isAtSwitch() const;
    void forgetSwitch();
    /** It stuck at the last step's end. **/
    bool wasSticking(int contact) const { return m_contacts[size_t(contact)].kept == Mode::Stick; }
    /** Size of its rates, where the blocks are [m/s, rad/s]. **/
    double getSpeed(int contact) const { return m_contacts[size_t(contact)].rates.norm(); }
    int size() const { return int(m_contacts.size()); }
    /** A contact that has changed its mind too often, or −1. **/
    int findUndecided() const;
    /** By dry friction. **/
    bool isSliding(int contact) const {
        return m_contacts[size_t(contact)].mode == Mode::Slip && isDry(m_contacts[size_t(contact)]);
    }
    /**@}**/

    /** @name For what they do **/
    /**@{**/
    /** Rates of those that stick; zero in the other rows. **/
    void calcErrors(double* c) const;
    /** The same of accelerations. @pre JointTerms::calcErrorDotDots() **/
    void calcErrorDots(const double* u, const double* uDot, double* gDotDot);
    /** r += w (s + c v). **/
    void addInForces(const double* lambda, double* r) const;
    /** Columns and couplings; after J and the columns of joints.
    @param by  what the unknowns are: speeds or accelerations **/
    void form(By by, NewtonSystem& system);
    /** The same where none acts. **/
    void formReleased(NewtonSystem& system) const;
    void addInPower(const double* lambda, double& power) const;
    /** How much s of a contact changes with multiplier k of its joint, at most, per μ. **/
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
        SimTK::SpatialVec D[2][MaxRates];       ///< w, of F and M
        SimTK::SpatialVec slopes[2][MaxRates];  ///< Σ_k ∂s_i/∂v_k w_k
        Vector rates = Vector::Zero(), accelerations = Vector::Zero();
        double load = 0;
        std::vector<double> loadSlope;  ///< ∂P/∂λ, of the joint's multipliers
        Mode mode = Mode::Released, kept = Mode::Released;
        Vector direction = Vector::Zero(), keptDirection = Vector::Zero();  ///< d
        int numChanges = 0;
        double phase = SimTK::Infinity;           ///< time since it switched, or since the start
        bool switches = false, isAtRest = false;  ///< at the newest point

        /** What the last matrix was formed with. **/
        Mode formedMode = Mode::Released;
        Vector formedDirection = Vector::Zero();
        bool hasColumns = false;
        std::vector<double> formedSlope;
    };
    void updateLoad(int contact, const double* lambda);
    void writeForce(int contact, const Vector& force, double* lambda) const;
    Vector calcSlidingForce(const Contact& contact, const Vector& direction) const;
    static bool isOutdated(const Contact& contact);
    /** It does not do what it did at the last step's end. **/
    static bool hasSwitched(const Contact& contact);
    static bool isDry(const Contact& contact);
    /** What sticks by this force does no longer. **/
    static bool tearsOff(const Contact& contact, const Vector& force);
    /** By how much the force that holds it is below its limit. **/
    static double calcReserve(const Contact& contact, const Vector& force);
    Vector getForce(int contact, const double* lambda) const;
    /** What slides moves, or is accelerated, against its direction. **/
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

/** While it is on, contacts do what they did at the last step's end, whatever it takes. **/
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
