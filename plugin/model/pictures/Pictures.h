#pragma once
/** @file
Pictures of runs and mode shapes. **/

#include <string>
#include <vector>

#include "simflex/model/Results.h"
#include "simflex/model/analyses/RunCheckpoint.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/solver/Eigenmodes.h"

namespace simflex {
namespace model {

/** @name Names used in `pictures` **/
/**@{**/
/** Viewing directions: "front", "isometric" … **/
struct NamedView {
    const char* name;
    double azimuth, elevation;  ///< [rad]
};
const std::vector<NamedView>& getNamedViews();

/** An item that can be shown or hidden. **/
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

/** Makes a visualizer as the model's `pictures` say: flexible bodies with contours, rigid bodies
with their shapes, cameras, joints, reactions. The view is not fitted yet. **/
std::unique_ptr<OffscreenVisualizer> makeVisualizer(const Model& model);

/** Refuses pictures that drawFrames() cannot draw, before a run is wasted.
@throws ModelError. **/
void checkPictures(const Model& model);

/** Draws the frames of an analysis as the model's `pictures` say, all with one camera and one
colour range. Existing frames with the same contents are kept.
@param usualFolder  for single pictures if the model names none; must differ between models, so that
    they do not remove each other's pictures
@param rows  of the analysis, for plots; file names include its name if a model has several
@param resumeCommand  shown to the user if the work is stopped
@return where the pictures are, for the user
@throws Cancelled, std::runtime_error. **/
std::string drawFrames(const Model& model, const std::vector<RunCheckpoint::Frame>& frames,
                       const Results::Analysis& rows, const std::string& usualFolder,
                       const Listener& listener, const std::string& resumeCommand);

/** True if the model's `pictures` show equilibria: they are given, and no analysis is transient.
 **/
bool drawsEquilibria(const Model& model);
/** Draws one picture: FOLDER/ANALYSIS.png.
@return where it is, for the user
@throws std::runtime_error. **/
std::string drawState(const Model& model, const SimTK::State& state, const std::string& analysis,
                      const std::string& usualFolder);

/** @throws std::runtime_error unless the name ends in .glb and the file can be written. **/
void checkAnimationName(const std::string& file);

/** Writes the rows of a transient analysis as an animated scene, see
OffscreenVisualizer::writeAnimation(): all rows, or evenly chosen ones if there are more than 1000.
@param rows  with States
@param file  the analysis' name is added if the model has several
@return a description for the user
@throws std::runtime_error. **/
std::string writeAnimation(const Model& model, const Results::Analysis& rows,
                           const std::string& file);

/** The motion of a transient analysis for a report, see OffscreenVisualizer::describeMotion():
exaggerated as in pictures, less, and more.
@param rows  with States **/
std::string describeScene(const Model& model, const Results::Analysis& rows,
                          const Listener& listener);

/** Adds a video at the model's frame rate.
@throws as OffscreenVisualizer::addVideo(). **/
void addVideo(const Model& model, const std::string& file, OffscreenVisualizer& viz);

/** Draws a motion with its plots; camera and colours are fitted to the whole motion.
@return false if the listener stopped it **/
bool drawMotion(const Model& model, const MotionRecorder& motion, const Results::Analysis& rows,
                OffscreenVisualizer& viz, const Listener& listener);

/** Draws an animation of each mode: FOLDER/ANALYSIS_mode_1.gif …; or of each shape of a harmonic
motion, with its title: FOLDER/ANALYSIS_shape_1.gif …
@return where they are, for the user
@throws Cancelled, std::runtime_error. **/
std::string drawModes(const Model& model, const SimTK::State& about,
                      const std::vector<Eigenmode>& modes, const std::string& analysis,
                      const std::string& usualFolder, const Listener& listener);
std::string drawShapes(const Model& model, const SimTK::State& state,
                       const std::vector<Eigenmode>& shapes, const std::vector<std::string>& titles,
                       const std::string& analysis, const std::string& usualFolder,
                       const Listener& listener);

}  // namespace model
}  // namespace simflex
