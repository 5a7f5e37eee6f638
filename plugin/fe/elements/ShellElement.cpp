#include "ShellElement.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

namespace simflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

const double Gauss2 = 1 / std::sqrt(3.0), Gauss3 = std::sqrt(0.6);
/** Distance of the inner tying points of MITC3+ from the centroid, as published. **/
constexpr double InnerTying = 1e-4;
/** Limit of c₁² + c₂², above which a quadrilateral is nearly triangular or concave; MITC4+ divides
by 1 − c₁² − c₂². **/
constexpr double NearlyTriangular = 0.8;

Matrix6d toLawMatrix(const ElasticMatrix& law) {
    return Eigen::Map<const Matrix6d>(law[0].data());  // symmetric
}

/** Returns the engineering strain of the tensor ½(a bᵀ + b aᵀ). **/
Vector6d calcDyad(const Vector3d& a, const Vector3d& b) {
    Vector6d v;
    v << a[0] * b[0], a[1] * b[1], a[2] * b[2], a[0] * b[1] + a[1] * b[0],
        a[0] * b[2] + a[2] * b[0], a[1] * b[2] + a[2] * b[1];
    return v;
}

/** Transverse shear strain relative to its energy mean, ∫G f² = ∫G f: a parabola in each layer. **/
class ShearProfile {
public:
    /** @param n  normal; a, b: orthonormal basis of the plane **/
    ShearProfile(const std::vector<ShellLayer>& layers, const Vector3d& n, const Vector3d& a,
                 const Vector3d& b) {
        // Means over the directions in the plane, independent of a.
        double stiffness = 0, moment = 0;
        for (const ShellLayer& layer : layers) {
            const Matrix6d D = toLawMatrix(layer.law);
            const Vector6d nn = calcDyad(n, n), Dn = D * nn;
            const Matrix6d plane = D - Dn * Dn.transpose() / Dn.dot(nn);
            const Vector6d aa = calcDyad(a, a), bb = calcDyad(b, b), ab = calcDyad(a, b);
            const Vector6d an = calcDyad(a, n), bn = calcDyad(b, n);
            const double E = (3 * aa.dot(plane * aa) + 3 * bb.dot(plane * bb) +
                              2 * aa.dot(plane * bb) + 4 * ab.dot(plane * ab)) /
                             8;
            const double G = 0.5 * (an.dot(plane * an) + bn.dot(plane * bn));
            m_parts.push_back({layer.from, layer.to, E, G, 0});
            stiffness += E * (layer.to - layer.from);
            moment += 0.5 * E * (layer.to * layer.to - layer.from * layer.from);
        }
        m_neutral = moment / stiffness;
        double q = 0, sum = 0, energy = 0;
        for (Part& part : m_parts) {
            part.start = q;
            const double mean = integrate(part, 1) / (part.to - part.from);
            sum += mean * (part.to - part.from) * part.G;
            energy += integrate(part, 2) * part.G;
            q = part.G * calcAt(part, part.to);
        }
        m_scale = sum / energy;
    }

    double calc(size_t layer, double zeta) const { return calcAt(m_parts[layer], zeta) * m_scale; }

    /** Returns the root mean square of f over a layer. **/
    double calcMean(size_t layer) const {
        const Part& part = m_parts[layer];
        return m_scale * std::sqrt(integrate(part, 2) / (part.to - part.from));
    }

private:
    struct Part {
        double from, to, E, G, start;
    };

    double calcAt(const Part& part, double zeta) const {
        const double a = part.from - m_neutral, b = zeta - m_neutral;
        return (part.start - 0.5 * part.E * (b * b - a * a)) / part.G;
    }

    double integrate(const Part& part, int power) const {
        const double middle = 0.5 * (part.from + part.to), half = 0.5 * (part.to - part.from);
        double sum = 0;
        for (const double at : {-Gauss3, 0.0, Gauss3})
            sum += (at == 0 ? 8.0 : 5.0) / 9 * std::pow(calcAt(part, middle + half * at), power);
        return sum * half;
    }

    std::vector<Part> m_parts;
    double m_neutral = 0, m_scale = 1;
};

/** Shape functions of the mid-surface and their derivatives. **/
template <int Corners>
struct PlaneShapes {
    Eigen::Matrix<double, Corners, 1> N, N1, N2;

