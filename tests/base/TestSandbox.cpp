/** @file
Permitted and forbidden operations of a program in the sandbox. **/

#include <gmock/gmock.h>
#include <sys/syscall.h>

#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>

#include "simflex/base/ChildProcess.h"
#include "simflex/base/Sandbox.h"
#include "simflex/base/TemporaryFolder.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/** Runs Python in the sandbox as a program that tries everything. **/
class SandboxTest : public ::testing::Test {
protected:
    SandboxTest() {
        fs::create_directories(inside);
        fs::create_directories(outside);
        write(outside / "secret", "secret");
        write(folder.path() / "readable", "open");
        sandbox.program = fs::canonical("/usr/bin/python3").string();
        sandbox.readable = listSystemFolders();
        sandbox.readable.push_back((folder.path() / "readable").string());
        sandbox.writable = inside.string();
    }
    void SetUp() override {
        if (!findSandboxObstacle().empty()) GTEST_SKIP() << findSandboxObstacle();
    }

    static void write(const fs::path& file, const std::string& text) {
        std::ofstream(file) << text;
    }
    static std::string read(const fs::path& file) {
        std::stringstream text;
        text << std::ifstream(file).rdbuf();
        return text.str();
    }

    /** Returns "ok" or the error's name. **/
    std::string attempt(const std::string& code) {
        ChildSetup setup;
        setup.arguments = {sandbox.program,
                           "-I",
                           "-c",
                           "import os, sys, errno\n"
                           "outside, readable = sys.argv[1:3]\n"
                           "try:\n"
                           "    " +
                               code +
                               "\n"
                               "    print('ok', end='')\n"
                               "except OSError as error:\n"
                               "    print(errno.errorcode[error.errno], end='')\n",
                           outside.string(),
                           (folder.path() / "readable").string()};
        setup.folder = inside.string();
        setup.environment = {{"PYTHONDONTWRITEBYTECODE", "1"}};
        setup.sandbox = &sandbox;
        const std::unique_ptr<FILE, int (*)(FILE*)> output(std::tmpfile(), std::fclose);
        setup.output = setup.error = fileno(output.get());
        ChildProcess(setup).wait();
        std::string text(4000, '\0');
        std::rewind(output.get());
        text.resize(std::fread(text.data(), 1, text.size(), output.get()));
        return text;
    }

    TemporaryFolder folder;
    fs::path inside = folder.path() / "inside", outside = folder.path() / "outside";
    Sandbox sandbox;
};

TEST_F(SandboxTest, ItsOwnFolderIsItsOwn) {
    EXPECT_EQ(attempt("open('new', 'w').write('text')"), "ok");
    EXPECT_EQ(read(inside / "new"), "text");
    EXPECT_EQ(attempt("os.mkdir('deep'); os.rename('new', 'deep/moved')"), "ok");
    EXPECT_EQ(attempt("os.remove('deep/moved'); os.rmdir('deep')"), "ok");
    EXPECT_TRUE(fs::is_empty(inside));
    EXPECT_EQ(attempt("assert open(readable).read() == 'open'"), "ok");
}

TEST_F(SandboxTest, NothingElseIsReadOrChanged) {
    const auto refused = ::testing::AnyOf("EACCES", "EPERM", "EXDEV");
    for (const char* code : {"open(outside + '/secret').read()",
                             "open('/etc/passwd').read()",
                             "os.listdir(outside)",
                             "open('/proc/self/environ').read()",
                             "open(outside + '/new', 'w')",
                             "open(outside + '/secret', 'a')",
                             "open(outside + '/secret', 'w')",
                             "open(readable, 'a')",
                             "open('../new', 'w')",
                             "os.truncate(outside + '/secret', 0)",
                             "os.truncate(readable, 0)",
                             "os.remove(outside + '/secret')",
                             "os.mkdir(outside + '/folder')",
                             "os.rename(outside + '/secret', 'mine')",
                             "os.link(outside + '/secret', 'mine')",
                             "os.symlink('/', outside + '/link')",
                             "os.mkfifo(outside + '/fifo')",
                             "os.symlink(outside + '/secret', 'link'); open('link').read()",
                             "os.chmod(outside + '/secret', 0)",
                             "os.chown(outside + '/secret', 0, 0)",
                             "os.utime(outside + '/secret', (0, 0))",
                             "os.setxattr(outside + '/secret', 'user.x', b'x')"})
        EXPECT_THAT(attempt(code), refused) << code;
    EXPECT_EQ(read(outside / "secret"), "secret");
    EXPECT_EQ(read(folder.path() / "readable"), "open");
    EXPECT_EQ(std::distance(fs::directory_iterator(outside), fs::directory_iterator()), 1);
}

