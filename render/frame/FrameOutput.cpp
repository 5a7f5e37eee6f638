#include "FrameOutput.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <stdexcept>

#include "FrameHash.h"
#include "simflex/base/UnfinishedFile.h"

namespace simflex {

namespace fs = std::filesystem;

namespace {

constexpr int mostThreads = 256;
constexpr int queuedPerThread = 2;
const char* const hashKeyword = "simflex-frame";  // keyword of the PNG text

// The rasterizer has its own threads, shared by all painters; the second painter keeps them busy
// while the first one deforms or encodes.
int chooseNumThreads() {
    const int processors = int(std::thread::hardware_concurrency());
    return processors < 2 ? 1 : std::min(4, std::max(2, processors / 2));
}

// Outputs that may still be writing.
struct OpenOutputs {
    std::mutex mutex;
    std::vector<FrameOutput*> outputs;
};
OpenOutputs& getOpenOutputs() {
    static OpenOutputs* const open = new OpenOutputs;  // outlives all static visualizers
    return *open;
}

bool isFrameFile(const std::string& name, int& number) {
    int length = 0;
    return std::sscanf(name.c_str(), "frame_%7d.png%n", &number, &length) == 1 &&
           length == int(name.size()) && number >= 0;
}

bool isSameFolder(const std::string& a, const std::string& b) {
    std::error_code none;
    return fs::weakly_canonical(a.empty() ? "." : a, none) ==
           fs::weakly_canonical(b.empty() ? "." : b, none);
}

// Returns an empty image for a damaged file.
Image readWholePicture(const std::string& file) {
    try {
        return Image::readPng(file);
    } catch (const std::runtime_error&) {
        return {};
    }
}

void placeBeside(Image& frame, const Image& plot, PlotSide side) {
    const bool below = side == PlotSide::Below;
    Image result(frame.getWidth() + (below ? 0 : plot.getWidth()),
                 frame.getHeight() + (below ? plot.getHeight() : 0));
    result.paste(frame, 0, 0);
    result.paste(plot, below ? 0 : frame.getWidth(), below ? frame.getHeight() : 0);
    frame = std::move(result);
}

}  // namespace

FrameOutput::FrameOutput() : numThreads(chooseNumThreads()) {
    const std::lock_guard<std::mutex> lock(getOpenOutputs().mutex);
    getOpenOutputs().outputs.push_back(this);
}

FrameOutput::~FrameOutput() {
    {
        const std::lock_guard<std::mutex> lock(getOpenOutputs().mutex);
        auto& outputs = getOpenOutputs().outputs;
        outputs.erase(std::find(outputs.begin(), outputs.end(), this));
    }
    // The video of a failed run does not replace an earlier one.
    if (hasFailed) videos.clear();
    try {
        finish();
    } catch (const std::exception& e) {
        std::cerr << "simflex: frames are missing: " << e.what() << std::endl;
    }
    stopThreads();
}

void FrameOutput::waitForFolder(const std::string& folder) {
    // Locked so that no output is destroyed meanwhile; workers do not use this mutex.
    const std::lock_guard<std::mutex> lock(getOpenOutputs().mutex);
    for (FrameOutput* output : getOpenOutputs().outputs)
        if (!output->folder.empty() && isSameFolder(output->folder, folder)) output->wait();
}

void FrameOutput::setFolder(const std::string& outputFolder) {
    wait();
    folder = outputFolder;
    isFolderReady = false;
    nextNumber = nextToClaim = nextToDeliver = 0;
}

void FrameOutput::setNumThreads(int wanted) {
    if (wanted < 0 || wanted > mostThreads)
        throw std::invalid_argument("setNumThreads: " + std::to_string(wanted) +
                                    " is not between 0 and " + std::to_string(mostThreads));
    wait();
    stopThreads();
    numThreads = wanted;
}

void FrameOutput::setOldFrames(OldFrames old) {
    wait();
    oldFrames = old;
}

void FrameOutput::setSink(const FrameSink& frameSink) {
    wait();
    sink = frameSink;
}

void FrameOutput::addVideo(const std::string& file, const VideoOptions& options) {
    wait();
    videos.push_back(std::make_unique<VideoWriter>(file, options));
}

std::string FrameOutput::makeFileName(int number) const {
    char name[32];
    std::snprintf(name, sizeof name, "/frame_%05d.png", number);
    return folder + name;
}

void FrameOutput::prepareFolder() {
    if (isFolderReady || folder.empty()) return;
    std::error_code failure;
    fs::create_directories(folder, failure);
    if (failure || !fs::is_directory(folder))
        throw std::runtime_error("cannot make the folder '" + folder +
                                 "' for frames: " + failure.message());
    if (!fs::is_symlink(folder)) removeUnfinishedFiles(folder, "frame_");
    if (oldFrames == OldFrames::Remove) removeFramesFrom(0);
    isFolderReady = true;
}

void FrameOutput::removeFramesFrom(int first) {
    if (folder.empty()) return;
    std::error_code failure;
    std::vector<fs::path> old;
    for (const auto& entry : fs::directory_iterator(folder, failure)) {
        int number = 0;
        if (isFrameFile(entry.path().filename().string(), number) && number >= first)
            old.push_back(entry.path());
    }
    if (!old.empty()) refuseLinkedFolder(folder);
    for (const fs::path& file : old) fs::remove(file, failure);
}

int FrameOutput::getNumDelivered() const {
    const std::lock_guard<std::mutex> lock(mutex);
    return nextToDeliver;
}

void FrameOutput::startThreads() {
    while (int(threads.size()) < numThreads) threads.emplace_back([this] { work(); });
}

void FrameOutput::stopThreads() {
    {
        const std::lock_guard<std::mutex> lock(mutex);
        isStopping = true;
    }
    changed.notify_all();
    for (std::thread& thread : threads) thread.join();
    threads.clear();
    isStopping = false;
}

void FrameOutput::add(FrameJob job) {
    auto entry = std::make_unique<Entry>();
    entry->job = std::move(job);
    if (numThreads == 0) {
        prepareFolder();
        entry->number = nextNumber;
        process(*entry, callersPainters);
        std::unique_lock<std::mutex> lock(mutex);
        if (error) throwError(lock);
        ++nextNumber;
        return;
    }
    std::unique_lock<std::mutex> lock(mutex);
    if (error) throwError(lock);
    lock.unlock();
    prepareFolder();
    startThreads();
    lock.lock();
    changed.wait(lock, [&] { return error || int(queue.size()) < queuedPerThread * numThreads; });
    if (error) throwError(lock);
    entry->number = nextNumber++;
    queue.push_back(std::move(entry));
    changed.notify_all();
}

int FrameOutput::addAll(int numFrames, const std::function<FrameJob(int)>& getFrame,
                        const FrameProgress& progress) {
    constexpr auto pause = std::chrono::milliseconds(100);
    const int first = nextNumber;
    const auto goesOn = [&] { return !progress || progress(getNumDelivered() - first, numFrames); };
    bool isWanted = goesOn();
    int numAdded = 0;
    for (; numAdded < numFrames && isWanted; ++numAdded) {
        add(getFrame(numAdded));
        isWanted = goesOn();
    }
    // Finish the queue and report its progress.
    std::unique_lock<std::mutex> lock(mutex);
    while (!error && nextToDeliver < first + numAdded) {
        changed.wait_for(lock, pause);
        lock.unlock();
        goesOn();
        lock.lock();
    }
    lock.unlock();
    wait();
    goesOn();
    if (numAdded == numFrames && oldFrames == OldFrames::Resume) removeFramesFrom(nextNumber);
    return numAdded;
}

void FrameOutput::work() {
    // Divide the processors among the threads.
    const int processors = int(std::thread::hardware_concurrency());
    omp_set_num_threads(std::max(1, processors / std::max(1, numThreads)));
    Painters painters;
    std::unique_lock<std::mutex> lock(mutex);
    for (;;) {
        changed.wait(lock, [&] { return isStopping || !queue.empty(); });
        if (queue.empty()) return;
        std::unique_ptr<Entry> entry = std::move(queue.front());
        queue.pop_front();
        ++numInWork;
        lock.unlock();
        changed.notify_all();
        process(*entry, painters);
        entry.reset();
        lock.lock();
        --numInWork;
        changed.notify_all();
    }
}

Extremes FrameOutput::deform(const FrameJob& job, Painters& painters) {
    Extremes values;
    while (painters.size() < job.pictures.size())
        painters.push_back(std::make_unique<FramePainter>());
    for (std::size_t i = 0; i < job.pictures.size(); ++i)
        values.include(painters[i]->deform(job.pictures[i]));
    return values;
}

// Waits until all earlier frames have reported their values.
std::vector<SimTK::Vec2> FrameOutput::claimRanges(Entry& entry, const Extremes& values) {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] { return nextToClaim == entry.number || isDiscarded(entry.number); });
    std::vector<SimTK::Vec2> ranges;
    if (isDiscarded(entry.number)) return ranges;
    entry.runBefore = valuesOfRun;
    entry.hasClaimed = true;
    valuesOfRun.include(values);
    for (const FrameSnapshot& picture : entry.job.pictures)
        ranges.push_back(calcContourRange(picture.partStyle.contour, values, valuesOfRun));
    lastRange = ranges.front();
    ++nextToClaim;
    changed.notify_all();
    return ranges;
}

