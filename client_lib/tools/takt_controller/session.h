#pragma once
// One run of a robot program against a cell over DDS.
#include <optional>
#include <string>

#include "client_lib/client.h"
#include "client_lib/controller/controller.h"
#include "idl/common/lockstep.h"

namespace takt::tool {

struct SessionOptions {
  std::string program;
  controller::Parameters parameters;  ///< of the program
  ClientOptions client;
  std::string name = "takt-controller";
  std::optional<Pace> pace;
  bool start = false;
  std::optional<double> until_s;  ///< simulated time
  /// In lockstep: for how many periods the program may run ahead of the cell, while it does not look at it. 0: none.
  std::uint64_t lookahead = kMostLookahead - 1;
};

/// Returns 0 when the program has finished (and `until_s` is reached). When the cell goes away it waits for
/// it and starts the program again, unless `until_s` is given. Throws with the sentence of the program, the client or
/// the server if the program has not finished.
int run_session(const SessionOptions& options);

}  // namespace takt::tool
