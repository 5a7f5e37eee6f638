#pragma once
/** @file
Pictures of a run and of mode shapes. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"
#include "simflex/model/analyses/RunCheckpoint.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/solver/Eigenmodes.h"

namespace simflex {
namespace model {

/** @name Names of what pictures show **/
/**@{**/
/** "front", "isometric" … and their directions. **/
struct NamedView {
    const char* name;
    double azimuth, elevation;  ///< [rad]
};
const std::vector<NamedView>& getNamedViews();

/** What is shown or hidden. **/
struct Drawing {
    const char* name;
    OffscreenVisualizer& (OffscreenVisualizer::*show)(bool);
};
const std::vector<Drawing>& getDrawings();

struct NamedContour {
    const char* name;
    Contour contour;
};
const std::vector<NamedContour>& getNamedContours();
/**@}**/

/** A visualizer that draws the model as its `pictures` say: flexible bodies with contours, rigid
ones with their shapes, cameras, joints, reactions. Not fitted to anything yet. **/
std::unique_ptr<OffscreenVisualizer> makeVisualizer(const Model& model);

/** Refuses what drawFrames() cannot draw, before there is a run to lose. @throws ModelError. **/
void checkPictures(const Model& model);

/** Draws the frames of an analysis as the model's `pictures` say, all seen by one camera and in one
range of colours. Frames that are there already and show the same are kept.
@param usualFolder  for single pictures, where the model names none; model after model must not
    remove each other's
@param rows  of the analysis, for plots; its name is in that of files where a model has several
@param resumeCommand  told to the user when it is stopped
@return where they are, for people
@throws Cancelled, std::runtime_error. **/
std::string drawFrames(const Model& model, const std::vector<RunCheckpoint::Frame>& frames,
                       const Results::Analysis& rows, const std::string& usualFolder,
                       const Listener& listener, const std::string& resumeCommand);

/** Whether the model's `pictures` are of equilibria: there are analyses that find them, and nothing
moves. **/
bool drawsEquilibria(const Model& model);
/** One picture: FOLDER/ANALYSIS.png.
@return where it is, for people @throws std::runtime_error. **/
std::string drawState(const Model& model, const SimTK::State& state, const std::string& analysis,
                      const std::string& usualFolder);

/** @throws std::runtime_error unless it is called .glb and can be written. **/
void checkAnimationName(const std::string& file);

/** Writes the rows of a transient analysis as a moving scene, see
OffscreenVisualizer::writeAnimation(): all, or evenly chosen ones where there are more than 1000.
@param rows  with States
@param file  gets the analysis' name added where the model has several
@return what it is, for people @throws std::runtime_error. **/
std::string writeAnimation(const Model& model, const Results::Analysis& rows,
                           const std::string& file);

/** The motion of a transient analysis for the page of a report, see
OffscreenVisualizer::describeMotion(): exaggerated as in pictures, less, and more.
@param rows  with States **/
std::string describeScene(const Model& model, const Results::Analysis& rows,
                          const Listener& listener);

/** Adds a video at the model's rate. @throws as OffscreenVisualizer::addVideo(). **/
void addVideo(const Model& model, const std::string& file, OffscreenVisualizer& viz);

/** Draws a motion with its plots, camera and colours fitted to all of it.
@return false if the listener stopped it **/
bool drawMotion(const Model& model, const MotionRecorder& motion, const Results::Analysis& rows,
                OffscreenVisualizer& viz, const Listener& listener);

/** A film of each mode: FOLDER/ANALYSIS_mode_1.gif …; or of each shape that a harmonic motion has,
with its title: FOLDER/ANALYSIS_shape_1.gif …
@return where they are, for people @throws Cancelled, std::runtime_error. **/
std::string drawModes(const Model& model, const SimTK::State& about,
                      const std::vector<Eigenmode>& modes, const std::string& analysis,
                      const std::string& usualFolder, const Listener& listener);
std::string drawShapes(const Model& model, const SimTK::State& state,
                       const std::vector<Eigenmode>& shapes, const std::vector<std::string>& titles,
                       const std::string& analysis, const std::string& usualFolder,
                       const Listener& listener);

}  // namespace model
}  // namespace simflex
