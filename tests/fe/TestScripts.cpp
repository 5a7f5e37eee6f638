/** @file
Capabilities of Gmsh scripts; meshes and CAD files must not act as scripts. **/

#include <gmock/gmock.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/base/ChildProcess.h"
#include "simflex/base/Sandbox.h"
#include "simflex/fe/ModelSource.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr const char* kBox =
    "SetFactory(\"OpenCASCADE\");\n"
    "Box(1) = {0, 0, 0, 0.06, 0.02, 0.01};\n"
    "Physical Volume(\"BODY\") = {1};\n";
constexpr const char* kHint =
    "\n  (A script reads only files of its own folder that it names plainly, Include \"NAME\"; and "
    "writes none. --allow-scripts lets it do anything.)";

class Scripts : public ::testing::Test {
protected:
    Scripts() { fs::create_directory(folder / "model"); }

    std::string write(const std::string& name, const std::string& text) {
        testing::writeText(folder / ("model/" + name), text);
        return folder / ("model/" + name);
    }

    SourceOptions optionsOf(const std::string& path) const {
        SourceOptions options;
        options.path = path;
        options.material = "steel";
        options.gmsh.meshSize = 0.02;
        return options;
    }

    /** Returns the error or result of reading. **/
    std::string read(const SourceOptions& options) {
        std::string message = "accepted";
        try {
            readModelSource(options);
        } catch (const std::exception& error) {
            message = error.what();
        }
        EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
        return message;
    }

    /** Reads a box whose script continues with `more`. **/
    std::string readScript(const std::string& more) {
        return read(optionsOf(write("box.geo", kBox + more)));
    }

    std::vector<std::string> listModel() const { return testing::listFiles(folder / "model"); }

    testing::TestFolder folder;
};

/** Tests that need the sandbox. **/
class ShieldedScripts : public Scripts {
protected:
    void SetUp() override {
        if (!findSandboxObstacle().empty()) GTEST_SKIP() << findSandboxObstacle();
    }
};

TEST_F(ShieldedScripts, MeshAndReadTheirOwnFiles) {
    write("size.txt", "Include \"deep/more.txt\";\n");
    fs::create_directory(folder / "model/deep");
    write("deep/more.txt", "length = 0.06;\n");
    EXPECT_EQ(readScript("Include \"size.txt\";\nPoint(99) = {length, 0, 0};\n"), "accepted");
}

TEST_F(ShieldedScripts, StartNoPrograms) {
    write("helper.txt", "SystemCall \"touch 'OWNED'\";\n");
    const std::string owned = folder / "model/OWNED";
    const std::string refusal = folder / "model/box.geo" +
                                ": Gmsh could not mesh the part:\n    Error   : Could not find "
                                "/bin/sh: aborting system call" +
                                kHint;
    EXPECT_EQ(readScript("SystemCall \"touch '" + owned + "'\";\n"), refusal);
    EXPECT_EQ(readScript("NonBlockingSystemCall \"touch '" + owned + "'\";\n"), refusal);
    EXPECT_EQ(readScript("Include \"helper.txt\";\n"), refusal);
    EXPECT_THAT(readScript("OnelabRun(\"x\", \"touch '" + owned + "'\");\n"), HasSubstr("socket"));
    EXPECT_THAT(listModel(), ElementsAre("box.geo", "helper.txt"));
}

TEST_F(ShieldedScripts, ReadNoFilesButThoseTheyName) {
    write("helper.txt", "SystemCall \"touch OWNED\";\n");
    testing::writeText(folder / "outside.txt", "length = 1;\n");
    fs::create_symlink(folder / "outside.txt", folder / "model/link.txt");
    const auto refusalOf = [&](const std::string& file) {
        return folder / "model/box.geo" +
               ": Gmsh could not mesh the part:\n    Error   : Unable to open file '" + file + "'" +
               kHint;
    };
    EXPECT_EQ(readScript("Include StrCat(\"./he\",\"lper.txt\");\n"),
              refusalOf(folder / "model/./helper.txt"));
    EXPECT_EQ(readScript("Include \"/etc/passwd\";\n"), refusalOf("/etc/passwd"));
    EXPECT_EQ(readScript("Include \"../outside.txt\";\n"),
              refusalOf(folder / "model/../outside.txt"));
    EXPECT_EQ(readScript("Include \"link.txt\";\n"), refusalOf(folder / "model/link.txt"));
}

