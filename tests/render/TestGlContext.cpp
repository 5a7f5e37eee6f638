#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <thread>

#include "TestParts.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/gl/GlContext.h"

namespace simflex {
namespace {

using namespace test;
using SimTK::Transform;
using SimTK::Vec3;

// Sets an environment variable during its lifetime.
class Environment {
public:
    Environment(const char* variable, const char* value) : name(variable) {
        if (const char* before = std::getenv(name)) former = before, wasSet = true;
        setenv(name, value, 1);
    }
    ~Environment() {
        if (wasSet)
            setenv(name, former.c_str(), 1);
        else
            unsetenv(name);
    }

private:
    const char* name;
    std::string former;
    bool wasSet = false;
};

// Adds every kind of item, light, shadow, ghost and transparency.
void fill(OffscreenVisualizer& viz) {
    SimTK::Vector xi(3, 0.0);
    xi[2] = 0.3;
    viz.addDeformableMesh(makeStill(makeBrickPart(Vec3(1, 0.2, 0.2), 16, 3, 3), xi));
    const SimTK::MobilizedBodyIndex ground(0);
    viz.addDecoration(ground, Vec3(0, 0.5, 0), SimTK::DecorativeSphere(0.2).setColor(SimTK::Red));
    viz.addDecoration(ground, Vec3(0.3, 0.5, 0),
                      SimTK::DecorativeTorus(0.2, 0.05).setColor(SimTK::Blue).setOpacity(0.5));
    viz.addDecoration(ground, Vec3(-0.4, 0.4, 0), SimTK::DecorativeFrame(0.2));
    viz.addDecoration(ground, Transform(),
                      SimTK::DecorativeLine(Vec3(-0.5, 0.2, 0), Vec3(0.5, 0.3, 0)));
    viz.addDecoration(ground, Transform(), SimTK::DecorativePoint(Vec3(-0.5, 0.3, 0)));
    viz.addDecoration(ground, Vec3(-0.2, 0.7, 0), SimTK::DecorativeText("text").setScale(0.1));
}

Image drawWith(const char* implementation) {
    const Environment environment("SIMFLEX_GL", implementation);
    EmptyScene scene;
    OffscreenVisualizer viz(scene.system, 480, 270);
    fill(viz);
    return viz.drawFrame(scene.state);
}

TEST(GlContext, EglAndOsMesaDrawTheSamePicture) {
    const Image osmesa = drawWith("osmesa"), egl = drawWith("egl");
    ASSERT_EQ(osmesa.getNumBytes(), egl.getNumBytes());
    int different = 0;
    for (std::size_t i = 0; i < egl.getNumBytes(); ++i)
        different += std::abs(int(osmesa.getData()[i]) - int(egl.getData()[i])) > 1;
    EXPECT_EQ(different, 0);
}

TEST(GlContext, TwoImplementationsTakeTurnsOnOneThread) {
    EmptyScene scene;
    OffscreenVisualizer a(scene.system, 160, 90), b(scene.system, 160, 90);
    fill(a);
    fill(b);
    Image first, second;
    {
        const Environment environment("SIMFLEX_GL", "osmesa");
        first = a.drawFrame(scene.state);
    }
    {
        const Environment environment("SIMFLEX_GL", "EGL");
        second = b.drawFrame(scene.state);
    }
    for (int i = 0; i < 3; ++i) {
        EXPECT_TRUE(a.drawFrame(scene.state) == first);
        EXPECT_TRUE(b.drawFrame(scene.state) == second);
    }
}

TEST(GlContext, MadeByOneThreadServesAnother) {
    for (const char* implementation : {"osmesa", "egl"}) {
        const Environment environment("SIMFLEX_GL", implementation);
        EmptyScene scene;
        OffscreenVisualizer viz(scene.system, 160, 90);
        fill(viz);
        const Image here = viz.drawFrame(scene.state);
        Image there;
        std::thread([&] { there = viz.drawFrame(scene.state); }).join();
        EXPECT_TRUE(there == here) << implementation;
    }
}

TEST(GlContext, NameIsThatOfTheImplementationAskedFor) {
    {
        const Environment environment("SIMFLEX_GL", "osmesa");
        EXPECT_EQ(OffscreenVisualizer::getContextName(), "OSMesa");
    }
    {
        const Environment environment("SIMFLEX_GL", "egl");
        EXPECT_EQ(OffscreenVisualizer::getContextName(), "EGL");
    }
}

TEST(GlContext, UnknownNameIsRefusedWithTheAllowedOnes) {
    const Environment environment("SIMFLEX_GL", "metal");
    try {
        GlContext::create();
        FAIL();
    } catch (const std::runtime_error& e) {
        EXPECT_NE(std::string(e.what()).find("'metal', allowed is 'osmesa' or 'egl'"),
                  std::string::npos)
            << e.what();
    }
}

// In a separate process, where no library has been loaded yet.
TEST(GlContextDeathTest, MachineWithoutEitherLibraryIsToldBothReasonsAndPackages) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const auto draw = [] {
        setenv("SIMFLEX_OSMESA_LIBRARY", "libOSMesa.missing.so", 1);
        setenv("SIMFLEX_EGL_LIBRARY", "libEGL.missing.so", 1);
        EmptyScene scene;
        OffscreenVisualizer viz(scene.system, 160, 90);
        try {
            viz.drawFrame(scene.state);
            std::exit(0);
        } catch (const std::exception& e) {
            std::fputs(e.what(), stderr);
            std::exit(7);
        }
    };
    EXPECT_EXIT(draw(), testing::ExitedWithCode(7),
                "cannot create an off-screen OpenGL context; osmesa: .*libOSMesa.missing.so.*"
                "Debian package libosmesa6.*; egl: .*libEGL.missing.so.*Debian package libegl1");
}

// Without OSMesa, as with Mesa 25.1 and later, EGL is the automatic fallback.
TEST(GlContextDeathTest, MachineWithoutOsMesaDrawsThroughEgl) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const auto create = [] {
        unsetenv("SIMFLEX_GL");
        setenv("SIMFLEX_OSMESA_LIBRARY", "libOSMesa.missing.so", 1);
        std::fputs(GlContext::create()->getName().c_str(), stderr);
        std::exit(0);
    };
    EXPECT_EXIT(create(), testing::ExitedWithCode(0), "^EGL$");
}

}  // namespace
}  // namespace simflex
