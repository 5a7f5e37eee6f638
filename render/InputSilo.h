#pragma once
/** @file
Simulated user of a program without a window: OffscreenVisualizer::InputSilo has the interface of
SimTK::Visualizer::InputSilo, and programs that wait for input continue.

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

/** Input comes from calls of keyPressed(), menuSelected() and sliderMoved(), by the program itself
or a test. A program that waits without pending input gets the answers of a user who wants to see
everything: the menu items, each once, in the order in which they were added (so "Go", "Replay",
"Quit" run to their end); the keys Enter and Esc in turn; the first slider at its current value.
SimTK's InputSilo would wait forever. Not thread-safe. **/
class OffscreenVisualizer::InputSilo : public SimTK::Visualizer::InputListener {
public:
    bool isAnyUserInput() const { return !keys.empty() || !picks.empty() || !moves.empty(); }

    /** Returns at once. **/
    void waitForAnyUserInput() const {}

    bool takeKeyHit(unsigned& key, unsigned& modifiers);
    bool takeMenuPick(int& menu, int& item);
    bool takeSliderMove(int& slider, SimTK::Real& value);

    /** @name Waiting
    @throws std::runtime_error if there is no answer: all menu items have been picked, no slider was
    added, or 100 keys in a row were not the expected one. **/
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