TEST_F(SandboxTest, NoProgramIsStarted) {
    write(folder.path() / "readable", "#!/bin/sh\necho ran\n");
    fs::permissions(folder.path() / "readable", fs::perms::owner_all);
    for (const char* code :
         {"os.execv('/bin/sh', ['sh', '-c', 'echo ran'])", "os.execv(readable, [readable])",
          "os.posix_spawn('/bin/true', ['true'], {})",
          "open('mine', 'w').write('#!/bin/sh'); os.chmod('mine', 0o700)",
          "import shutil; shutil.copyfile('/usr/bin/env', 'mine'); os.execv('mine', ['mine'])",
          "os.execv(os.memfd_create('x'), ['x'])"})
        EXPECT_THAT(attempt(code), ::testing::AnyOf("EACCES", "EPERM")) << code;
    // As a Gmsh script would: by a shell in a child process.
    EXPECT_EQ(attempt("assert os.system('echo ran > ran') != 0"), "ok");
    EXPECT_FALSE(fs::exists(inside / "ran"));
}

TEST_F(SandboxTest, ThereIsNoNetworkAndNoSignalGoesOut) {
    for (const char* code :
         {"import socket; socket.socket()", "import socket; socket.socket(socket.AF_UNIX)",
          "os.kill(os.getppid(), 0)", "os.kill(-1, 0)", "os.pidfd_open(os.getppid())"})
        EXPECT_EQ(attempt(code), "EPERM") << code;
}

TEST_F(SandboxTest, NoCallReachesOtherProcessesOrFilesBesides) {
    const std::string call =
        "import ctypes; libc = ctypes.CDLL(None, use_errno=True)\n"
        "    if libc.syscall(%s) < 0: raise OSError(ctypes.get_errno(), '')";
    const auto attemptCall = [&](const std::string& arguments) {
        std::string code = call;
        return attempt(code.replace(code.find("%s"), 2, arguments));
    };
    const std::string parent = "os.getppid()", file = "-100, (outside + '/secret').encode(), ";
    const auto number = [](long name) { return std::to_string(name) + ", "; };
    for (const std::string& arguments :
         {number(SYS_tgkill) + parent + ", " + parent + ", 0",
          number(SYS_rt_tgsigqueueinfo) + parent + ", " + parent + ", 0, 0",
          number(424) + "-1, 0, 0, 0",  // pidfd_send_signal
          number(SYS_prlimit64) + parent + ", 7, 0, 0",
          number(SYS_setpriority) + "0, " + parent + ", 19",
          number(SYS_sched_setaffinity) + parent + ", 0, 0",
          number(440) + "-1, 0, 0, 0, 0",  // process_madvise
          number(SYS_kcmp) + parent + ", " + parent + ", 0, 0, 0",
          number(452) + file + "0o777, 0",                     // fchmodat2
          number(463) + file + "0, b'user.x', 0, 0",           // setxattrat
          number(469) + file + "0, 0, 0",                      // file_setattr
          number(428) + "-100, b'/', 1",                       // open_tree
          number(430) + "b'tmpfs', 0",                         // fsopen
          number(SYS_clone) + "0x10000000 | 17, 0, 0, 0, 0"})  // a namespace of users
        EXPECT_EQ(attemptCall(arguments), "EPERM") << arguments;
    EXPECT_EQ(attemptCall(number(SYS_prlimit64) + "0, 7, 0, 0"), "ok");
    EXPECT_EQ(attempt("import threading; t = threading.Thread(target=print); t.start(); t.join()"),
              "\nok");
}

TEST_F(SandboxTest, WhatTheLoaderLoadsIsShutInToo) {
    std::string loader;
    for (const char* path : {"/lib64/ld-linux-x86-64.so.2", "/lib/ld-linux-aarch64.so.1"})
        if (fs::exists(path)) loader = path;
    EXPECT_EQ(attempt("open('script', 'w').write('echo x > ' + outside + '/new; cat ' + outside + "
                      "'/secret; ls')\n"
                      "    os.execv('" +
                      loader + "', ['ld', '/bin/sh', 'script'])")
                  .find("secret\n"),
              std::string::npos);
    EXPECT_FALSE(fs::exists(outside / "new"));
}

TEST_F(SandboxTest, OnlyTheProgramIsShutIn) {
    EXPECT_EQ(attempt("pass"), "ok");
    write(outside / "secret", "as ever");
    EXPECT_EQ(read(outside / "secret"), "as ever");
    ChildSetup setup;
    setup.arguments = {"sh", "-c", "test -r /etc/passwd"};
    EXPECT_TRUE(ChildProcess(setup).wait().isSuccess());
}

TEST_F(SandboxTest, WhatIsNotItsProgramCannotBeStartedInIt) {
    sandbox.program = "/usr/bin/env";
    ChildSetup setup;
    setup.arguments = {"/bin/sh", "-c", "true"};
    setup.sandbox = &sandbox;
    EXPECT_THAT([&] { ChildProcess{setup}; }, ::testing::ThrowsMessage<std::runtime_error>(
                                                  "cannot run '/bin/sh': Permission denied"));
}

}  // namespace
}  // namespace simflex