Image FrameOutput::paint(const FrameJob& job, Painters& painters,
                         const std::vector<SimTK::Vec2>& ranges) {
    std::vector<Image> images;
    for (std::size_t i = 0; i < job.pictures.size(); ++i)
        images.push_back(painters[i]->paint(job.pictures[i], ranges[i]));
    Image frame = job.compose ? job.compose(images) : std::move(images.front());
    for (const PlacedPlot& plot : job.plots)
        placeBeside(frame, plot.painter->paint(job.pictures.front().time / plot.timeUnit),
                    plot.side);
    return frame;
}

void FrameOutput::process(Entry& entry, Painters& painters) {
    try {
        const Extremes values = deform(entry.job, painters);
        const std::vector<SimTK::Vec2> ranges = claimRanges(entry, values);
        if (ranges.empty()) return;

        const std::string file = makeFileName(entry.number);
        const std::string hash = folder.empty() ? "" : hashFrame(entry.job, ranges);
        const bool isThere = !folder.empty() && oldFrames == OldFrames::Resume &&
                             isPngComplete(file) && readPngText(file, hashKeyword) == hash;
        Image image;
        std::vector<std::uint8_t> png;
        if (isThere && (sink || !videos.empty())) image = readWholePicture(file);
        if (!isThere || (image.isEmpty() && (sink || !videos.empty()))) {
            image = paint(entry.job, painters, ranges);
            if (!folder.empty()) png = image.encodePng(hashKeyword, hash);
        }

        std::unique_lock<std::mutex> lock(mutex);
        changed.wait(lock,
                     [&] { return nextToDeliver == entry.number || isDiscarded(entry.number); });
        if (isDiscarded(entry.number)) return;
        lock.unlock();
        deliver(entry, image, png);
        lock.lock();
        ++nextToDeliver;
        changed.notify_all();
    } catch (...) {
        keepError(entry);
    }
}

