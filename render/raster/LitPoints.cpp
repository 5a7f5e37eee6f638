#include "LitPoints.h"

namespace simflex {
namespace raster {

namespace {

using Lanes = LitPoints::Lanes;

void take(const SimTK::Vec3& v, float* out) {
    for (int k = 0; k < 3; ++k) out[k] = float(v[k]);
}

auto dot(const Lanes* n, const float* v) {
    return n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
}

}  // namespace

Light::Light(const Camera& camera, const FrameStyle& style) {
    take(~camera.X_GC.R() * SimTK::Vec3(style.up), up);
    take(~camera.X_GC.R() * SimTK::Vec3(style.toLight), key);
}

LitPoints::LitPoints() {
    for (int k = 0; k < 3; ++k) {
        normal[k].setConstant(1);
        view[k].setConstant(1);
        base[k].setZero();
    }
    opacity.setConstant(1);
}

void LitPoints::normalize() {
    for (Lanes* v : {normal, view}) {
        const Lanes length = (v[0].square() + v[1].square() + v[2].square() + 1e-30f).rsqrt();
        for (int k = 0; k < 3; ++k) v[k] *= length;
    }
}

void LitPoints::lightSurfaces(const Light& light, int number) {
    normalize();
    const Lanes sky = 0.5f + 0.5f * dot(normal, light.up);
    const Lanes keyed = dot(normal, light.key);
    const Lanes key = keyed.max(0.0f);
    const SimTK::Vec3 fillDirection = SimTK::UnitVec3(-0.75, 0.15, 0.65);
    float fillFrom[3];
    take(fillDirection, fillFrom);
    const Lanes fill = dot(normal, fillFrom).max(0.0f);
    const Lanes head = 0.12f * normal[2].max(0.0f);

    Lanes half[3];
    for (int k = 0; k < 3; ++k) half[k] = view[k] + light.key[k];
    const Lanes size = (half[0].square() + half[1].square() + half[2].square() + 1e-30f).rsqrt();
    Lanes shine =
        (size * (normal[0] * half[0] + normal[1] * half[1] + normal[2] * half[2])).max(0.0f);
    for (int k = 0; k < 4; ++k) shine = shine.square().eval();
    const Lanes facing = normal[0] * view[0] + normal[1] * view[1] + normal[2] * view[2];
    const Lanes away = (1.0f - facing.max(0.0f)).square();
    const Lanes gloss = (keyed >= 0.0f).select(0.22f * shine.cube(), Lanes::Zero().eval()) +
                        0.10f * away.square() * sky;

    constexpr float low[] = {0.20f, 0.19f, 0.18f}, high[] = {0.46f, 0.49f, 0.54f};
    constexpr float ofKey[] = {0.72f, 0.70f, 0.66f}, ofFill[] = {0.10f, 0.12f, 0.15f};
    Lanes color[3];
    for (int k = 0; k < 3; ++k) {
        const Lanes diffuse =
            low[k] + (high[k] - low[k]) * sky + ofKey[k] * key + ofFill[k] * fill + head;
        color[k] = (base[k].square() * diffuse + gloss).sqrt();
    }
    pack(color, Lanes::Ones(), number);
}

void LitPoints::lightGhosts(int number) {
    normalize();
    const Lanes facing =
        (normal[0] * view[0] + normal[1] * view[1] + normal[2] * view[2]).max(0.0f);
    Lanes color[3];
    for (int k = 0; k < 3; ++k) color[k] = base[k] * (0.75f + 0.25f * facing);
    pack(color, opacity * (0.45f + 1.6f * (1.0f - facing).square()), number);
}

void LitPoints::pack(const Lanes* color, const Lanes& alpha, int number) {
    Eigen::Array<std::int32_t, most, 1> bytes[4];
    for (int k = 0; k < 4; ++k) {
        const Lanes& value = k < 3 ? color[k] : alpha;
        bytes[k] = (value.max(0.0f).min(1.0f) * 255.0f + 0.5f).cast<std::int32_t>();
    }
    const Eigen::Array<std::int32_t, most, 1> packed = bytes[0] + 256 * bytes[1] + 65536 * bytes[2];
    for (int i = 0; i < number; ++i)
        colors[i] = std::uint32_t(packed[i]) | std::uint32_t(bytes[3][i]) << 24;
}

}  // namespace raster
}  // namespace simflex
