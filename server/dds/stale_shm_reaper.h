#pragma once
// Periodically removes the shared memory of killed clients (transport/fastdds/stale_shm.h), on a thread of
// its own.
#include <chrono>
#include <thread>

#include "idl/transport/fastdds/stale_shm.h"
#include "idl/transport/stoppable_sleep.h"

namespace takt {

class StaleShmReaper {
 private:
  static constexpr std::chrono::seconds kEvery{20};
  std::jthread thread_{[](const std::stop_token& stop) {
    do (void)remove_stale_shared_memory();
    while (sleep_unless_stopped(stop, kEvery));
  }};
};

}  // namespace takt
