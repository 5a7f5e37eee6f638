#pragma once
/** @file
Constants of the three-stage Radau IIA method of order 5 (private header):

    y_i = y_n + h Σ_j a_ij ẏ_j,    ẏ_i = 1/h Σ_j w_ij (y_j − y_n),    W = A⁻¹,    y_{n+1} = y_3

    T⁻¹WT = diag(γ̂, [α̂ −β̂; β̂ α̂]):  the stages' system splits into a real and a complex one.

The embedded formula of order 3 has  ŷ − y_{n+1} = h/γ̂ (ẏ_n + 1/h Σ_i e_i (y_i − y_n)).
Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5 and IV.8. **/

namespace simflex::radau {

constexpr int NumStages = 3;

constexpr double Sqrt6 = 2.449489742783178098197;

constexpr double C[NumStages] = {(4 - Sqrt6) / 10, (4 + Sqrt6) / 10, 1};

constexpr double A[NumStages][NumStages] = {
    {(88 - 7 * Sqrt6) / 360, (296 - 169 * Sqrt6) / 1800, (-2 + 3 * Sqrt6) / 225},
    {(296 + 169 * Sqrt6) / 1800, (88 + 7 * Sqrt6) / 360, (-2 - 3 * Sqrt6) / 225},
    {(16 - Sqrt6) / 36, (16 + Sqrt6) / 36, 1.0 / 9}};

constexpr double W[NumStages][NumStages] = {
    {3.224744871391589049099, 1.167840084690405494924, -0.2531972647421808261859},
    {-3.567840084690405494924, 0.7752551286084109509014, 1.053197264742180826186},
    {5.531972647421808261859, -7.531972647421808261859, 5.0}};

constexpr double RealEigenvalue = 3.637834252744495732208;  // γ̂
constexpr double Alpha = 2.681082873627752133896, Beta = 3.050430199247410569426;

constexpr double T[NumStages][NumStages] = {
    {0.09123239487089294279, -0.14125529502095420843, -0.03002919410514742449},
    {0.24171793270710701896, 0.20412935229379993199, 0.38294211275726193779},
    {0.96604818261509293619, 1, 0}};

constexpr double InverseT[NumStages][NumStages] = {
    {4.325579890063155350967, 0.3391992518158098695448, 0.5417705399358748711888},
    {-4.178718591551904727289, -0.3276828207610623870842, 0.4766235545005504519582},
    {-0.502872634945786876047, 2.571926949855605429216, -0.5960392048282249249738}};

constexpr double E[NumStages] = {-(13 + 7 * Sqrt6) / 3, (-13 + 7 * Sqrt6) / 3, -1.0 / 3};

}  // namespace simflex::radau
