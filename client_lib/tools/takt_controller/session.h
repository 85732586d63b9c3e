#pragma once
// One run of a robot program against a cell over DDS.
#include <optional>
#include <string>

#include "client_lib/client.h"
#include "client_lib/controller/controller.h"

namespace takt::tool {

struct SessionOptions {
  std::string program;
  controller::Parameters parameters;  ///< of the program
  ClientOptions client;
  std::string name = "takt-controller";
  std::optional<Pace> pace;
  bool start = false;
  std::optional<double> until_s;  ///< simulated time
};

/// Returns 0 when the program has finished (and `until_s` is reached). When the cell goes away it waits for
/// it and starts the program again, unless `until_s` is given. Throws with the program's, the client's or the
/// server's own words when it has not.
int run_session(const SessionOptions& options);

/// The cell as the controller library wants it; poses and matrices are taken over bit by bit. Throws
/// std::runtime_error when a gripper is on no robot of the cell or a robot has too many joints.
controller::CellInfo controller_cell(const CellInfo& info);

/// One instant as the controller library wants it; the numbers are those of the state, bit by bit.
controller::Input controller_input(const State& state);

}  // namespace takt::tool