    PlaneShapes(double xi, double eta) {
        if constexpr (Corners == 4) {
            N << (1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta),
                (1 - xi) * (1 + eta);
            N1 << eta - 1, 1 - eta, 1 + eta, -1 - eta;
            N2 << xi - 1, -1 - xi, 1 + xi, 1 - xi;
            N *= 0.25, N1 *= 0.25, N2 *= 0.25;
        } else {
            N << 1 - xi - eta, xi, eta;
            N1 << -1, 1, 0;
            N2 << -1, 0, 1;
        }
    }
};

/** An element. Covariant strains are ordered e₁₁, e₂₂, 2e₁₂, 2e₁₃, 2e₂₃. **/
template <int Corners>
class Shell {
public:
    using Corners3 = Eigen::Matrix<double, 3, Corners>;
    static constexpr int Half = 3 * Corners, Dofs = 6 * Corners;

    Shell(const Corners3& middles, const Corners3& directors, const std::vector<ShellLayer>& layers)
        : m_middles(middles), m_directors(directors), m_layers(layers) {
        setCenter();
        setTies();
        if constexpr (Corners == 4) {
            for (const double eta : {-Gauss2, Gauss2})
                for (const double xi : {-Gauss2, Gauss2}) addPoints(xi, eta, 1);
        } else {
            constexpr double Sixth = 1.0 / 6;
            addPoints(Sixth, Sixth, Sixth);
            addPoints(4 * Sixth, Sixth, Sixth);
            addPoints(Sixth, 4 * Sixth, Sixth);
        }
        m_fromInner = -m_Kaa.ldlt().solve(m_Kau);
    }

    /** Returns the points in terms of midpoints and directors. **/
    std::vector<ElementPoint> makePoints() const {
        std::vector<ElementPoint> points;
        points.reserve(m_points.size() + m_columns.size());
        for (const Point& p : m_points) {
            ElementPoint& point = points.emplace_back();
            const ShellLayer& layer = m_layers[p.layer];
            point.volume = p.volume;
            point.D = layer.law;
            point.density = layer.density;
            point.B.resize(6, Dofs);
            point.B = calcStrainMatrix(p);
            point.N.resize(2 * Corners);
            point.G.resize(3, 2 * Corners);
            const PlaneShapes<Corners> s(p.xi, p.eta);
            const double h = 0.5 * p.zeta;
            for (int k = 0; k < Corners; ++k) {
                const Vector3d g = p.dual.col(0) * s.N1[k] + p.dual.col(1) * s.N2[k];
                point.N[k] = s.N[k];
                point.N[Corners + k] = h * s.N[k];
                point.G.col(k) = g;
                point.G.col(Corners + k) = h * g + 0.5 * s.N[k] * p.dual.col(2);
            }
        }
        addStretches(points);
        return points;
    }

    Eigen::Matrix<double, 6, Dofs> calcStrainMatrix(double xi, double eta, double zeta) const {
        size_t layer = 0;
        while (layer + 1 < m_layers.size() && zeta > m_layers[layer].to) ++layer;
        Point p;
        setPoint(p, Plane(*this, xi, eta), zeta, layer, m_shearProfile->calc(layer, zeta));
        return calcStrainMatrix(p);
    }

private:
    // Quadrilaterals: edges η = ±1 and ξ = ±1, centre, and the bilinear part; four shears.
    // Triangles: three edges; three shears.
    static constexpr int Membranes = Corners == 4 ? 6 : 3,
                         Ties = Membranes + (Corners == 4 ? 4 : 3);
    static constexpr int Inner = Corners == 4 ? 4 : 2;  // enhanced modes, bubble
    using Strain = Eigen::Matrix<double, 5, Dofs>;
    using InnerStrain = Eigen::Matrix<double, 5, Inner>;
    using Row = Eigen::Matrix<double, 1, Dofs>;
    using InnerRow = Eigen::Matrix<double, 1, Inner>;

    /** Quantities common to all points at one (ξ, η). **/
    struct Plane {
        Plane(const Shell& shell, double atXi, double atEta)
            : xi(atXi), eta(atEta), shapes(atXi, atEta) {
            m1 = shell.m_middles * shapes.N1, m2 = shell.m_middles * shapes.N2;
            d1 = shell.m_directors * shapes.N1, d2 = shell.m_directors * shapes.N2;
            d = shell.m_directors * shapes.N;
            const auto ties = calcTies(xi, eta);
            strain.noalias() = ties * shell.m_ties;
            inner.noalias() = ties * shell.m_innerTies;
        }

