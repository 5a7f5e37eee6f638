#include "simflex/fmi/FmuUnit.h"

#include <elf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/base/SecondsSince.h"
#include "simflex/base/ZipFile.h"
#include "simflex/fmi/FmuLibrary.h"
#include "simflex/fmi/FmuProcess.h"

namespace simflex {

namespace fs = std::filesystem;

//-------------------------------------------------------------------------------------------------
// the unit

namespace {

/** Returns whether everything that the ELF headers refer to is in the file: the loader does not
check this, and crashes. **/
bool isWholeLibrary(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::uint64_t size = fs::file_size(path);
    const auto isWithin = [&](std::uint64_t begin, std::uint64_t length) {
        return begin <= size && length <= size - begin;
    };
    Elf64_Ehdr header{};
    if (!file.read(reinterpret_cast<char*>(&header), sizeof header) ||
        std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 ||
        header.e_ident[EI_CLASS] != ELFCLASS64 || header.e_machine != EM_X86_64 ||
        header.e_phentsize != sizeof(Elf64_Phdr) || header.e_phnum == 0 ||
        !isWithin(header.e_phoff, std::uint64_t(header.e_phnum) * sizeof(Elf64_Phdr)) ||
        !isWithin(header.e_shoff, std::uint64_t(header.e_shnum) * header.e_shentsize))
        return false;
    std::vector<Elf64_Phdr> segments(header.e_phnum);
    file.seekg(std::streamoff(header.e_phoff));
    file.read(reinterpret_cast<char*>(segments.data()),
              std::streamsize(segments.size() * sizeof(Elf64_Phdr)));
    return file && std::all_of(segments.begin(), segments.end(), [&](const Elf64_Phdr& segment) {
               return segment.p_type != PT_LOAD || isWithin(segment.p_offset, segment.p_filesz);
           });
}

}  // namespace

FmuUnit::FmuUnit(const fs::path& path) : m_path(path.string()) {
    open();
}

void FmuUnit::fail(const std::string& what) const {
    throw std::runtime_error("FMU '" + m_path + "': " + what);
}

void FmuUnit::open() {
    if (!isInputFile(m_path)) fail("there is no such file");
    unpackZip(m_path, m_folder.path());
    try {
        m_description = readFmuDescription(m_folder.path() / "modelDescription.xml");
    } catch (const std::exception& error) {
        fail(error.what());
    }
    if (m_description.needsTool) fail("it runs only with the program that made it");
    const fs::path binaries = m_folder.path() / "binaries",
                   folder = binaries / (m_description.version == 3 ? "x86_64-linux" : "linux64"),
                   library = folder / (m_description.identifier + ".so");
    if (!fs::is_regular_file(library)) {
        std::string others;
        if (fs::is_directory(binaries))
            for (const fs::directory_entry& entry : fs::directory_iterator(binaries))
                others += (others.empty() ? "" : ", ") + entry.path().filename().string();
        fail("it has no library " + folder.filename().string() + '/' + m_description.identifier +
             ".so" + (others.empty() ? "" : "; it is for " + others));
    }
    if (!isWholeLibrary(library))
        fail("its library " + folder.filename().string() + '/' + m_description.identifier +
             ".so is damaged or cut off, or none for this machine");
    m_library = library.string();
}

FmuInstanceSetup FmuUnit::makeSetup(const std::string& name) const {
    return {m_description.version, m_library, (m_folder.path() / "resources").string(),
            m_description.token, name};
}

//-------------------------------------------------------------------------------------------------
// an instance

namespace {

std::unique_ptr<FmuInstanceCalls> makeInstance(const FmuInstanceSetup& setup,
                                               const AllowedCode& code,
                                               const std::function<bool()>& goesOn) {
    switch (code.fmus) {
        case AllowedCode::Fmus::ChildProcess:
            return std::make_unique<FmuProcess>(setup, code.fmuTimeout, goesOn);
        case AllowedCode::Fmus::ThisProcess:
            return std::make_unique<FmuLibrary>(setup);
        default:
            throw std::logic_error("FMUs are not to run");
    }
}

FmuCall makeCall(int kind, const std::string& what, double value = 0, double length = 0) {
    FmuCall call;
    call.kind = kind;
    call.what = what;
    call.value = value;
    call.length = length;
    return call;
}

int roundToWhole(const std::string& name, double value) {
    constexpr double WholeTolerance = 1e-9;  // allows for round-off of computed values
    const double whole = std::round(value);
    if (!(std::abs(value - whole) <= WholeTolerance * std::max(1.0, std::abs(value)) &&
          std::abs(whole) <= double(std::numeric_limits<int>::max())))
        throw std::runtime_error("'" + name + "' of the FMU is a whole number and cannot be " +
                                 writeGeneral(value, 9) + "; floor(x + 0.5) is the nearest one");
    return int(whole);
}

}  // namespace

FmuSlave::FmuSlave(std::shared_ptr<const FmuUnit> unit, const std::string& name,
                   const AllowedCode& code, const std::function<bool()>& goesOn)
    : m_unit(std::move(unit)), m_name(name) {
    try {
        m_instance = makeInstance(m_unit->makeSetup(name), code, goesOn);
    } catch (const Cancelled&) {
        throw;
    } catch (const std::runtime_error& error) {
        fail(error.what());
    }
}

void FmuSlave::fail(const std::string& what) const {
    m_unit->fail("instance '" + m_name + "': " + what);
}

std::vector<FmuAnswer> FmuSlave::ask(const std::vector<FmuCall>& calls) {
    if (calls.empty()) return {};
    const auto start = std::chrono::steady_clock::now();
    FmuReply reply;
    try {
        reply = m_instance->ask(calls);
    } catch (const Cancelled&) {
        throw;
    } catch (const std::runtime_error& error) {
        fail(error.what());
    }
    ++m_cost.exchanges;
    m_cost.seconds += secondsSince(start);
    m_cost.librarySeconds += reply.seconds;
    if (!reply.error.empty()) fail(reply.error);
    reply.answers.resize(calls.size());
    return reply.answers;
}

void FmuSlave::enterInitialization(double time) {
    ask({makeCall(FmuCall::EnterInitialization, "initialization", time)});
}

void FmuSlave::exitInitialization() {
    ask({makeCall(FmuCall::ExitInitialization, "initialization")});
}

void FmuSlave::reset() {
    ask({makeCall(FmuCall::Reset, "the reset")});
}

const FmuVariable& FmuSlave::findVariable(const std::string& name) const {
    const FmuVariable* const variable = m_unit->getDescription().find(name);
    if (!variable) fail("there is no variable '" + name + "'");
    if (variable->isArray || variable->type == FmuVariable::Type::Other)
        fail("variable '" + name + "' is " +
             (variable->isArray ? "an array" : "of type " + variable->typeText) +
             "; real numbers, whole ones and booleans are known");
    return *variable;
}

std::vector<FmuCall> FmuSlave::makeSets(
    const std::vector<std::pair<std::string, double>>& values) const {
    std::vector<FmuCall> calls;
    for (const auto& [name, value] : values) {
        const FmuVariable& variable = findVariable(name);
        FmuCall call = makeCall(FmuCall::SetReal, "setting '" + name + "'", value);
        call.reference = variable.reference;
        if (variable.type == FmuVariable::Type::Integer) {
            call.kind = FmuCall::SetInteger;
            call.value = roundToWhole(name, value);
        } else if (variable.type == FmuVariable::Type::Boolean) {
            call.kind = FmuCall::SetBoolean;
            call.value = value > 0.5;
        }
        calls.push_back(call);
    }
    return calls;
}

std::vector<FmuCall> FmuSlave::makeGets(const std::vector<std::string>& names) const {
    std::vector<FmuCall> calls;
    for (const std::string& name : names) {
        const FmuVariable& variable = findVariable(name);
        FmuCall call = makeCall(variable.type == FmuVariable::Type::Real      ? FmuCall::GetReal
                                : variable.type == FmuVariable::Type::Integer ? FmuCall::GetInteger
                                                                              : FmuCall::GetBoolean,
                                "reading '" + name + "'");
        call.reference = variable.reference;
        calls.push_back(call);
    }
    return calls;
}

void FmuSlave::set(const std::vector<std::pair<std::string, double>>& values) {
    ask(makeSets(values));
}

std::vector<double> FmuSlave::get(const std::vector<std::string>& variables) {
    std::vector<double> values;
    for (const FmuAnswer& answer : ask(makeGets(variables))) values.push_back(answer.value);
    return values;
}

bool FmuSlave::doStep(double time, double length) {
    return ask({makeCall(FmuCall::DoStep, "a step", time, length)})[0].value != 0;
}

std::optional<FmuSlave::Sample> FmuSlave::sample(
    const std::vector<std::pair<std::string, double>>& inputs, double time, double length,
    const std::vector<std::string>& outputs, bool saves) {
    std::vector<FmuCall> calls = makeSets(inputs);
    calls.push_back(makeCall(FmuCall::DoStep, "a step", time, length));
    const size_t numBefore = calls.size();
    for (const FmuCall& call : makeGets(outputs)) calls.push_back(call);
    if (saves) calls.push_back(makeCall(FmuCall::Save, "saving"));
    const std::vector<FmuAnswer> answers = ask(calls);
    if (answers[numBefore - 1].value == 0) return {};
    Sample sample;
    for (size_t i = 0; i < outputs.size(); ++i)
        sample.outputs.push_back(answers[numBefore + i].value);
    if (saves) sample.memory = answers.back().bytes;
    return sample;
}

std::string FmuSlave::save() {
    return ask({makeCall(FmuCall::Save, "saving")})[0].bytes;
}

void FmuSlave::restore(const std::string& bytes) {
    FmuCall call = makeCall(FmuCall::Restore, "restoring");
    call.bytes = bytes;
    ask({call});
}

}  // namespace simflex