// Called in the frame's turn: by one thread at a time.
void FrameOutput::deliver(const Entry& entry, const Image& image,
                          const std::vector<std::uint8_t>& png) {
    const std::string file = makeFileName(entry.number);
    if (!png.empty()) replaceFile(file, png, Durability::ProcessEnd);
    try {
        for (const auto& video : videos) video->write(image);
        if (sink) sink(entry.number, image);
    } catch (...) {
        if (!png.empty()) std::remove(file.c_str());
        throw;
    }
}

void FrameOutput::keepError(const Entry& entry) {
    const std::exception_ptr thrown = std::current_exception();
    const std::lock_guard<std::mutex> lock(mutex);
    if (error && errorNumber < entry.number) return;
    const std::string where = "frame " + std::to_string(entry.number) +
                              (folder.empty() ? "" : " ('" + makeFileName(entry.number) + "')") +
                              " at time " + formatNumber(entry.job.pictures.front().time) + " s: ";
    try {
        std::rethrow_exception(thrown);
    } catch (const std::exception& e) {
        error = std::make_exception_ptr(std::runtime_error("cannot draw " + where + e.what()));
    } catch (...) {
        error = thrown;
    }
    errorNumber = entry.number;
    hasErrorClaimed = entry.hasClaimed;
    runBeforeError = entry.runBefore;
    changed.notify_all();
}

// Frames before the failed one are completed, those after it are discarded.
void FrameOutput::throwError(std::unique_lock<std::mutex>& lock) {
    changed.wait(lock, [&] { return queue.empty() && numInWork == 0; });
    const std::exception_ptr thrown = error;
    error = nullptr;
    hasFailed = true;
    nextNumber = nextToClaim = nextToDeliver = errorNumber;
    if (hasErrorClaimed) valuesOfRun = runBeforeError;
    std::rethrow_exception(thrown);
}

void FrameOutput::wait() {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] { return queue.empty() && numInWork == 0; });
    if (error) throwError(lock);
}

void FrameOutput::finish() {
    wait();
    hasFailed = false;
    std::vector<std::unique_ptr<VideoWriter>> complete;
    complete.swap(videos);
    std::exception_ptr failure;
    for (const auto& video : complete) {
        try {
            if (video->getNumFrames() > 0) video->finish();
        } catch (...) {
            if (!failure) failure = std::current_exception();
        }
    }
    if (failure) std::rethrow_exception(failure);
}

Image FrameOutput::draw(const FrameJob& job) {
    wait();
    const Extremes values = deform(job, callersPainters);
    valuesOfRun.include(values);
    std::vector<SimTK::Vec2> ranges;
    for (const FrameSnapshot& picture : job.pictures)
        ranges.push_back(calcContourRange(picture.partStyle.contour, values, valuesOfRun));
    lastRange = ranges.front();
    return paint(job, callersPainters, ranges);
}

Extremes FrameOutput::getValuesOfRun() {
    wait();
    return valuesOfRun;
}

void FrameOutput::setValuesOfRun(const Extremes& values) {
    wait();
    valuesOfRun = values;
}

SimTK::Vec2 FrameOutput::getLastRange() {
    wait();
    return lastRange;
}

}  // namespace simflex
