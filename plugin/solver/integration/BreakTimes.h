#pragma once
/** @file
The known times at which loads or motions jump or have a kink, and the smooth span between two of
them (private header).

A step ends at a break, and the equations are evaluated at times inside the span, so that functions
have their one-sided values at its ends, to whichever side their own comparison assigns the break.
**/

#include <functional>
#include <vector>

namespace simflex {

class Checkpoint;

/** True if b is a later time than a by more than round-off. **/
bool isLater(double a, double b);

class BreakTimes {
public:
    /** Returns the first break after a time; infinity: none. **/
    using Next = std::function<double(double time)>;

    BreakTimes();

    void add(std::vector<double> times);
    void add(Next next) { m_sources.push_back(std::move(next)); }
    int numSources() const { return int(m_sources.size()); }

    /** Moves to the span that begins at or contains this time. **/
    void moveTo(double time);

    /** The end of the span. **/
    double getEnd() const { return m_end; }
    bool isAtEnd(double time) const { return !isLater(time, m_end); }

    /** Times within the span. **/
    double getFirst() const { return m_first; }
    double getLast() const { return m_last; }

    void visit(Checkpoint& checkpoint);

private:
    double findNext(double time) const;

    std::vector<Next> m_sources;
    double m_first, m_last, m_end;
};

}  // namespace simflex