        double xi, eta;
        PlaneShapes<Corners> shapes;
        Vector3d m1, m2, d1, d2, d;
        Strain strain;  ///< at ζ = 0
        InnerStrain inner;
    };

    struct Point {
        double xi, eta, zeta, volume;
        size_t layer;
        Matrix3d dual;  ///< columns g¹ g² g³
        Strain strain;  ///< covariant
        InnerStrain inner;
        Eigen::Matrix<double, 6, 5> map;  ///< covariant strain → deck's axes
    };

    /** A column of points, at which a director's stretch is measured. **/
    struct Column {
        double xi, eta, volume;
        Vector3d normal;
    };

    void setCenter() {
        constexpr double At = Corners == 4 ? 0 : 1.0 / 3;
        const PlaneShapes<Corners> s(At, At);
        const Vector3d g1 = m_middles * s.N1, g2 = m_middles * s.N2, d = m_directors * s.N;
        Matrix3d J;
        J << g1, g2, 0.5 * d;
        m_centerVolume = J.determinant();
        m_centerDual = J.inverse().transpose();
        // Directions of the bubble, normal to the director.
        const Vector3d a = g1.normalized(), n = g1.cross(g2).normalized(), b = n.cross(a);
        m_bubble.col(0) = d.norm() * (a - d * d.dot(a) / d.squaredNorm()).normalized();
        m_bubble.col(1) = d.cross(m_bubble.col(0)) / d.norm();
        m_shearProfile.emplace(m_layers, n, a, b);
        for (size_t k = 0; k < m_layers.size(); ++k)
            m_shearOfLayers.push_back(m_shearProfile->calcMean(k));
    }

    /** Returns ℓ·Δℓ + k Δk/12 of the arc from node i to node j. A fold, where only one end is
    inclined to the line, is no arc: the less inclined end decides. **/
    Row calcStretch(int i, int j) const {
        const Vector3d l = m_middles.col(j) - m_middles.col(i);
        const double di = m_directors.col(i).norm(), dj = m_directors.col(j).norm();
        const Vector3d ai = m_directors.col(i) / di, aj = m_directors.col(j) / dj;
        const double atI = -ai.dot(l), atJ = aj.dot(l);
        const double k =
            atI * atJ > 0 ? (std::abs(atI) < std::abs(atJ) ? 2 * atI : 2 * atJ) / 12 : 0;
        const Vector3d byMiddle = l + k * (aj - ai);
        Row row = Row::Zero();
        row.template segment<3>(3 * i) = -byMiddle;
        row.template segment<3>(3 * j) = byMiddle;
        row.template segment<3>(Half + 3 * i) = -k / di * (l - ai * ai.dot(l));
        row.template segment<3>(Half + 3 * j) = k / dj * (l - aj * aj.dot(l));
        return row;
    }

    /** Returns 2e_α3 at ζ = 0 from displacements, α = 0 or 1. **/
    Row calcShear(double xi, double eta, int alpha, InnerRow& inner) const {
        const PlaneShapes<Corners> s(xi, eta);
        const auto& slope = alpha == 0 ? s.N1 : s.N2;
        const Vector3d g = 0.5 * m_middles * slope, d = 0.5 * m_directors * s.N;
        Row row;
        for (int k = 0; k < Corners; ++k) {
            row.template segment<3>(3 * k) = slope[k] * d;
            row.template segment<3>(Half + 3 * k) = s.N[k] * g;
        }
        if constexpr (Corners == 3)
            inner = 27 * xi * eta * (1 - xi - eta) * g.transpose() * m_bubble;
        return row;
    }

    /** Computes the strains at the tying points. **/
    void setTies() {
        m_innerTies.setZero();
        if constexpr (Corners == 4) {
            m_ties.row(0) = 0.25 * calcStretch(3, 2);
            m_ties.row(1) = 0.25 * calcStretch(0, 1);
            m_ties.row(2) = 0.25 * calcStretch(1, 2);
            m_ties.row(3) = 0.25 * calcStretch(0, 3);
            m_ties.row(4) = 0.0625 * (calcStretch(0, 2) - calcStretch(3, 1));
            setBilinear();
            InnerRow none;
            m_ties.row(6) = calcShear(0, 1, 0, none);
            m_ties.row(7) = calcShear(0, -1, 0, none);
            m_ties.row(8) = calcShear(1, 0, 1, none);
            m_ties.row(9) = calcShear(-1, 0, 1, none);
        } else {
            m_ties.row(0) = calcStretch(0, 1);
            m_ties.row(1) = calcStretch(0, 2);
            m_ties.row(2) = m_ties.row(0) + m_ties.row(1) - calcStretch(1, 2);
            setTriangleShear();
        }
    }

