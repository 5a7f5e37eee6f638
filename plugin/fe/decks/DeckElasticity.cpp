#include "DeckElasticity.h"

#include <cmath>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

/** Smaller relative moduli count as zero. **/
constexpr double NoModulus = 1e-12;

[[noreturn]] void refuse(const DeckCard& card, const std::string& why) {
    throw std::invalid_argument(card.where() + card.title + ": " + why);
}

/** Reads the constants of the first temperature, `perLine` of each line; missing ones are zero. **/
std::vector<double> readConstants(const DeckCard& card, const std::vector<size_t>& perLine) {
    if (card.data.size() < perLine.size())
        refuse(card, "has " + std::to_string(card.data.size()) + " lines of constants, needs " +
                         std::to_string(perLine.size()));
    std::vector<double> constants;
    for (size_t line = 0; line < perLine.size(); ++line)
        for (size_t k = 0; k < perLine[line]; ++k) {
            const auto& fields = card.data[line].fields;
            constants.push_back(k < fields.size() && !fields[k].empty()
                                    ? parseDeckNumber(fields[k], card.where(card.data[line].line))
                                    : 0.0);
        }
    return constants;
}

ElasticMatrix makeOrthotropic(const std::array<double, 9>& c) {
    ElasticMatrix D{};
    D[0][0] = c[0];
    D[0][1] = D[1][0] = c[1];
    D[1][1] = c[2];
    D[0][2] = D[2][0] = c[3];
    D[1][2] = D[2][1] = c[4];
    D[2][2] = c[5];
    for (size_t k = 0; k < 3; ++k) D[3 + k][3 + k] = c[6 + k];
    return D;
}

ElasticMatrix makeIsotropic(const DeckCard& card) {
    const auto c = readConstants(card, {2});
    const double E = c[0], nu = c[1];
    if (!(E > 0) || !(nu > -1 && nu < 0.5))
        refuse(card, "E = " + writeGeneral(E, 6) + ", ν = " + writeGeneral(nu, 6) +
                         "; a solid has E > 0 and −1 < ν < 0.5");
    const double lambda = E * nu / ((1 + nu) * (1 - 2 * nu)), mu = E / (2 * (1 + nu)),
                 M = lambda + 2 * mu;
    return makeOrthotropic({M, lambda, M, lambda, lambda, M, mu, mu, mu});
}

/** E₁ E₂ E₃ ν₁₂ ν₁₃ ν₂₃ G₁₂ G₁₃ | G₂₃; ν_ij = −ε_jj/ε_ii under σ_ii. **/
ElasticMatrix makeFromEngineeringConstants(const DeckCard& card) {
    const auto c = readConstants(card, {8, 1});
    for (const size_t k : {0, 1, 2, 6, 7, 8})
        if (!(c[k] > 0)) refuse(card, "its moduli must be positive");
    const double nu12 = c[3], nu13 = c[4], nu23 = c[5], nu21 = nu12 * c[1] / c[0],
                 nu31 = nu13 * c[2] / c[0], nu32 = nu23 * c[2] / c[1],
                 rest = 1 - nu12 * nu21 - nu23 * nu32 - nu31 * nu13 - 2 * nu21 * nu32 * nu13;
    if (!(rest > 0)) refuse(card, "its Poisson's ratios make no solid");
    return makeOrthotropic({c[0] * (1 - nu23 * nu32) / rest, c[0] * (nu21 + nu31 * nu23) / rest,
                            c[1] * (1 - nu13 * nu31) / rest, c[0] * (nu31 + nu21 * nu32) / rest,
                            c[1] * (nu32 + nu12 * nu31) / rest, c[2] * (1 - nu12 * nu21) / rest,
                            c[6], c[7], c[8]});
}

/** E₁ E₂ ν₁₂ G₁₂ G₁₃ G₂₃ of a shell, whose E₃ and Poisson's ratios across do not matter. **/
ElasticMatrix makeLamina(const DeckCard& card) {
    const auto c = readConstants(card, {6});
    for (const size_t k : {0, 1, 3, 4, 5})
        if (!(c[k] > 0)) refuse(card, "its moduli must be positive");
    const double rest = 1 - c[2] * c[2] * c[1] / c[0];
    if (!(rest > 0)) refuse(card, "its Poisson's ratio makes no solid");
    return makeOrthotropic(
        {c[0] / rest, c[2] * c[1] / rest, c[1] / rest, 0, 0, c[1], c[3], c[4], c[5]});
}

