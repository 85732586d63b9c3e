#include "client_lib/tools/takt/interruption.h"

#include <csignal>

namespace takt::tool {
namespace {
volatile std::sig_atomic_t noted = 0;
}

extern "C" void takt_note_signal(int) {
  noted = 1;
}

void note_interruptions() {
  std::signal(SIGINT, takt_note_signal);
  std::signal(SIGTERM, takt_note_signal);
}

bool interrupted() {
  return noted != 0;
}

}  // namespace takt::tool
