#pragma once
/** @file
Explanations of failures of the equations, for messages (private header); empty: none. **/

#include <string>
#include <vector>

#include "simflex/solver/equations/Evaluation.h"

namespace simflex {

/** Two frames connected by a joint, constraint or force element; frames in Ground have block −1.
Motions are those of the last evaluation. **/
struct Link {
    int blocks[2];
    const FrameMotion* motions[2];
    int numEquations;  ///< none for force elements
};
/** Lists connections between different blocks; for Simbody's constraints, those between two bodies
of rigid trees or Ground. **/
std::vector<Link> listLinks(const Evaluation& equations);

/** "the load on 'boom.B' is not at t = 0.1 s": the source of non-finite numbers. **/
std::string findNonFinite(Evaluation& equations, double time, const double* q, const double* u);
/** "The motion 'drive' jumps by …", if one does within h. **/
std::string findMotionJump(Evaluation& equations, double time, double h, const double* q,
                           const double* u);
/** The largest force on a block, among simflex/forces and Simbody's own elements. **/
std::string findLargestElement(Evaluation& equations, double time, const double* q, const double* u,
                               int block);
std::string findLargestForeignForce(Evaluation& equations, double time, const double* q,
                                    const double* u, int block);
/** Describes a speed without inertia of its own. @pre an evaluation **/
std::string findMassless(Block& block);

}  // namespace simflex