TEST_F(ShieldedScripts, WriteNoFiles) {
    for (const std::string& target :
         {folder / "model/OUT", folder / "OUT", folder / "model/box.geo"})
        for (const char* statement : {"Printf(\"x\") > ", "Printf(\"x\") >> ", "Save "})
            EXPECT_THAT(
                readScript(statement + ("\"" + target) + ".msh\";\n"),
                AllOf(HasSubstr("Unable to open file '" + target), ::testing::EndsWith(kHint)));
    EXPECT_THAT(listModel(), ElementsAre("box.geo"));
    EXPECT_FALSE(fs::exists(folder / "OUT"));
}

/** A script can write the mesh itself, which must not read what the script may not. **/
TEST_F(ShieldedScripts, WriteNoMeshThatReadsFiles) {
    const std::string outside = folder / "outside.txt";
    testing::writeText(outside, "*NSET, NSET=SECRET\n1\n");
    for (const std::string& include : {"*INCLUDE, INPUT=" + outside, "* include,\ninput=" + outside,
                                       "*NSET, NSET=A\n\"*INCLUDE\", INPUT=" + outside}) {
        std::string script = "f = Str(StrCat(GetEnv(\"HOME\"), \"/mesh.inp\"));\n";
        std::istringstream lines(
            "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT, TYPE=C3D4, ELSET=V\n"
            "1,1,2,3,4\n" +
            include);
        for (std::string line; std::getline(lines, line);)
            script += "Printf('" + line + "') >> Str(f);\n";
        EXPECT_THAT(read(optionsOf(write("box.geo", script + "Exit;\n"))),
                    AllOf(HasSubstr("*INCLUDE: a mesh that another program wrote includes no file"),
                          Not(HasSubstr("SECRET"))))
            << include;
    }
}

TEST_F(ShieldedScripts, OptionsBesideAScriptAreAScript) {
    write("box.geo.opt", "SystemCall \"touch OWNED\";\n");
    EXPECT_THAT(readScript(""), HasSubstr("Could not find /bin/sh"));
}

TEST_F(Scripts, DoAnythingWhereTheyAreAllowedTo) {
    write("helper.txt", "SystemCall \"touch '" + folder / "model/RAN" + "'\";\n");
    SourceOptions options =
        optionsOf(write("box.geo", kBox + std::string("Include StrCat(\"./he\",\"lper.txt\");\n"
                                                      "Printf(\"x\") > \"OUT\";\n")));
    options.gmsh.allowsScripts = true;
    EXPECT_EQ(read(options), "accepted");
    EXPECT_THAT(listModel(), ElementsAre("OUT", "RAN", "box.geo", "helper.txt"));
}

TEST_F(Scripts, ConstantsThatTheyDoNotHaveAreRefused) {
    write("size.txt", "DefineConstant[ width = {0.02, Name \"Size/width\"} ];\n");
    SourceOptions options =
        optionsOf(write("box.geo", "Include \"size.txt\";\n" + std::string(kBox)));
    options.gmsh.allowsScripts = true;
    for (const std::string name : {"widt", "WIDTH", "width2", "Volum"}) {
        options.gmsh.settings = {{name, 0.03}};
        EXPECT_THAT(read(options), HasSubstr("has no constant '" + name + "'")) << name;
    }
    options.gmsh.settings = {{"widt", 0.03}};
    EXPECT_THAT(read(options), HasSubstr("did you mean 'width'?"));
    options.gmsh.settings = {{"width", 0.03}, {"Size/width", 0.03}, {"Mesh.Algorithm3D", 1}};
    EXPECT_EQ(read(options), "accepted");
    options.gmsh.settings = {{"width", std::nan("")}};
    EXPECT_THAT(read(options), HasSubstr("is not finite"));
}