    /** Computes the ξη term of the membrane strain from the five others: in a plane element the
    same as from displacements. **/
    void setBilinear() {
        const Vector3d warp =
            0.25 * (m_middles.col(0) - m_middles.col(1) + m_middles.col(2) - m_middles.col(3));
        const PlaneShapes<Corners> s(0, 0);
        Eigen::Matrix<double, 3, 2> g;
        g << m_middles * s.N1, m_middles * s.N2;
        const Eigen::Matrix2d metric = g.transpose() * g;
        const Eigen::Vector2d c = metric.inverse() * (g.transpose() * warp);
        if (c.squaredNorm() > NearlyTriangular) {
            m_ties.row(5).setZero();
            for (int k = 0; k < 4; ++k)
                m_ties.row(5).template segment<3>(3 * k) = (k % 2 == 0 ? 0.25 : -0.25) * warp;
            return;
        }
        const double a = c[0], b = c[1];
        m_ties.row(5) = (a * (a - 1) * m_ties.row(0) + a * (a + 1) * m_ties.row(1) +
                         b * (b - 1) * m_ties.row(2) + b * (b + 1) * m_ties.row(3) +
                         4 * a * b * m_ties.row(4)) /
                        (2 * (c.squaredNorm() - 1));
    }

    /** Computes the constant parts of 2e₁₃ and 2e₂₃ and their common linear part. **/
    void setTriangleShear() {
        constexpr double Third = 1.0 / 3, Sixth = 1.0 / 6, D = InnerTying;
        constexpr struct {
            double xi, eta;
            int alpha, into;
            double weight;
        } Samples[] = {{2 * Third, Sixth, 0, 0, 2 * Third}, {2 * Third, Sixth, 1, 0, -Third},
                       {Sixth, Sixth, 0, 0, Third},         {Sixth, Sixth, 1, 0, Third},
                       {Sixth, 2 * Third, 1, 1, 2 * Third}, {Sixth, 2 * Third, 0, 1, -Third},
                       {Sixth, Sixth, 0, 1, Third},         {Sixth, Sixth, 1, 1, Third},
                       {Third + D, Third + D, 0, 2, 1},     {Third + D, Third - 2 * D, 0, 2, -1},
                       {Third + D, Third + D, 1, 2, -1},    {Third - 2 * D, Third + D, 1, 2, 1}};
        m_ties.template bottomRows<3>().setZero();
        for (const auto& sample : Samples) {
            InnerRow inner = InnerRow::Zero();
            m_ties.row(3 + sample.into) +=
                sample.weight * calcShear(sample.xi, sample.eta, sample.alpha, inner);
            m_innerTies.row(3 + sample.into) += sample.weight * inner;
        }
    }

    /** Strain at ζ = 0 = ties × strains at the tying points. **/
    static Eigen::Matrix<double, 5, Ties> calcTies(double xi, double eta) {
        Eigen::Matrix<double, 5, Ties> T = Eigen::Matrix<double, 5, Ties>::Zero();
        if constexpr (Corners == 4) {
            T(0, 0) = T(3, 6) = 0.5 * (1 + eta);
            T(0, 1) = T(3, 7) = 0.5 * (1 - eta);
            T(1, 2) = T(4, 8) = 0.5 * (1 + xi);
            T(1, 3) = T(4, 9) = 0.5 * (1 - xi);
            T.row(2).template head<6>() << 0.5 * xi, -0.5 * xi, 0.5 * eta, -0.5 * eta, 2,
                2 * xi * eta;
            T(0, 5) = eta * eta - 1;
            T(1, 5) = xi * xi - 1;
        } else {
            T(0, 0) = T(1, 1) = T(2, 2) = T(3, 3) = T(4, 4) = 1;
            T(3, 5) = eta - 1.0 / 3;
            T(4, 5) = 1.0 / 3 - xi;
        }
        return T;
    }

