/** @file
Integrator checkpoints: changed bytes, with or without a matching checksum. An accepted one is
written back identically, and the integration continues or reports why it cannot. **/

#include <sstream>

#include "Fuzz.h"
#include "FuzzArchive.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "support/PointMassPart.h"

using namespace simflex;
using namespace SimTK;

namespace {

/** A flexible boom on a ball joint above a stop, and a slider with a handler. **/
struct Model {
    class Wall : public TriggeredEventHandler {
    public:
        explicit Wall(const MobilizedBody& stone)
            : TriggeredEventHandler(Stage::Position), m_stone(stone) {}
        Real getValue(const State& state) const override {
            return m_stone.getOneQ(state, 0) - 0.05;
        }
        void handleEvent(State& state, Real, bool&) const override {
            m_stone.setOneU(state, 0, -m_stone.getOneU(state, 0));
        }

    private:
        const MobilizedBody& m_stone;
    };

    Model()
        : matter(system),
          forces(system),
          gravity(forces, matter, -ZAxis, 9.81),
          flexible(system, matter),
          boom(flexible, makePart(), "boom"),
          stone(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))) {
        Joint::Ball(flexible, matter.Ground(), boom.interface("A"), "root");
        ContactStop(flexible, Attachment(matter.Ground(), Transform(Vec3(0, 0, -0.03))),
                    boom.interface("B"), 3e4, 0.1);
        system.addEventHandler(new Wall(stone));
        state = system.realizeTopology();
        boom.setPoseByInterface(state, "A", Transform());
        stone.setOneU(state, 0, 1.3);
    }
    static std::shared_ptr<const ReducedBody> makePart() {
        test::PointMassPartOptions options;
        options.numModes = 3;
        options.cells = {1, 1, 1};
        options.highestFrequency = 80;
        return test::makePointMassPart(options).body;
    }
    enum Method { Bdf, GeneralizedAlpha, Radau };
    std::unique_ptr<ImplicitIntegrator> make(Method method) const {
        std::unique_ptr<ImplicitIntegrator> integrator;
        if (method == GeneralizedAlpha)
            integrator = std::make_unique<GeneralizedAlphaIntegrator>(system);
        else if (method == Radau)
            integrator = std::make_unique<RadauIntegrator>(system);
        else
            integrator = std::make_unique<BdfIntegrator>(system);
        integrator->setAccuracy(1e-3);
        integrator->setNumThreads(1);
        return integrator;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    FlexibleBody boom;
    MobilizedBody::Slider stone;
    State state;
};

std::string write(ImplicitIntegrator& integrator) {
    std::ostringstream out;
    integrator.writeCheckpoint(out);
    return out.str();
}

void read(ImplicitIntegrator& integrator, const std::string& bytes, const State& start) {
    std::istringstream in(bytes);
    integrator.readCheckpoint(in, start);
}

}  // namespace

/** A byte of choices: method (bits 1 and 8), header repaired (2), file truncated (4); then
positions (2 bytes) and values. **/
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Model model;
    const auto run = [](Model::Method method) {
        const auto integrator = model.make(method);
        integrator->initialize(model.state);
        for (int k = 0; k < 5; ++k) integrator->stepOnce();
        return write(*integrator);
    };
    static const std::string wholes[] = {run(Model::Bdf), run(Model::GeneralizedAlpha),
                                         run(Model::Radau)};
    const unsigned mode = size > 0 ? data[0] : 0;
    const Model::Method method = mode & 1   ? Model::GeneralizedAlpha
                                 : mode & 8 ? Model::Radau
                                            : Model::Bdf;
    const std::string& whole = wholes[method];
    std::string bytes = whole;
    for (size_t k = 1; k + 2 < size; k += 3)
        bytes[(256u * data[k] + data[k + 1]) % bytes.size()] = char(data[k + 2]);
    if (mode & 4) bytes.resize(bytes.size() * (mode >> 3) / 32);
    if (mode & 2) fuzz::mendArchive(bytes);

    const auto integrator = model.make(method);
    if (!fuzz::accepts([&] { read(*integrator, bytes, model.state); }, fuzz::Names::Anything))
        return 0;
    if (!(mode & 2) && bytes != whole) fuzz::fail("a damaged checkpoint was accepted");
    const std::string written = write(*integrator);
    const auto other = model.make(method);
    read(*other, written, model.state);
    if (write(*other) != written) fuzz::fail("a checkpoint that was written reads back as another");
    fuzz::accepts([&] { integrator->stepOnce(); }, fuzz::Names::Anything);
    return 0;
}