TEST_F(Scripts, ThatNeverEndAreKilledOnRequest) {
    SourceOptions options = optionsOf(
        write("box.geo", "For i In {1:2}\n For j In {1:1000000000}\n  x = j;\n EndFor\nEndFor\n"));
    int calls = 0;
    options.calculix.progress = [&](const std::string&, double) { return ++calls < 5; };
    EXPECT_THROW(readModelSource(options), Cancelled);
    EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
}

TEST_F(Scripts, AnyNameIsANameAndNothingElse) {
    const std::string odd = "a;touch b $(touch c) `touch d` 'q' \"w\"\n-n %d";
    fs::create_directory(folder / ("model/" + odd));
    fs::create_directory(folder / ("tmp/" + odd));
    setenv("TMPDIR", (folder / ("tmp/" + odd)).c_str(), 1);
    const std::string script = write(odd + "/-x;touch y,1.geo", kBox);
    EXPECT_NO_THROW(readModelSource(optionsOf(script)));
    const fs::path before = fs::current_path();
    fs::current_path(folder / ("model/" + odd));
    EXPECT_NO_THROW(readModelSource(optionsOf("-x;touch y,1.geo")));
    fs::current_path(before);
    EXPECT_THAT(testing::listFiles(folder / ("model/" + odd)), ElementsAre("-x;touch y,1.geo"));
    EXPECT_THAT(testing::listFiles(folder / ("tmp/" + odd)), IsEmpty());
    EXPECT_THAT(listModel(), ElementsAre(odd));
}

/** Reads in a process whose system refuses Landlock. **/
void readWithoutSandbox(const SourceOptions& options) {
    constexpr unsigned kCreateRuleset = 444;
    sock_filter filter[] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
                            BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kCreateRuleset, 0, 1),
                            BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS),
                            BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)};
    const sock_fprog program{4, filter};
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program);
    try {
        readModelSource(options);
        std::fprintf(stderr, "accepted\n");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
    }
    std::exit(0);
}

TEST_F(Scripts, WithoutASandboxAreRefusedUnlessThatIsOptional) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");  // OpenMP's threads do not outlive a fork
    SourceOptions options = optionsOf(write("box.geo", kBox));
    unsetenv("SIMFLEX_SANDBOX");
    EXPECT_EXIT(readWithoutSandbox(options), ::testing::ExitedWithCode(0),
                "box.geo: a script of Gmsh is a program, and this system cannot keep it in a "
                "sandbox: its kernel does not let Landlock be used .Linux 5.13 and later have it.: "
                "Function not implemented; if you trust it, give --allow-scripts\n$");
    SourceOptions data = options;
    data.path = write("box.step", "");
    EXPECT_EXIT(readWithoutSandbox(data), ::testing::ExitedWithCode(0),
                "box.step: Gmsh reads files in a sandbox, and this system has none: .*; if you "
                "trust the file, give --allow-scripts\n$");
    options.gmsh.allowsScripts = true;
    EXPECT_EXIT(readWithoutSandbox(options), ::testing::ExitedWithCode(0), "^accepted\n$");
    options.gmsh.allowsScripts = false;
    setenv("SIMFLEX_SANDBOX", "optional", 1);
    EXPECT_EXIT(readWithoutSandbox(options), ::testing::ExitedWithCode(0), "^accepted\n$");
    unsetenv("SIMFLEX_SANDBOX");
}

/** Data files, whatever their content and neighbours. **/
class DataFiles : public Scripts {
protected:
    void mesh(const std::string& result, const std::vector<std::string>& arguments) {
        write("source.geo", kBox);
        ChildSetup gmsh;
        gmsh.arguments = {"gmsh", folder / "model/source.geo", "-o", folder / ("model/" + result)};
        gmsh.arguments.insert(gmsh.arguments.end(), arguments.begin(), arguments.end());
        ASSERT_TRUE(ChildProcess(gmsh).wait().isSuccess());
        fs::remove(folder / "model/source.geo");
    }
    const std::string evil = "SystemCall \"touch '" + folder / "model/OWNED" + "'\";\n";
};

