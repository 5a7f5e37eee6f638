#pragma once
/** @file
Chooses the next step size from the errors of the last two steps by a digital filter (private
header):

    h_{n+1}/h_n = (c/e_n)^{1/4k} (c/e_{n−1})^{1/4k} (h_n/h_{n−1})^{−1/4},   k = order + 1

Smooth steps keep a factored matrix useful and make the error a smooth function of the accuracy.
Source: G. Söderlind, ACM Trans. Math. Softw. 29 (2003) 1–26 (filter H211b). **/

namespace simflex {

class Checkpoint;

class StepController {
public:
    /** Target error, as a fraction of the allowed one. **/
    static constexpr double Target = 0.4;

    /** Forgets past steps; the next ratio is based on one error only. **/
    void restart() { m_hasPast = false; }

    /** Ratio of the next step to this accepted one; `error` is relative to the allowed one. **/
    double calcRatio(double error, int order, double largest);

    /** Ratio of the next attempt to this rejected one. **/
    double calcRatioAfterRejection(double error, int order);

    void visit(Checkpoint& checkpoint);

private:
    double m_lastError = 1, m_lastRatio = 1;
    bool m_hasPast = false;
};

}  // namespace simflex
