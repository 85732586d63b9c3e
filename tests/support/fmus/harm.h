/* What an FMU can try against the process that runs it, and against others. */
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>

/* One bit for each attempt that is not refused. */
static int harm_others(void) {
  const pid_t other = getppid();
  int done = 0, bit = 1;
  char byte = 0;
  struct iovec here = {&byte, 1}, there = {&done, 1};
  struct rlimit cpu = {RLIM_INFINITY, RLIM_INFINITY};
  int ends[2];
#define ATTEMPT(what) done |= (what) ? bit : 0, bit <<= 1
  ATTEMPT(kill(other, SIGTERM) == 0);
  ATTEMPT(kill(0, 0) == 0);
  ATTEMPT(syscall(SYS_tkill, other, 0) == 0);
  ATTEMPT(syscall(SYS_tgkill, other, other, 0) == 0);
  ATTEMPT(sigqueue(other, 0, (union sigval){0}) == 0);
  ATTEMPT(pipe(ends) == 0 && fcntl(ends[0], F_SETOWN, other) == 0);
  ATTEMPT(ptrace(PTRACE_SEIZE, other, NULL, NULL) == 0);
  ATTEMPT(process_vm_readv(other, &here, 1, &there, 1, 0) > 0);
  ATTEMPT(prlimit(other, RLIMIT_CPU, &cpu, NULL) == 0);
  ATTEMPT(system("true") == 0);
  const pid_t child = fork();
  if (child == 0) _exit(0);
  ATTEMPT(child > 0);
#undef ATTEMPT
  return done;
}

static void write_big_file(void) {
  const int file = open("big", O_CREAT | O_WRONLY, 0600);
  (void)!pwrite(file, "x", 1, (off_t)1 << 30);
}

static void block_signals(void) {
  sigset_t all;
  sigfillset(&all);
  sigprocmask(SIG_BLOCK, &all, NULL);
}

static void print_a_lot(void) {
  for (int i = 0; i < 1 << 20; ++i) puts("a motor that talks"), fputs("and complains\n", stderr);
}

static void* goes_on(void* of_nothing) {
  for (volatile int on = 1; on;) {
  }
  return of_nothing;
}
static void start_thread(void) {
  pthread_t thread;
  pthread_create(&thread, NULL, goes_on, NULL);
}
