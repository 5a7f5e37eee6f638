#pragma once
/** @file
Writes a reduced part as standard input data of flexible bodies (SID, .SID_FEM), read by Simpack and
other multibody programs.

Frame: the deck's axes and origin, moving with the mean axes. Taylor series in q = ξ, m0 + m1 q:

    mdCM = m c                  J = I₀ + m(c² 1 − c cᵀ), m1: I₁     (xx yy zz xy xz yz)
    Ct = 0                      Cr: m1(i, j, a) = N_a,ji
    Me = 1                      Gr_i = I₁ᵢ (3 columns a mode)
    Ge(i, 3j + a) = −2 N_a,ij
    Oe(i): −½ I₁xx  −½ I₁yy  −½ I₁zz  −I₁xy  −I₁yz  −I₁xz,  m1: the same of 2 I₂
    Ke = Ω²                     De, ksigma = 0

with c the centre of mass. Geometric stiffness due to rotation is added to m1 of Oe if the part has
it; that due to interface loads is omitted. Per node: origin, phi, psi and the attitude AP = 1 +
[ψ×].

Source: O. Wallrapp, Standardization of flexible body modeling in multibody system codes, part I,
Mechanics of Structures and Machines 22 (1994) 283–304. SI units. **/

#include <string>

#include "simflex/part/MbdynFem.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

/** Writes a part. Nodes are numbered as in writeMbdynFem(). Numbers have 12 digits, as is customary
for the format; zeros are omitted.
@throws std::invalid_argument if body.validate() does.
@throws std::runtime_error if the file cannot be written. **/
void writeSid(const std::string& path, const ReducedBody& body,
              ExchangeNodes nodes = ExchangeNodes::Interfaces);

}  // namespace simflex
