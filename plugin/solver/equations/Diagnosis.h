#pragma once
/** @file
What equations tell of a failure, for messages (private header); empty: nothing to say. **/

#include <string>
#include <vector>

#include "simflex/solver/equations/Evaluation.h"

namespace simflex {

/** Two frames that a joint, a constraint or a force element joins; frames in Ground have block −1.
Motions are those of the last evaluation. **/
struct Link {
    int blocks[2];
    const FrameMotion* motions[2];
    int numEquations;  ///< none for force elements
};
/** Those between different blocks; of Simbody's constraints, those between two bodies of rigid
trees or Ground. **/
std::vector<Link> listLinks(const Evaluation& equations);

/** "the load on 'boom.B' is not at t = 0.1 s": what gives numbers that are not finite. **/
std::string findNonFinite(Evaluation& equations, double time, const double* q, const double* u);
/** "The motion 'drive' jumps by …", if one does within some h. **/
std::string findMotionJump(Evaluation& equations, double time, double h, const double* q,
                           const double* u);
/** The largest force on a block, of simflex/forces and of Simbody's own elements. **/
std::string findLargestElement(Evaluation& equations, double time, const double* q, const double* u,
                               int block);
std::string findLargestForeignForce(Evaluation& equations, double time, const double* q,
                                    const double* u, int block);
/** A speed that moves no mass of its own. @pre an evaluation **/
std::string findMassless(Block& block);

}  // namespace simflex
