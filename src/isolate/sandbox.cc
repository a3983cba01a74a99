#include "isolate/sandbox.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <fmt/format.h>

#include "base/paths.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// ---- Landlock: the kernel's interface, whose newer parts a system's headers may lack -------------------------------

constexpr long kCreateRuleset = 444, kAddRule = 445, kRestrictSelf = 446;
constexpr unsigned kAskVersion = 1U, kPathBeneath = 1U;

struct RulesetAttributes {
  std::uint64_t files, network, scoped;
};
struct [[gnu::packed]] PathAttributes {
  std::uint64_t access;
  std::int32_t parent;
};

constexpr std::uint64_t bit(int number) { return std::uint64_t{1} << number; }

constexpr std::uint64_t kExecute = bit(0), kWriteFile = bit(1), kReadFile = bit(2), kReadFolder = bit(3);
constexpr std::uint64_t kOfVersion1 = bit(13) - 1;  // 0 to 12: read, write, make and remove
constexpr std::uint64_t kRefer = bit(13), kTruncate = bit(14), kIoctl = bit(15);  // of versions 2, 3, 5
constexpr std::uint64_t kTcp = bit(0) | bit(1);                                   // bind, connect: of version 4
constexpr std::uint64_t kScopes = bit(0) | bit(1);  // abstract sockets, signals: of version 6
constexpr std::uint64_t kReading = kExecute | kReadFile | kReadFolder;
constexpr std::uint64_t kOfFiles = kExecute | kWriteFile | kReadFile | kTruncate | kIoctl;

int landlock_version() {
  const long version = ::syscall(kCreateRuleset, nullptr, 0, kAskVersion);
  return version < 0 ? 0 : static_cast<int>(version);
}

// Rights that a version knows.
std::uint64_t files_of(int version) {
  std::uint64_t files = kOfVersion1;
  if (version >= 2) files |= kRefer;
  if (version >= 3) files |= kTruncate;
  if (version >= 5) files |= kIoctl;
  return files;
}

void allow(int ruleset, const std::string& path, std::uint64_t access) {
  const int file = ::open(path.c_str(), O_PATH | O_CLOEXEC);
  if (file < 0) return;
  struct stat facts{};
  const bool folder = ::fstat(file, &facts) == 0 && S_ISDIR(facts.st_mode);
  const PathAttributes attributes = {folder ? access : access & kOfFiles, file};
  ::syscall(kAddRule, ruleset, kPathBeneath, &attributes, 0);
  ::close(file);
}

// What a process needs of the system to load libraries, start programs and ask for its processor.
constexpr std::array kSystem = {"/usr",
                                "/lib",
                                "/lib32",
                                "/lib64",
                                "/bin",
                                "/sbin",
                                "/opt",
                                "/nix/store",
                                "/gnu/store",
                                "/proc",
                                "/sys/devices/system",
                                "/sys/fs/cgroup",
                                "/sys/kernel/mm",
                                "/etc/ld.so.cache",
                                "/etc/ld.so.conf",
                                "/etc/ld.so.conf.d",
                                "/etc/ld.so.preload",
                                "/etc/alternatives",
                                "/etc/localtime",
                                "/etc/nsswitch.conf",
                                "/etc/passwd",
                                "/etc/group",
                                "/etc/ssl/openssl.cnf",
                                "/etc/ssl/certs",
                                "/etc/ca-certificates",
                                "/etc/fonts"};
constexpr std::array kDevices = {"/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"};

bool confine_files(const SandboxRules& rules, int version) {
  const RulesetAttributes attributes = {files_of(version), kTcp, kScopes};
  size_t size = sizeof attributes;
  if (version < 6) size = offsetof(RulesetAttributes, scoped);
  if (version < 4) size = offsetof(RulesetAttributes, network);
  const int ruleset = static_cast<int>(::syscall(kCreateRuleset, &attributes, size, 0));
  if (ruleset < 0) return false;
  const std::uint64_t everything = files_of(version), reading = kReading & everything;
  if (rules.read_everything) allow(ruleset, "/", reading);
  for (const char* path : kSystem) allow(ruleset, path, reading);
  for (const char* path : kDevices) allow(ruleset, path, everything);
  for (const std::string& path : rules.devices) allow(ruleset, path, everything);
  for (const std::string& path : rules.readable) allow(ruleset, path, reading);
  for (const std::string& path : folders_in("ASSAY_SANDBOX_READ")) allow(ruleset, path, reading);
  for (const std::string& path : rules.writable) allow(ruleset, path, everything & ~kIoctl);
  const bool done = ::syscall(kRestrictSelf, ruleset, 0) == 0;
  ::close(ruleset);
  return done;
}