    void setPoint(Point& p, const Plane& plane, double zeta, size_t layer, double shear) const {
        const double h = 0.5 * zeta;
        const Vector3d g1 = plane.m1 + h * plane.d1, g2 = plane.m2 + h * plane.d2;
        const Vector3d normal = g1.cross(g2);
        p.xi = plane.xi, p.eta = plane.eta, p.zeta = zeta, p.layer = layer;
        p.volume = 0.5 * normal.dot(plane.d);
        if (!(p.volume > 0))
            throw std::invalid_argument(
                "its mid-surface folds over, or its thickness lies in its plane: the Jacobian is " +
                std::to_string(p.volume) + " and must be positive");
        p.dual << g2.cross(plane.d) / (2 * p.volume), plane.d.cross(g1) / (2 * p.volume),
            normal / p.volume;

        // Bending.
        const auto& s = plane.shapes;
        p.strain = plane.strain;
        for (int k = 0; k < Corners; ++k)
            for (int a = 0; a < 3; ++a) {
                const double n1 = h * s.N1[k], n2 = h * s.N2[k];
                const int m = 3 * k + a, d = Half + m;
                p.strain(0, m) += plane.d1[a] * n1;
                p.strain(1, m) += plane.d2[a] * n2;
                p.strain(2, m) += plane.d1[a] * n2 + plane.d2[a] * n1;
                p.strain(0, d) += g1[a] * n1;
                p.strain(1, d) += g2[a] * n2;
                p.strain(2, d) += g1[a] * n2 + g2[a] * n1;
            }
        setInner(p, plane, g1, g2);

        // Transform to the deck's axes, without normal stress.
        const Vector3d a = p.dual.col(0), b = p.dual.col(1), c = p.dual.col(2);
        Eigen::Matrix<double, 6, 5> map;
        map << calcDyad(a, a), calcDyad(b, b), calcDyad(a, b), shear * calcDyad(a, c),
            shear * calcDyad(b, c);
        const Vector6d nn = calcDyad(c, c) / c.squaredNorm();
        const Vector6d Dn = toLawMatrix(m_layers[layer].law) * nn;
        p.map = map - nn * (Dn.transpose() * map / Dn.dot(nn));
    }

    /** Enhanced modes ξ in e₁₁, η in e₂₂, ξ and η in 2e₁₂, transformed from the axes at the centre;
    or the bubble 27 ξη(1−ξ−η). **/
    void setInner(Point& p, const Plane& plane, const Vector3d& g1, const Vector3d& g2) const {
        p.inner = plane.inner;
        const double xi = p.xi, eta = p.eta;
        if constexpr (Corners == 4) {
            const double scale = m_centerVolume / p.volume;
            const double a = plane.m1.dot(m_centerDual.col(0)),
                         b = plane.m1.dot(m_centerDual.col(1)),
                         c = plane.m2.dot(m_centerDual.col(0)),
                         d = plane.m2.dot(m_centerDual.col(1));
            const Vector3d first(a * a, c * c, 2 * a * c), second(b * b, d * d, 2 * b * d),
                mixed(a * b, c * d, a * d + b * c);
            p.inner.template topRows<3>() << scale * xi * first, scale * eta * second,
                scale * xi * mixed, scale * eta * mixed;
        } else {
            const double h = 0.5 * p.zeta, f1 = 27 * h * eta * (1 - 2 * xi - eta),
                         f2 = 27 * h * xi * (1 - xi - 2 * eta);
            p.inner.row(0) = f1 * g1.transpose() * m_bubble;
            p.inner.row(1) = f2 * g2.transpose() * m_bubble;
            p.inner.row(2) = (f2 * g1 + f1 * g2).transpose() * m_bubble;
        }
    }

    /** Adds all points at one (ξ, η) and their contribution to the condensed terms. **/
    void addPoints(double xi, double eta, double weight) {
        const Plane plane(*this, xi, eta);
        Column& column = m_columns.emplace_back();
        column = {xi, eta, 0, plane.m1.cross(plane.m2).normalized()};
        for (size_t layer = 0; layer < m_layers.size(); ++layer) {
            const double middle = 0.5 * (m_layers[layer].from + m_layers[layer].to);
            const double half = 0.5 * (m_layers[layer].to - m_layers[layer].from);
            const Matrix6d D = toLawMatrix(m_layers[layer].law);
            for (const double side : {-Gauss2, Gauss2}) {
                Point& p = m_points.emplace_back();
                setPoint(p, plane, middle + half * side, layer, m_shearOfLayers[layer]);
                p.volume *= weight * half;
                column.volume += p.volume;
                const Eigen::Matrix<double, 6, Inner> Ba = p.map * p.inner;
                const Eigen::Matrix<double, 6, Inner> stress = p.volume * (D * Ba);
                const InnerStrain covariant = p.map.transpose() * stress;
                m_Kaa += Ba.transpose() * stress;
                m_Kau += covariant.transpose() * p.strain;
            }
        }
    }

