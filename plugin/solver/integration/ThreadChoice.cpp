#include "simflex/solver/integration/ThreadChoice.h"

namespace simflex {

void ThreadChoice::add(double seconds) {
    if (m_most <= 1) return;
    if (m_pieces++ > 0) m_sum += seconds;
    m_untilTry -= seconds;
    if (m_pieces <= Window) return;

    m_mean[m_isAlone] = m_sum / Window;
    const double other = m_mean[!m_isAlone], cost = m_sum;
    m_pieces = 0;
    m_sum = 0;
    const bool isSlower = other > 0 && m_mean[m_isAlone] > other;
    if (m_isTry) m_untilTry = (isSlower ? cost : other * Window) / LargestPart;
    if (other == 0 || isSlower) {
        m_isTry = other == 0;
        m_isAlone = !m_isAlone;
    } else if (m_untilTry <= 0) {
        m_isTry = true;
        m_isAlone = !m_isAlone;
    } else {
        m_isTry = false;
    }
}

}  // namespace simflex
