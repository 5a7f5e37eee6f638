#include "simflex/base/Sandbox.h"

#include <fcntl.h>
#include <link.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>

namespace simflex {
namespace {

// Landlock's interface, copied from the newest kernel's linux/landlock.h that is used here, since
// the system's header may be older.
struct RulesetAttributes {
    std::uint64_t handledAccess, handledNetwork, scoped;
};
struct PathAttributes {
    std::uint64_t allowedAccess;
    std::int32_t parent;
} __attribute__((packed));
constexpr long CreateRuleset = 444, AddRule = 445, RestrictSelf = 446;
constexpr unsigned AskVersion = 1, PathBeneath = 1;
using Access = std::uint64_t;
constexpr Access Execute = 1 << 0, WriteFile = 1 << 1, ReadFile = 1 << 2, ReadFolder = 1 << 3,
                 Version1 = (1 << 13) - 1,  // and removing and creating files of every kind
    Refer = 1 << 13,                        // version 2: moving between folders
    Truncate = 1 << 14,                     // version 3
    ControlDevice = 1 << 15;                // version 5
constexpr long FirstScopes = 6;             // Landlock version that introduced scopes
constexpr std::uint64_t ScopeSignals = 1 << 1;

#if defined(__x86_64__)
constexpr unsigned Architecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr unsigned Architecture = AUDIT_ARCH_AARCH64;
#else
constexpr unsigned Architecture = 0;
#endif
constexpr unsigned FirstForeignCall = 0x40000000;  // first of the x32 calls of x86-64

/** Calls that reach resources which Landlock does not guard. **/
constexpr long ForbiddenCalls[] = {
    SYS_socket,
    SYS_io_uring_setup,  // network
    SYS_kill,
    SYS_tkill,
    SYS_rt_sigqueueinfo,
    SYS_rt_tgsigqueueinfo,
    SYS_pidfd_open,
    424,  // pidfd_send_signal: new calls have one number on all architectures
    438,  // pidfd_getfd
    SYS_ptrace,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    440,  // process_madvise
    SYS_kcmp,
    SYS_setpriority,
    SYS_ioprio_set,
    SYS_migrate_pages,
    SYS_move_pages,  // processes
    SYS_shmget,
    SYS_semget,
    SYS_msgget,
    SYS_mq_open,
    SYS_memfd_create,  // shared memory
    SYS_truncate,
    SYS_fchmod,
    SYS_fchmodat,
    SYS_fchown,
    SYS_fchownat,
    452,  // fchmodat2
    463,  // setxattrat
    466,  // removexattrat
    469,  // file_setattr; files
    SYS_utimensat,
    SYS_setxattr,
    SYS_lsetxattr,
    SYS_fsetxattr,
    SYS_removexattr,  //
    SYS_lremovexattr,
    SYS_fremovexattr,
    SYS_open_by_handle_at,
    SYS_mknodat,  //
    SYS_mount,
    SYS_umount2,
    SYS_pivot_root,
    SYS_chroot,
    428,  // open_tree
    429,  // move_mount
    430,  // fsopen
    432,  // fsmount
    433,  // fspick
    442,  // mount_setattr
    467,  // open_tree_attr
    SYS_unshare,
    SYS_setns,
    SYS_syslog,  // the system
    SYS_bpf,
    SYS_perf_event_open,
    SYS_userfaultfd,
    SYS_keyctl,
    SYS_add_key,  //
    SYS_request_key,
    SYS_personality,
    SYS_reboot,
    SYS_settimeofday,
    SYS_quotactl,  //
    SYS_acct,
    SYS_swapon,
    SYS_swapoff,
    SYS_init_module,
    SYS_finit_module,  //
    SYS_delete_module,
    SYS_sethostname,
    SYS_setdomainname,  //
#ifdef SYS_chmod        // legacy calls, absent on newer architectures
    SYS_chmod,
    SYS_chown,
    SYS_lchown,
    SYS_utime,
    SYS_utimes,
    SYS_futimesat,
    SYS_mknod,
#endif
};

/** Calls whose first argument names a process; 0: the caller. **/
constexpr long CallsForOneself[] = {
    SYS_prlimit64,      SYS_sched_setaffinity,  SYS_sched_setattr,
    SYS_sched_setparam, SYS_sched_setscheduler,
};
constexpr long Clone3 = 435;  // its flags are in memory, which filters cannot read
constexpr unsigned NewNamespaces = 0x7e020080;

[[noreturn]] void fail(const std::string& what) {
    throw std::runtime_error("cannot make a sandbox: " + what + ": " + std::strerror(errno));
}

long getLandlockVersion() {
    return syscall(CreateRuleset, nullptr, 0, AskVersion);
}

/** Returns the dynamic loader of this program, which will also load the sandboxed program. Only
these two may be executed. **/
std::string findLoader() {
    std::string loader;
    dl_iterate_phdr(
        [](dl_phdr_info* info, size_t, void* result) {
            for (int k = 0; k < info->dlpi_phnum; ++k)
                if (info->dlpi_phdr[k].p_type == PT_INTERP)
                    *static_cast<std::string*>(result) =
                        reinterpret_cast<const char*>(info->dlpi_addr + info->dlpi_phdr[k].p_vaddr);
            return 1;  // the first entry is the program itself
        },
        &loader);
    return loader;
}

/** A Landlock rule set, closed by the destructor. **/
class Landlock {
public:
    Landlock() {
        const long version = getLandlockVersion();
        m_known = Version1 | (version >= 2 ? Refer : 0) | (version >= 3 ? Truncate : 0) |
                  (version >= 5 ? ControlDevice : 0);
        const RulesetAttributes attributes{m_known, 0, version >= FirstScopes ? ScopeSignals : 0};
        const size_t size = version >= FirstScopes ? sizeof attributes : sizeof m_known;
        m_rules = int(syscall(CreateRuleset, &attributes, size, 0));
        if (m_rules < 0) fail("Landlock");
    }
    ~Landlock() { close(m_rules); }
    Landlock(const Landlock&) = delete;
    Landlock& operator=(const Landlock&) = delete;