    Eigen::Matrix<double, 6, Dofs> calcStrainMatrix(const Point& p) const {
        const Strain strain = p.strain + p.inner * m_fromInner;
        return p.map * strain;
    }

    /** Adds d·Δd/d² of the nodes, interpolated by their shape functions: exactly 0 in bending. **/
    void addStretches(std::vector<ElementPoint>& points) const {
        Matrix6d D = Matrix6d::Zero();
        for (const ShellLayer& layer : m_layers)
            D += 0.5 * (layer.to - layer.from) * toLawMatrix(layer.law);
        for (const Column& column : m_columns) {
            ElementPoint& point = points.emplace_back();
            point.volume = column.volume;
            point.N.setZero(2 * Corners);
            point.G.setZero(3, 2 * Corners);
            point.B.setZero(6, Dofs);
            const Vector6d nn = calcDyad(column.normal, column.normal);
            const PlaneShapes<Corners> s(column.xi, column.eta);
            for (int k = 0; k < Corners; ++k) {
                const Vector3d d = m_directors.col(k);
                point.B.template block<6, 3>(0, Half + 3 * k) =
                    nn * (s.N[k] / d.squaredNorm() * d).transpose();
            }
            Eigen::Map<Matrix6d>(point.D[0].data()) = D;
        }
    }

    Corners3 m_middles, m_directors;
    const std::vector<ShellLayer>& m_layers;
    std::optional<ShearProfile> m_shearProfile;
    std::vector<double> m_shearOfLayers;
    double m_centerVolume = 0;
    Matrix3d m_centerDual;
    Eigen::Matrix<double, 3, 2> m_bubble;
    Eigen::Matrix<double, Ties, Dofs> m_ties;
    Eigen::Matrix<double, Ties, Inner> m_innerTies;
    std::vector<Point> m_points;
    std::vector<Column> m_columns;
    Eigen::Matrix<double, Inner, Inner> m_Kaa = Eigen::Matrix<double, Inner, Inner>::Zero();
    Eigen::Matrix<double, Inner, Dofs> m_Kau = Eigen::Matrix<double, Inner, Dofs>::Zero();
    Eigen::Matrix<double, Inner, Dofs> m_fromInner;
};

/** Makes an element between expanded nodes. **/
template <int Corners>
Shell<Corners> makeShell(const Eigen::Matrix3Xd& x, const std::vector<ShellLayer>& layers) {
    const auto low = x.leftCols<Corners>(), top = x.rightCols<Corners>();
    return {0.5 * (low + top), top - low, layers};
}

/** Transforms columns for (Δm, Δd) to those for low and top nodes: Δm = (low + top)/2, Δd = top −
low. **/
template <typename Matrix>
void toExpanded(Matrix& columns) {
    const Eigen::Index half = columns.cols() / 2;
    for (Eigen::Index k = 0; k < half; ++k)
        for (Eigen::Index i = 0; i < columns.rows(); ++i) {
            const double m = 0.5 * columns(i, k), d = columns(i, half + k);
            columns(i, k) = m - d;
            columns(i, half + k) = m + d;
        }
}

}  // namespace

std::vector<ElementPoint> makeShellPoints(const Eigen::Matrix3Xd& x,
                                          const std::vector<ShellLayer>& layers) {
    std::vector<ElementPoint> points =
        x.cols() == 8 ? makeShell<4>(x, layers).makePoints() : makeShell<3>(x, layers).makePoints();
    for (ElementPoint& point : points) {
        auto N = point.N.transpose();
        toExpanded(N);
        toExpanded(point.G);
        toExpanded(point.B);
    }
    return points;
}

std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> calcShellStrainMatrices(
    const Eigen::Matrix3Xd& x, const std::vector<ShellLayer>& layers,
    const std::vector<std::array<double, 3>>& places) {
    std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> strains;
    const auto addAll = [&](const auto& shell) {
        for (const auto& [xi, eta, zeta] : places)
            toExpanded(strains.emplace_back(shell.calcStrainMatrix(xi, eta, zeta)));
    };
    if (x.cols() == 8)
        addAll(makeShell<4>(x, layers));
    else
        addAll(makeShell<3>(x, layers));
    return strains;
}

}  // namespace simflex
