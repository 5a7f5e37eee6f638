#pragma once
/** @file
The user of a program that has no window: OffscreenVisualizer::InputSilo has the interface of
SimTK::Visualizer::InputSilo, and a program that waits for its user goes on.

@code
    auto* silo = new simflex::OffscreenVisualizer::InputSilo;
    viz.addInputListener(silo);           // viz takes it over
    silo->keyPressed('q', 0);             // input for the program to take, in this order
@endcode **/

#include <deque>
#include <utility>

#include "Simbody.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

/** Input comes from whoever calls keyPressed(), menuSelected() and sliderMoved(), the program
itself or a test. A program that waits while there is none gets the answer of a user who wants to
see everything: the items of its menus, each once, in the order in which they were added (so
"Go", "Replay", "Quit" run to their end); the keys Enter and Esc in turn; the first slider as it
stands. SimTK's own InputSilo would wait for ever.

Not for several threads at once. **/
class OffscreenVisualizer::InputSilo : public SimTK::Visualizer::InputListener {
public:
    bool isAnyUserInput() const { return !keys.empty() || !picks.empty() || !moves.empty(); }

    /** Returns at once. **/
    void waitForAnyUserInput() const {}

    bool takeKeyHit(unsigned& key, unsigned& modifiers);
    bool takeMenuPick(int& menu, int& item);
    bool takeSliderMove(int& slider, SimTK::Real& value);

    /** @name Waiting
    @throws std::runtime_error when nothing can be answered: all menu items have been picked, no
        slider was added, or 100 keys in a row were not what the program waits for. **/
    /**@{**/
    void waitForKeyHit(unsigned& key, unsigned& modifiers);
    void waitForMenuPick(int& menu, int& item);
    void waitForSliderMove(int& slider, SimTK::Real& value);
    /**@}**/

    void clear();

    bool keyPressed(unsigned key, unsigned modifiers) override;
    bool menuSelected(int menu, int item) override;
    bool sliderMoved(int slider, SimTK::Real value) override;

private:
    friend class OffscreenVisualizer;

    std::deque<std::pair<unsigned, unsigned>> keys;
    std::deque<std::pair<int, int>> picks;
    std::deque<std::pair<int, SimTK::Real>> moves;
    const WindowSettings* window = nullptr;  // of the visualizer that owns this silo
    std::size_t numPicked = 0;
    int numKeys = 0;
};

}  // namespace simflex
