#include "server/tools/takt_fmu_host/confinement.h"

#include <asm/ioctls.h>
#include <asm/sockios.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <vector>

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

/// What system calls are refused, as a program for the kernel.
class CallFilter {
 public:
  /// System calls of another machine word end the process.
  CallFilter() {
    constexpr std::uint32_t kX32 = 0x40000000U;
    add(kLoad, offsetof(seccomp_data, arch));
    add(kEqual, kMachine, 1, 0);
    add(kReturn, SECCOMP_RET_KILL_PROCESS);
    add(kLoad, offsetof(seccomp_data, nr));
    add(kAtLeast, kX32, 0, 1);
    add(kReturn, SECCOMP_RET_ERRNO | ENOSYS);
  }
  void refuse(std::uint32_t call, std::uint32_t error) {
    add(kEqual, call, 0, 1);
    add(kReturn, SECCOMP_RET_ERRNO | error);
  }
  /// The lower half of an argument must be one of these values.
  void allow_only(std::uint32_t call, unsigned argument, std::initializer_list<std::uint32_t> values,
                  std::uint32_t error) {
    judge(call, argument, values, SECCOMP_RET_ERRNO | error, SECCOMP_RET_ALLOW);
  }
  void refuse_if(std::uint32_t call, unsigned argument, std::initializer_list<std::uint32_t> values,
                 std::uint32_t error) {
    judge(call, argument, values, SECCOMP_RET_ALLOW, SECCOMP_RET_ERRNO | error);
  }
  /// A flag of an argument must be set.
  void require_flag(std::uint32_t call, unsigned argument, std::uint32_t flag, std::uint32_t error) {
    add(kEqual, call, 0, 4);
    add(kLoad, lower_half(argument));
    add(kAnyBit, flag, 1, 0);
    add(kReturn, SECCOMP_RET_ERRNO | error);
    add(kReturn, SECCOMP_RET_ALLOW);
  }
  /// Of this thread and all that it starts. Empty, or why not.
  std::string apply() {
    add(kReturn, SECCOMP_RET_ALLOW);
    const sock_fprog program{static_cast<unsigned short>(program_.size()), program_.data()};
    if (::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) == 0) return {};
    return std::strerror(errno);
  }

 private:
  static constexpr std::uint16_t kLoad = BPF_LD | BPF_W | BPF_ABS, kEqual = BPF_JMP | BPF_JEQ | BPF_K,
                                 kAtLeast = BPF_JMP | BPF_JGE | BPF_K, kAnyBit = BPF_JMP | BPF_JSET | BPF_K,
                                 kReturn = BPF_RET | BPF_K;
  /// Of a little-endian machine.
  static std::uint32_t lower_half(unsigned argument) {
    return static_cast<std::uint32_t>(offsetof(seccomp_data, args) + sizeof(std::uint64_t) * argument);
  }
  void add(std::uint16_t code, std::uint32_t value, std::uint8_t if_true = 0, std::uint8_t if_false = 0) {
    program_.push_back({code, if_true, if_false, value});
  }
  void judge(std::uint32_t call, unsigned argument, std::initializer_list<std::uint32_t> values,
             std::uint32_t others, std::uint32_t those) {
    const auto count = static_cast<std::uint8_t>(values.size());
    add(kEqual, call, 0, static_cast<std::uint8_t>(count + 3));
    add(kLoad, lower_half(argument));
    std::uint8_t after = count;
    for (const std::uint32_t value : values) add(kEqual, value, after--);
    add(kReturn, others);
    add(kReturn, those);
  }

  std::vector<sock_filter> program_;
};

/// Refuses the network, other processes and what would reach other processes. Empty, or why the kernel does not.
std::string filter_calls() {
  const auto self = static_cast<std::uint32_t>(::getpid());
  CallFilter filter;
  filter.allow_only(__NR_socket, 0, {AF_UNIX}, EACCES);
  // Signals go to this process alone. A group or a thread may belong to another one.
  for (const std::uint32_t call : {__NR_kill, __NR_tgkill, __NR_rt_sigqueueinfo, __NR_rt_tgsigqueueinfo})
    filter.allow_only(call, 0, {self}, EPERM);
  filter.refuse(__NR_tkill, EPERM);
  filter.refuse_if(__NR_fcntl, 1, {F_SETOWN, F_SETOWN_EX}, EPERM);  // where the signals of a file go
  filter.refuse_if(__NR_ioctl, 1, {FIOSETOWN, SIOCSPGRP}, EPERM);
  // Threads, but no processes; clone3 hides its flags, and the C library then calls clone.
  filter.require_flag(__NR_clone, 0, CLONE_THREAD, EPERM);
  filter.refuse(__NR_clone3, ENOSYS);
#if defined(__NR_fork)
  filter.refuse(__NR_fork, EPERM);
  filter.refuse(__NR_vfork, EPERM);
#endif
  // Limits and memory of other processes.
  filter.allow_only(__NR_prlimit64, 0, {0, self}, EPERM);
  constexpr std::uint32_t kPidfdSendSignal = 424, kIoUringSetup = 425, kPidfdGetfd = 438;
  for (const std::uint32_t call : {std::uint32_t{__NR_ptrace}, std::uint32_t{__NR_process_vm_readv},
                                   std::uint32_t{__NR_process_vm_writev}, kPidfdSendSignal, kPidfdGetfd})
    filter.refuse(call, EPERM);
  filter.refuse(kIoUringSetup, ENOSYS);  // it would make calls past this filter
  return filter.apply();
}

/// What the user root may do beyond the files of root.
void drop_capabilities() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> none{};
  static_cast<void>(::syscall(SYS_capset, &header, none.data()));
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

std::string confine(const std::string& writable) {
  static_cast<void>(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0));
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, 256);
  limit(RLIMIT_FSIZE, rlim_t{1} << 30U);
  limit(RLIMIT_RTPRIO, 0);
  deny_writing(writable);
  drop_capabilities();
  const std::string why = filter_calls();
  if (why.empty()) return {};
  return "is not confined: the kernel refuses a filter of system calls (" + why +
         "). It can open the network, start processes and send signals to others";
}

void limit_memory(std::uint64_t bytes) {
  limit(RLIMIT_AS, static_cast<rlim_t>(bytes));
}

}  // namespace takt::fmu_host