TEST_F(DataFiles, OptionsBesideThemAreNotRun) {
    mesh("box.step", {"-0"});
    mesh("box.msh", {"-3", "-clmax", "0.02"});
    mesh("box.brep", {"-0"});
    for (const std::string name : {"box.step", "box.msh", "box.brep"}) {
        write(name + ".opt", evil);
        EXPECT_EQ(read(optionsOf(folder / ("model/" + name))), "accepted") << name;
    }
    EXPECT_FALSE(fs::exists(folder / "model/OWNED"));
}

TEST_F(DataFiles, ElementsTooManyForAnyMachineAreRefusedUnmeshed) {
    for (const char* name : {"box.step", "box.brep"}) {
        mesh(name, {"-0"});
        SourceOptions options = optionsOf(folder / (std::string("model/") + name));
        options.gmsh.meshSize = 1e-7;
        EXPECT_THAT(read(options), AllOf(HasSubstr("elements of 1e-07 would be about"),
                                         HasSubstr("million; choose a larger size")));
    }
}

TEST_F(DataFiles, ScriptsUnderOtherNamesAreNotRun) {
    for (const std::string name : {"a.step", "a.stp", "a.brep"})
        EXPECT_THAT(read(optionsOf(write(name, kBox + evil))),
                    ::testing::AnyOf(HasSubstr("Gmsh could not"), HasSubstr("no solid elements"),
                                     HasSubstr("without nodes")))
            << name;
    for (const std::string& text : {evil, "$x\n" + evil, "$meshformat\n" + evil, "\n\n$\n" + evil,
                                    "\xEF\xBB\xBF$MeshFormat\n" + evil})
        EXPECT_EQ(read(optionsOf(write("a.msh", text))),
                  "'" + folder / "model/a.msh" +
                      "' is not a mesh of Gmsh: it does not begin with $MeshFormat");
    // Gmsh compares raw bytes: white space before the word turns the file into a script.
    const std::string header = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
    for (const std::string blank : {"\n", " ", "\t", "\r\n", "\v", "\f"})
        EXPECT_THAT(read(optionsOf(write("a.msh", blank + header + evil))),
                    HasSubstr("is not a mesh of Gmsh"));
    EXPECT_THAT(read(optionsOf(write("a.msh", header + evil))), Not(::testing::Eq("accepted")));
    EXPECT_FALSE(fs::exists(folder / "model/OWNED"));
}

TEST_F(DataFiles, AnyNameIsANameAndNothingElse) {
    mesh("box.step", {"-0"});
    const std::string odd = "-3;touch b $(touch c) 'q' \"w\"\n%d.STEP";
    fs::rename(folder / "model/box.step", folder / ("model/" + odd));
    EXPECT_EQ(read(optionsOf(folder / ("model/" + odd))), "accepted");
    EXPECT_THAT(listModel(), ElementsAre(odd));
}

TEST_F(Scripts, WhatTheyReadIsKnown) {
    const std::string top = write("top.geo",
                                  "Include \"a.txt\"; Merge StrCat(\"b\", \".step\");\n"
                                  "Field[1].FileName = \"f.dat\"; // Include \"c.txt\";\n");
    write("a.txt", "Include \"top.geo\"; Merge \"/x/y.msh\";\n");
    std::vector<std::string> names;
    for (const std::string& file : listScriptFiles(top))
        if (file.find(".opt") == std::string::npos)
            names.push_back(fs::path(file).lexically_relative(folder / "model").string());
    EXPECT_THAT(names, ::testing::UnorderedElementsAre("top.geo", "a.txt", "b", "f.dat", "c.txt",
                                                       ::testing::EndsWith("x/y.msh")));
}

}  // namespace
}  // namespace simflex