// ---- the filter of system calls --------------------------------------------------------------------------------------

#ifdef __x86_64__
constexpr std::uint32_t kMachine = AUDIT_ARCH_X86_64, kOtherCalls = 0x40000000;  // those of x32 begin there
#elif defined(__aarch64__)
constexpr std::uint32_t kMachine = AUDIT_ARCH_AARCH64, kOtherCalls = 0;
#else
constexpr std::uint32_t kMachine = 0, kOtherCalls = 0;
#endif

constexpr std::uint32_t refusal(int error) { return SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error); }

// Calls that reach the network, other processes, or what Landlock does not cover, whatever their arguments are.
constexpr std::array kRefused = {
    SYS_socket,
    SYS_fchmod,
    SYS_fchmodat,
    SYS_fchown,
    SYS_fchownat,
    SYS_setxattr,
    SYS_lsetxattr,
    SYS_fsetxattr,
    SYS_removexattr,
    SYS_lremovexattr,
    SYS_fremovexattr,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    SYS_shmget,  // memory and queues that every process of the user has by their numbers
    SYS_shmat,
    SYS_shmctl,
    SYS_semget,
    SYS_semop,
    SYS_semtimedop,
    SYS_semctl,
    SYS_msgget,
    SYS_msgsnd,
    SYS_msgrcv,
    SYS_msgctl,
    SYS_mq_open,
    SYS_mq_unlink,
    SYS_unshare,
    SYS_setns,
    SYS_mount,
    SYS_umount2,
    SYS_pivot_root,
    SYS_chroot,
    SYS_bpf,
    SYS_perf_event_open,
    SYS_userfaultfd,
    SYS_keyctl,
    SYS_add_key,
    SYS_request_key,
    SYS_init_module,
    SYS_finit_module,
    SYS_delete_module,
    SYS_kexec_load,
    SYS_reboot,
    SYS_swapon,
    SYS_swapoff,
    SYS_sethostname,
    SYS_setdomainname,
    SYS_settimeofday,
    SYS_clock_settime,
    SYS_adjtimex,
#ifdef __x86_64__
    SYS_chmod,
    SYS_chown,
    SYS_lchown,
#endif
#ifndef __SANITIZE_ADDRESS__  // its search for leaks is one
    SYS_ptrace,
#endif
};

