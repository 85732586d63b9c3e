#include "tests/support/step_path_counts.h"

#include <dlfcn.h>
#include <linux/futex.h>
#include <pthread.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <new>

using takt::test::allocations;
using takt::test::counting;
using takt::test::locks;

namespace {

void* counted(std::size_t size) {
  if (counting) ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}

/// The function of the C library that the one of this program stands before.
template <typename Lock>
int locked(std::atomic<int (*)(Lock*)>& original, const char* name, Lock* lock) {
  if (counting) ++locks;
  auto function = original.load(std::memory_order_relaxed);
  if (function == nullptr) {
    function = reinterpret_cast<int (*)(Lock*)>(dlsym(RTLD_NEXT, name));
    original.store(function, std::memory_order_relaxed);
  }
  return function(lock);
}
std::atomic<int (*)(pthread_mutex_t*)> mutex_lock{nullptr};
std::atomic<int (*)(pthread_rwlock_t*)> read_lock{nullptr}, write_lock{nullptr};

}  // namespace

void* operator new(std::size_t size) {
  return counted(size);
}
void* operator new[](std::size_t size) {
  return counted(size);
}
// The nothrow forms too: else our delete would free memory of a sanitizer's own new.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept try {
  return counted(size);
} catch (const std::bad_alloc&) {
  return nullptr;
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept try {
  return counted(size);
} catch (const std::bad_alloc&) {
  return nullptr;
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

extern "C" {
int pthread_mutex_lock(pthread_mutex_t* mutex) {
  return locked(mutex_lock, "pthread_mutex_lock", mutex);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) {
  return locked(read_lock, "pthread_rwlock_rdlock", lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) {
  return locked(write_lock, "pthread_rwlock_wrlock", lock);
}
}

#if defined(__x86_64__) && defined(PR_SET_SYSCALL_USER_DISPATCH)
// Calls made from here pass: the return from the signal handler, and the calls that the handler executes.
extern "C" {
void takt_test_signal_return();
long takt_test_system_call(long number, long a, long b, long c, long d, long e, long f);
extern const char takt_test_calls_begin[], takt_test_calls_end[];
}
asm(R"(
.pushsection .text
.globl takt_test_calls_begin, takt_test_calls_end, takt_test_signal_return, takt_test_system_call
takt_test_calls_begin:
.type takt_test_signal_return, @function
takt_test_signal_return:
  mov $15, %eax
  syscall
  ud2
.type takt_test_system_call, @function
takt_test_system_call:
  mov %rdi, %rax
  mov %rsi, %rdi
  mov %rdx, %rsi
  mov %rcx, %rdx
  mov %r8, %r10
  mov %r9, %r8
  mov 8(%rsp), %r9
  syscall
  ret
takt_test_calls_end:
  nop
.popsection
)");
#endif

namespace takt::test {
namespace {

constexpr std::size_t kMaxCalls = 512;
std::array<std::uint64_t, kMaxCalls> calls{};  // of the one thread that counts
std::uint64_t waking_calls = 0;

}  // namespace

ThreadUsage thread_usage() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt + usage.ru_majflt, usage.ru_nvcsw};
}

std::uint64_t SystemCallCount::wakes() const {
  return waking_calls;
}
std::uint64_t SystemCallCount::others() const {
  std::uint64_t sum = 0;
  for (const std::uint64_t count : calls) sum += count;
  return sum;
}
std::string SystemCallCount::listed() const {
  std::string text;
  for (std::size_t number = 0; number < calls.size(); ++number) {
    if (calls[number] > 0) text += std::to_string(number) + " x" + std::to_string(calls[number]) + " ";
  }
  return text;
}

#if defined(__x86_64__) && defined(PR_SET_SYSCALL_USER_DISPATCH)

namespace {

volatile char selector = SYSCALL_DISPATCH_FILTER_ALLOW;

void execute(int, siginfo_t* info, void* context) {
  greg_t* const registers = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
  const long number = info->si_syscall;
  const bool wakes = number == SYS_futex && (registers[REG_RSI] & FUTEX_CMD_MASK) == FUTEX_WAKE;
  if (wakes) {
    ++waking_calls;
  } else {
    ++calls[static_cast<std::size_t>(number) % kMaxCalls];
  }
  registers[REG_RAX] =
      takt_test_system_call(number, registers[REG_RDI], registers[REG_RSI], registers[REG_RDX],
                            registers[REG_R10], registers[REG_R8], registers[REG_R9]);
}

bool dispatch(bool on) {
  const long length = takt_test_calls_end - takt_test_calls_begin;
  return prctl(PR_SET_SYSCALL_USER_DISPATCH, on ? PR_SYS_DISPATCH_ON : PR_SYS_DISPATCH_OFF,
               on ? takt_test_calls_begin : nullptr, on ? length : 0L, on ? &selector : nullptr) == 0;
}

}  // namespace

bool SystemCallCount::possible() {
  return dispatch(true) && dispatch(false);
}

void SystemCallCount::begin() {
  calls = {};
  waking_calls = 0;
  // The structure of the kernel: the C library would set a return function of its own, whose calls do not
  // pass.
  struct {
    void (*handler)(int, siginfo_t*, void*);
    unsigned long flags;
    void (*restorer)();
    std::uint64_t mask;
  } action{execute, SA_SIGINFO | 0x04000000UL, takt_test_signal_return, 0};
  syscall(SYS_rt_sigaction, SIGSYS, &action, nullptr, sizeof(std::uint64_t));
  dispatch(true);
  selector = SYSCALL_DISPATCH_FILTER_BLOCK;
}

void SystemCallCount::end() {
  selector = SYSCALL_DISPATCH_FILTER_ALLOW;
  dispatch(false);
}

#else

bool SystemCallCount::possible() {
  return false;
}
void SystemCallCount::begin() {}
void SystemCallCount::end() {}

#endif

}  // namespace takt::test