    /** Ignores paths that do not exist. **/
    void allow(const std::string& path, Access access) {
        const int file = open(path.c_str(), O_PATH | O_CLOEXEC);
        if (file < 0) return;
        struct stat status {};
        fstat(file, &status);
        if (!S_ISDIR(status.st_mode)) access &= Execute | WriteFile | ReadFile | Truncate;
        const PathAttributes attributes{access & m_known, file};
        const long failed = syscall(AddRule, m_rules, PathBeneath, &attributes, 0);
        close(file);
        if (failed) fail(path);
    }

    void restrictThread() {
        if (syscall(RestrictSelf, m_rules, 0) != 0) fail("Landlock");
    }

private:
    Access m_known;
    int m_rules;
};

/** A seccomp filter of refused system calls. **/
class CallFilter {
public:
    CallFilter() {
        load(offsetof(seccomp_data, arch));
        refuseUnless(BPF_JEQ, Architecture);
        load(offsetof(seccomp_data, nr));
        jump(BPF_JGE, FirstForeignCall, 0, 1);
        refuse(EPERM);
    }

    void forbid(long call, int error = EPERM) {
        jump(BPF_JEQ, unsigned(call), 0, 1);
        refuse(error);
    }
    void forbidUnlessFirstIsZero(long call) { forbidByFirst(call, BPF_JEQ, 0); }
    /** @param bits  of the first argument: the call is refused if any is set **/
    void forbidBitsOfFirst(long call, unsigned bits) { forbidByFirst(call, BPF_JSET, bits); }

    void restrictThread() {
        add(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
        const sock_fprog program{static_cast<unsigned short>(m_filter.size()), m_filter.data()};
        if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0) fail("seccomp");
    }

private:
    void add(int code, unsigned value) {
        m_filter.push_back(BPF_STMT(static_cast<unsigned short>(code), value));
    }
    void load(size_t offset) { add(BPF_LD | BPF_W | BPF_ABS, unsigned(offset)); }
    void jump(int test, unsigned value, int ifTrue, int ifFalse) {
        m_filter.push_back(BPF_JUMP(static_cast<unsigned short>(BPF_JMP | test | BPF_K), value,
                                    static_cast<unsigned char>(ifTrue),
                                    static_cast<unsigned char>(ifFalse)));
    }
    void refuse(int error) { add(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | unsigned(error)); }
    void refuseUnless(int test, unsigned value) {
        jump(test, value, 1, 0);
        refuse(EPERM);
    }
    /** Tests the lower 32 bits of the first argument, which hold process numbers and flags. **/
    void forbidByFirst(long call, int test, unsigned value) {
        jump(BPF_JEQ, unsigned(call), 0, 4);
        load(offsetof(seccomp_data, args));
        const bool isAllowed = test == BPF_JEQ;
        jump(test, value, isAllowed ? 1 : 0, isAllowed ? 0 : 1);
        refuse(EPERM);
        load(offsetof(seccomp_data, nr));
    }

    std::vector<sock_filter> m_filter;
};

void forbidCalls() {
    CallFilter filter;
    for (const long call : ForbiddenCalls) filter.forbid(call);
    for (const long call : CallsForOneself) filter.forbidUnlessFirstIsZero(call);
    // abort() works without tgkill.
    if (getLandlockVersion() < FirstScopes) filter.forbid(SYS_tgkill);
    filter.forbidBitsOfFirst(SYS_clone, NewNamespaces);
    filter.forbid(Clone3, ENOSYS);  // makes the C library fall back to clone
    filter.restrictThread();
}

}  // namespace

std::vector<std::string> listSystemFolders() {
    return {"/usr",
            "/lib",
            "/lib64",
            "/lib32",
            "/etc/ld.so.cache",
            "/dev/null",
            "/dev/urandom",
            "/sys/devices/system/cpu"};
}

std::string findSandboxObstacle() {
    if (Architecture == 0) return "its processor is neither x86-64 nor 64-bit ARM";
    if (getLandlockVersion() < 1)
        return std::string(
                   "its kernel does not let Landlock be used (Linux 5.13 and later have it): ") +
               std::strerror(errno);
    if (prctl(PR_GET_SECCOMP) < 0) return "its kernel has no seccomp";
    return "";
}

void enterSandbox(const Sandbox& sandbox) {
    Landlock landlock;
    landlock.allow(sandbox.program, Execute | ReadFile);
    landlock.allow(findLoader(), Execute | ReadFile);
    for (const std::string& path : sandbox.readable) landlock.allow(path, ReadFile | ReadFolder);
    landlock.allow("/dev/null", ReadFile | WriteFile | Truncate);
    landlock.allow(sandbox.writable, ~Execute);
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail("no new privileges");
    landlock.restrictThread();
    forbidCalls();
}

}  // namespace simflex