bool confine_calls() {
  if (kMachine == 0) return false;
  constexpr std::uint32_t kIoUring = SYS_io_uring_setup;  // it makes sockets too; programs do without it
  std::vector<sock_filter> program;
  const auto add = [&](std::uint16_t code, std::uint32_t k, std::uint8_t yes = 0, std::uint8_t no = 0) {
    program.push_back({code, yes, no, k});
  };
  const auto refuse_if = [&](std::uint16_t condition, std::uint32_t k, int error) {
    add(BPF_JMP | condition | BPF_K, k, 0, 1);
    add(BPF_RET | BPF_K, refusal(error));
  };
  const auto load = [&](size_t offset) { add(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)); };
  // Refuses the call where the lower half of an argument is one of the values, or where it is none of them.
  const auto refuse_where = [&](long call, int argument, bool is_one, const std::vector<std::uint32_t>& values) {
    const auto count = static_cast<std::uint8_t>(values.size());
    add(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, count + 3);
    load(offsetof(seccomp_data, args) + sizeof(std::uint64_t) * argument);
    for (std::uint8_t i = 0; i < count; ++i) {
      const auto to_refusal = static_cast<std::uint8_t>(count - 1 - i);
      const bool last = i + 1 == count;
      add(BPF_JMP | BPF_JEQ | BPF_K, values[i], is_one ? to_refusal : to_refusal + 1, is_one && last ? 1 : 0);
    }
    add(BPF_RET | BPF_K, refusal(EPERM));
    load(offsetof(seccomp_data, nr));
  };
  load(offsetof(seccomp_data, arch));
  add(BPF_JMP | BPF_JEQ | BPF_K, kMachine, 1, 0);
  add(BPF_RET | BPF_K, refusal(EPERM));
  load(offsetof(seccomp_data, nr));
  if (kOtherCalls != 0) refuse_if(BPF_JGE, kOtherCalls, EPERM);
  for (const auto call : kRefused) refuse_if(BPF_JEQ, static_cast<std::uint32_t>(call), EPERM);
  constexpr std::uint32_t kFchmodat2 = 452, kSetxattrat = 463, kRemovexattrat = 466;
  for (const std::uint32_t call : {kFchmodat2, kSetxattrat, kRemovexattrat}) refuse_if(BPF_JEQ, call, EPERM);
  refuse_if(BPF_JEQ, kIoUring, ENOSYS);
  // 0 is the caller; what it starts later has another number than this one. Threads' processors stay free to choose:
  // engines name them by numbers that no filter knows.
  const auto self = static_cast<std::uint32_t>(::getpid());
  refuse_where(SYS_prlimit64, 0, false, {0, self});
  refuse_where(SYS_setpriority, 0, true, {PRIO_USER});
  refuse_where(SYS_setpriority, 1, false, {0, self});
  refuse_where(SYS_ioctl, 1, true, {TIOCSTI, TIOCLINUX});  // words for the terminal's next program
  add(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  const sock_fprog filter = {static_cast<unsigned short>(program.size()), program.data()};
  // Without the flag, older kernels slow down all that follows (speculative stores), which a clock would see.
  return ::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_SPEC_ALLOW, &filter) == 0;
}

bool switched_off() {
  const char* value = std::getenv("ASSAY_SANDBOX");
  return value != nullptr && std::strcmp(value, "off") == 0;
}

std::string lacking_text(bool files, bool calls) {
  if (!files && !calls) {
    return "engines and parsers are not confined, because this kernel offers neither Landlock nor seccomp filters";
  }
  if (!files) {
    return "engines and parsers may open every file that you may, because this kernel offers no Landlock (Linux 5.13 "
           "or newer, with 'landlock' in its list of security modules)";
  }
  if (!calls) return "engines and parsers may use the network, because this kernel offers no seccomp filters";
  return "";
}

}  // namespace

std::string Sandbox::text() const {
  std::string text;
  if (landlock > 0) text = fmt::format("files (Landlock {})", landlock);
  if (filter) text += text.empty() ? "network and system calls (seccomp)" : ", network and system calls (seccomp)";
  return text.empty() ? "nothing" : text;
}

Sandbox offered_sandbox() {
  if (switched_off()) return {.lacking = "engines and parsers are not confined, because ASSAY_SANDBOX is off"};
  Sandbox sandbox;
  sandbox.landlock = landlock_version();
  const std::uint32_t action = SECCOMP_RET_ERRNO;
  sandbox.filter = kMachine != 0 && ::syscall(SYS_seccomp, SECCOMP_GET_ACTION_AVAIL, 0, &action) == 0;
  sandbox.lacking = lacking_text(sandbox.landlock > 0, sandbox.filter);
  return sandbox;
}

Sandbox enter_sandbox(const SandboxRules& rules) {
  Sandbox sandbox = offered_sandbox();
  if (sandbox.landlock == 0 && !sandbox.filter) return sandbox;
  // Both ask for it: no program that is started gains rights.
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return {.lacking = lacking_text(false, false)};
  if (sandbox.landlock > 0 && !confine_files(rules, sandbox.landlock)) sandbox.landlock = 0;
  sandbox.filter = sandbox.filter && confine_calls();
  sandbox.lacking = lacking_text(sandbox.landlock > 0, sandbox.filter);
  return sandbox;
}

std::vector<std::string> program_folders() {
  std::vector<std::string> folders = folders_in("LD_LIBRARY_PATH");
  for (const std::string& text : folders_in("PATH")) {
    folders.push_back(text);
    const fs::path folder = fs::path(text).lexically_normal();
    if (folder.filename() == "bin") folders.push_back(folder.parent_path() / "lib");
  }
  return folders;
}

}  // namespace assay
