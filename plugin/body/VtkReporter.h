#pragma once
/** @file
Writes a run as a VTK time series for ParaView: one .vtu file per flexible body and time, and the
.pvd file that lists them.

    system.addEventReporter(new VtkReporter(flexible, 0.001, "output/run.pvd"));
    // output/run.pvd, output/run/crank_00000.vtu, output/run/rod_00000.vtu, …

Points are the deformed nodes in Ground, with "displacement [m]" (elastic, in Ground's axes),
"velocity [m/s]" in Ground, "node number" of the deck and, for parts with modal stress, "stress
[Pa]" in the body's axes and "von Mises [Pa]" (NaN at nodes without). To exaggerate deformations k
times, use ParaView's Warp By Vector with factor k − 1.

The .pvd is complete after each frame, so an interrupted run keeps its frames. **/

#include <string>
#include <vector>

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class VtkReporter : public SimTK::PeriodicEventReporter {
public:
    /** @param interval  between frames [s]; each costs O(nodes·n_f) and writes every mesh
    @param pvdFile   the list to write. Frames go to the folder of the same name without suffix,
    which is created with the first frame; frames of an earlier run in it are then removed.
    @throws std::invalid_argument if the interval is not positive or the file's suffix is not
    .pvd. **/
    VtkReporter(const FlexibleBodySubsystem& subsystem, SimTK::Real interval,
                const std::string& pvdFile);
    ~VtkReporter() override;
    VtkReporter(const VtkReporter&) = delete;
    VtkReporter& operator=(const VtkReporter&) = delete;

    /** Writes the frame; realizes the State to Stage::Velocity.
    @throws std::runtime_error naming a file that cannot be written. **/
    void handleEvent(const SimTK::State& state) const override;

    /** Number of frames written so far. **/
    int getNumFrames() const { return m_numFrames; }

private:
    void start() const;
    void append(const std::string& entries) const;

    const FlexibleBodySubsystem& m_subsystem;
    std::string m_pvdFile;
    mutable std::vector<std::string> m_names;  // of the bodies' files
    mutable int m_file = -1;                   // descriptor of the .pvd
    mutable long long m_end = 0;               // position of the next entry
    mutable int m_numFrames = 0;
};

}  // namespace simflex