/** Columns of the upper triangle, 21 constants. **/
ElasticMatrix makeAnisotropic(const DeckCard& card) {
    const auto c = readConstants(card, {8, 8, 5});
    ElasticMatrix D{};
    size_t next = 0;
    for (size_t column = 0; column < 6; ++column)
        for (size_t row = 0; row <= column; ++row) D[row][column] = D[column][row] = c[next++];
    return D;
}

/** Checks that D = L Lᵀ exists. **/
ElasticMatrix checkIsPositive(const DeckCard& card, const ElasticMatrix& D) {
    ElasticMatrix L{};
    for (size_t j = 0; j < 6; ++j) {
        double rest = D[j][j];
        for (size_t k = 0; k < j; ++k) rest -= L[j][k] * L[j][k];
        if (!(rest > NoModulus * D[j][j]))
            refuse(card,
                   "its constants make no solid: some strain has no stiffness (their matrix is not "
                   "positive definite); are all of them there?");
        L[j][j] = std::sqrt(rest);
        for (size_t i = j + 1; i < 6; ++i) {
            L[i][j] = D[i][j];
            for (size_t k = 0; k < j; ++k) L[i][j] -= L[i][k] * L[j][k];
            L[i][j] /= L[j][j];
        }
    }
    return D;
}

}  // namespace

ElasticMatrix parseElasticLaw(const DeckCard& elastic) {
    const std::string type = elastic.has("TYPE") ? elastic.get("TYPE").substr(0, 3) : "ISO";
    if (type == "ISO") return makeIsotropic(elastic);
    if (type == "ENG") return makeFromEngineeringConstants(elastic);
    if (type == "ORT") {
        const auto c = readConstants(elastic, {8, 1});
        std::array<double, 9> constants{};
        for (size_t k = 0; k < 9; ++k) constants[k] = c[k];
        return checkIsPositive(elastic, makeOrthotropic(constants));
    }
    if (type == "LAM") return makeLamina(elastic);
    if (type == "ANI") return checkIsPositive(elastic, makeAnisotropic(elastic));
    refuse(elastic,
           "TYPE=" + elastic.get("TYPE") +
               " is not known; known are ISO, ENGINEERING CONSTANTS, LAMINA, ORTHO and ANISO");
}

Orientation parseOrientation(const DeckCard& orientation) {
    const char system = orientation.has("SYSTEM") ? orientation.get("SYSTEM")[0] : 'R';
    if (system != 'R' && system != 'C')
        refuse(orientation, "SYSTEM=" + orientation.get("SYSTEM") +
                                " is not known; known are RECTANGULAR and CYLINDRICAL");
    const auto c = readConstants(orientation, {6});
    const Vec3d a = {c[0], c[1], c[2]}, b = {c[3], c[4], c[5]};
    if (system == 'C') {
        if (!(normOf(minus(b, a)) > 0)) refuse(orientation, "its two points are the same");
        return Orientation::makeCylindrical(a, b);
    }
    if (!(normOf(cross(a, b)) > 0)) refuse(orientation, "its two points lie on one line");
    const Vec3d e1 = scaled(a, 1 / normOf(a)), inPlane = sumOf(b, -dot(b, e1), e1),
                e2 = scaled(inPlane, 1 / normOf(inPlane));
    const Vec3d e[3] = {e1, e2, cross(e1, e2)};
    if (orientation.data.size() < 2) return {e[0], e[1], e[2]};

    // Additional rotation about one of the local axes, in degrees.
    const DeckLine& line = orientation.data[1];
    const std::string where = orientation.where(line.line);
    const int axis = parseDeckInteger(line.fields[0], where);
    if (axis < 1 || axis > 3) refuse(orientation, "the axis of its rotation must be 1, 2 or 3");
    const double angle =
        (line.fields.size() > 1 ? parseDeckNumber(line.fields[1], where) : 0) * M_PI / 180;
    Vec3d turned[3];
    for (size_t k = 0; k < 3; ++k) {
        const Vec3d &p = e[axis - 1], side = cross(p, e[k]);
        for (size_t i = 0; i < 3; ++i)
            turned[k][i] = std::cos(angle) * e[k][i] + std::sin(angle) * side[i] +
                           (1 - std::cos(angle)) * dot(p, e[k]) * p[i];
    }
    return {turned[0], turned[1], turned[2]};
}

}  // namespace simflex
