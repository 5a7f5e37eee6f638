#pragma once
/** @file
Frame output: background threads draw frames and deliver them in order to files, videos and the
caller. Internal to the renderer.

    captured (caller) -> bounded queue -> deform | range of the run | paint, code (threads) ->

Threads wait for each other only where the order of frames matters: a range that grows with the run
covers all earlier frames, and frames are delivered in order. The bytes are the same for any number
of threads. **/

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "FramePainter.h"
#include "simflex/render/FrameOptions.h"
#include "simflex/render/Video.h"
#include "simflex/render/overlay/PlotPainter.h"
#include "simflex/render/scene/FrameSnapshot.h"
#include "simflex/render/skin/ContourScale.h"

namespace simflex {

/** A plot beside a frame, shared by frames until it changes. **/
struct PlacedPlot {
    std::shared_ptr<const PlotPainter> painter;
    PlotSide side = PlotSide::Below;
    double timeUnit = 1;  ///< of its x axis [s]
};

/** A frame: one picture, or two that are combined, and plots beside it. **/
struct FrameJob {
    std::vector<FrameSnapshot> pictures;
    std::function<Image(const std::vector<Image>&)> compose;  ///< combines several pictures
    std::string composition;                                  ///< identifies `compose` in the
                                                              ///< frame's hash
    std::vector<PlacedPlot> plots;
};

class FrameOutput {
public:
    FrameOutput();
    /** Waits for all frames; prints an error to standard error. **/
    ~FrameOutput();
    FrameOutput(const FrameOutput&) = delete;
    FrameOutput& operator=(const FrameOutput&) = delete;

    /** @name Settings. Each waits for earlier frames. **/
    /**@{**/
    void setFolder(const std::string& outputFolder);
    const std::string& getFolder() const { return folder; }
    void setNumThreads(int wanted);
    int getNumThreads() const { return numThreads; }
    void setOldFrames(OldFrames old);
    void setSink(const FrameSink& frameSink);
    void addVideo(const std::string& file, const VideoOptions& options);
    /**@}**/

    /** Number of the frame added next. **/
    int getNextNumber() const { return nextNumber; }
    /** Returns the number of complete frames. Does not wait. **/
    int getNumDelivered() const;

    /** Adds a frame; waits while the queue is full. Throws the error of an earlier frame: frames
    before that one are complete, later ones are not, and the next frame added gets its number. **/
    void add(FrameJob job);

    /** Adds frames in order and reports complete ones. Stops if `progress` returns false; frames
    added by then are completed. @return their number. **/
    int addAll(int numFrames, const std::function<FrameJob(int)>& getFrame,
               const FrameProgress& progress);

    /** Draws immediately, on the caller's thread, in sequence with the frames added before and
    after. **/
    Image draw(const FrameJob& job);

    /** Waits until all frames are complete. @throws as add() does. **/
    void wait();
    /** Calls wait(), then completes the videos. **/
    void finish();

    /** Deletes frames with this number and higher ones. **/
    void removeFramesFrom(int number);

    /** Values of all frames so far. Both functions wait. **/
    Extremes getValuesOfRun();
    void setValuesOfRun(const Extremes& values);
    /** Returns the ends of the colour bar in the last frame. Waits. **/
    SimTK::Vec2 getLastRange();

    /** Waits for all FrameOutputs of this process that write to a folder. **/
    static void waitForFolder(const std::string& folder);

private:
    using Painters = std::vector<std::unique_ptr<FramePainter>>;
    /** A frame in progress. Its turn comes after all smaller numbers. **/
    struct Entry {
        FrameJob job;
        int number = 0;
        bool hasClaimed = false;
        Extremes runBefore;
    };

    void startThreads();
    void stopThreads();
    void work();
    void process(Entry& entry, Painters& painters);
    std::vector<SimTK::Vec2> claimRanges(Entry& entry, const Extremes& values);
    Image paint(const FrameJob& job, Painters& painters, const std::vector<SimTK::Vec2>& ranges);
    Extremes deform(const FrameJob& job, Painters& painters);
    void deliver(const Entry& entry, const Image& image, const std::vector<std::uint8_t>& png);
    void keepError(const Entry& entry);
    void throwError(std::unique_lock<std::mutex>& lock);
    void prepareFolder();
    std::string makeFileName(int number) const;
    bool isDiscarded(int number) const { return error && number > errorNumber; }

    std::string folder = "frames";
    bool isFolderReady = false;
    OldFrames oldFrames = OldFrames::Remove;
    FrameSink sink;
    std::vector<std::unique_ptr<VideoWriter>> videos;
    int numThreads;
    Painters callersPainters;
    int nextNumber = 0;

    mutable std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::unique_ptr<Entry>> queue;
    std::vector<std::thread> threads;
    int numInWork = 0;
    bool isStopping = false;
    int nextToClaim = 0, nextToDeliver = 0;
    Extremes valuesOfRun;
    SimTK::Vec2 lastRange{0, 1};
    std::exception_ptr error;
    int errorNumber = 0;
    bool hasErrorClaimed = false;
    bool hasFailed = false;  // and nothing has been finished since
    Extremes runBeforeError;
};

}  // namespace simflex
