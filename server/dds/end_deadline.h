#pragma once
// Ends a process that does not end by itself: its last threads wait for a library that does not return.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <utility>

#include "idl/transport/stoppable_sleep.h"

namespace takt {

/// From construction to destruction at most `longest` passes: then `sentence` goes to stderr, and the process ends with
/// `code`, without destructors.
class EndDeadline {
 public:
  EndDeadline(std::chrono::milliseconds longest, std::string sentence, int code)
      : thread_([longest, sentence = std::move(sentence), code](const std::stop_token& stop) {
          if (!sleep_unless_stopped(stop, longest)) return;
          std::fprintf(stderr, "%s\n", sentence.c_str());
          std::fflush(nullptr);
          ::_exit(code);
        }) {}

 private:
  std::jthread thread_;
};

}  // namespace takt
