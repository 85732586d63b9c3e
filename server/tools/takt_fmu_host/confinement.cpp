#include "server/tools/takt_fmu_host/confinement.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>

namespace takt::fmu_host {
namespace {

void limit(int resource, rlim_t most) {
  rlimit now{};
  if (::getrlimit(static_cast<__rlimit_resource>(resource), &now) != 0) return;
  now.rlim_cur = now.rlim_max == RLIM_INFINITY ? most : (most < now.rlim_max ? most : now.rlim_max);
  now.rlim_max = now.rlim_cur;
  static_cast<void>(::setrlimit(static_cast<__rlimit_resource>(resource), &now));
}

#if defined(__x86_64__)
constexpr std::uint32_t kMachine = AUDIT_ARCH_X86_64;
#else
constexpr std::uint32_t kMachine = AUDIT_ARCH_AARCH64;
#endif

/// socket() fails with EACCES but for AF_UNIX; system calls of another machine word end the process.
void deny_network() {
  constexpr auto kLoad = static_cast<std::uint16_t>(BPF_LD | BPF_W | BPF_ABS);
  constexpr auto kEqual = static_cast<std::uint16_t>(BPF_JMP | BPF_JEQ | BPF_K);
  constexpr auto kAtLeast = static_cast<std::uint16_t>(BPF_JMP | BPF_JGE | BPF_K);
  constexpr auto kReturn = static_cast<std::uint16_t>(BPF_RET | BPF_K);
  constexpr std::uint32_t kX32 = 0x40000000U;
  std::array<sock_filter, 10> filter{{
      {kLoad, 0, 0, offsetof(seccomp_data, arch)},
      {kEqual, 1, 0, kMachine},
      {kReturn, 0, 0, SECCOMP_RET_KILL_PROCESS},
      {kLoad, 0, 0, offsetof(seccomp_data, nr)},
      {kAtLeast, 3, 0, kX32},
      {kEqual, 0, 3, __NR_socket},
      {kLoad, 0, 0, offsetof(seccomp_data, args[0])},
      {kEqual, 1, 0, AF_UNIX},
      {kReturn, 0, 0, SECCOMP_RET_ERRNO | EACCES},
      {kReturn, 0, 0, SECCOMP_RET_ALLOW},
  }};
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  static_cast<void>(::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0));
}

/// Files are made, changed and removed below one directory alone.
void deny_writing(const std::string& except) {
  landlock_ruleset_attr rules{};
  constexpr std::uint64_t kWriting = LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                                     LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_CHAR |
                                     LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG |
                                     LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
                                     LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM;
  rules.handled_access_fs = kWriting;
  const auto set = static_cast<int>(::syscall(SYS_landlock_create_ruleset, &rules, sizeof rules, 0));
  if (set < 0) return;
  for (const char* place : {except.c_str(), "/dev/null"}) {
    landlock_path_beneath_attr beneath{};
    beneath.parent_fd = ::open(place, O_PATH | O_CLOEXEC);
    if (beneath.parent_fd < 0) continue;
    beneath.allowed_access =
        place == except.c_str() ? kWriting : std::uint64_t{LANDLOCK_ACCESS_FS_WRITE_FILE};
    static_cast<void>(::syscall(SYS_landlock_add_rule, set, LANDLOCK_RULE_PATH_BENEATH, &beneath, 0));
    ::close(beneath.parent_fd);
  }
  static_cast<void>(::syscall(SYS_landlock_restrict_self, set, 0));
  ::close(set);
}

}  // namespace

void confine(const std::string& writable) {
  static_cast<void>(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0));
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, 256);
  deny_writing(writable);
  deny_network();
}

void limit_memory(std::uint64_t bytes) {
  limit(RLIMIT_AS, static_cast<rlim_t>(bytes));
}

}  // namespace takt::fmu_host
