#include "simflex/render/InputSilo.h"

#include <stdexcept>
#include <tuple>

#include "WindowSettings.h"

namespace simflex {

namespace {

template <class A, class B>
bool takeFirst(std::deque<std::pair<A, B>>& queue, A& first, B& second) {
    if (queue.empty()) return false;
    first = queue.front().first;
    second = queue.front().second;
    queue.pop_front();
    return true;
}

}  // namespace

bool OffscreenVisualizer::InputSilo::takeKeyHit(unsigned& key, unsigned& modifiers) {
    key = modifiers = 0;
    return takeFirst(keys, key, modifiers);
}

bool OffscreenVisualizer::InputSilo::takeMenuPick(int& menu, int& item) {
    menu = item = 0;
    return takeFirst(picks, menu, item);
}

bool OffscreenVisualizer::InputSilo::takeSliderMove(int& slider, SimTK::Real& value) {
    slider = 0;
    value = SimTK::NaN;
    return takeFirst(moves, slider, value);
}

void OffscreenVisualizer::InputSilo::waitForKeyHit(unsigned& key, unsigned& modifiers) {
    if (takeKeyHit(key, modifiers)) {
        numKeys = 0;
        return;
    }
    if (numKeys >= 100)
        throw std::runtime_error(
            "the program waits for a key, there is no window, and neither Enter nor Esc is what "
            "it waits for: call keyPressed() of the InputSilo beforehand");
    key = numKeys++ % 2 == 0 ? KeyEnter : KeyEsc;
}

void OffscreenVisualizer::InputSilo::waitForMenuPick(int& menu, int& item) {
    if (takeMenuPick(menu, item)) return;
    if (!window || numPicked >= window->menuItems.size())
        throw std::runtime_error(
            "the program waits for a menu pick, there is no window, and all " +
            std::to_string(numPicked) +
            " items of its menus have been picked: call menuSelected() of the InputSilo "
            "beforehand");
    std::tie(menu, item) = window->menuItems[numPicked++];
}

void OffscreenVisualizer::InputSilo::waitForSliderMove(int& slider, SimTK::Real& value) {
    if (takeSliderMove(slider, value)) return;
    if (!window || window->sliderOrder.empty())
        throw std::runtime_error(
            "the program waits for a slider to be moved, there is no window and no slider: call "
            "sliderMoved() of the InputSilo beforehand");
    slider = window->sliderOrder.front();
    value = window->sliders.at(slider).value;
}

void OffscreenVisualizer::InputSilo::clear() {
    keys.clear();
    picks.clear();
    moves.clear();
}

bool OffscreenVisualizer::InputSilo::keyPressed(unsigned key, unsigned modifiers) {
    keys.emplace_back(key, modifiers);
    return true;
}

bool OffscreenVisualizer::InputSilo::menuSelected(int menu, int item) {
    picks.emplace_back(menu, item);
    return true;
}

bool OffscreenVisualizer::InputSilo::sliderMoved(int slider, SimTK::Real value) {
    moves.emplace_back(slider, value);
    return true;
}

}  // namespace simflex
