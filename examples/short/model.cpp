// Model: a mechanism set key by key (or read from a file), run, changed, restored and drawn.
#include <cstdio>

#include "simflex/model/Session.h"
using namespace simflex;

int main() {
    ModelText text;  // or loadModelText("pendulum.yaml")
    text.set("gravity", {0, -9.81, 0});
    text.set("parts.rod.file", "rod.h5");
    text.set("bodies.rod.part", "rod");
    text.set("joints.pin", "{type: pin, between: [ground, rod.big_end]}");
    text.set("probes.tip", "{position: rod.small_end}");

    ModelOptions options;
    options.extend = [](ModelSystem& system) {  // any objects of Simbody, beyond model files
        SimTK::Force::GlobalDamper(system.forces, system.matter, 0.01);
    };
    Session session(text, options);
    session.runTo(0.1, 1e-3);  // records probes every millisecond
    const SavedState before = session.save();
    session.set("joints.pin.angle_rate", {0});
    session.runTo(0.2, 1e-3);
    std::printf("held at 0.1 s, the tip is at y = %.4f m at 0.2 s\n", session.get("tip")[1]);
    session.restore(before);
    session.change("gravity", "[0, 0, 0]", Session::Restart::Never);
    session.runTo(0.2, 1e-3);
    std::printf("without weight since 0.1 s, at %.4f m\n", session.get("tip")[1]);
    session.draw().writePng("rod.png");
    return session.getRecord().time.size() == 201 ? 0 : 1;
}
