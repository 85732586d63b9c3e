#include "idl/command_line/output.h"

#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace takt::command_line {
namespace {

/// Whether standard output is a pipe or socket without a reader.
bool nobody_reads() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  return poll(&output, 1, 0) > 0 && (output.revents & (POLLERR | POLLHUP)) != 0;
}

}  // namespace

int with_output_written(const std::string& program, int code) {
  std::cout.flush();
  const bool flushed = std::fflush(stdout) == 0;
  if ((flushed && std::ferror(stdout) == 0 && std::cout.good()) || nobody_reads()) return code;
  std::fprintf(stderr,
               "%s: Standard output cannot be written on; what was to be read there is not complete.\n",
               program.c_str());
  return code == 0 ? 1 : code;
}

}  // namespace takt::command_line
