#pragma once
// What both roles of takt-ur take from the command line.
#include <string>

#include "client_lib/client.h"

namespace takt::ur {

struct GatewayRun {
  ClientOptions client;
  std::string mapping_file;  ///< empty: defaults for the cell's robot
  std::string robot;         ///< without a mapping
  std::string address;       ///< to listen at, in place of the mapping's; of the controller that is followed
  bool start = false;        ///< sets the pace and plays
  bool lockstep = false;     ///< the cell waits for each cycle
};

/// takt looks like a UR controller. Runs until a signal; returns the exit code. Throws ClientError, ScenarioError,
/// gateway::SocketError.
int run_controller(const GatewayRun& options);
/// The same in lockstep.
int run_lockstep(const GatewayRun& options);
/// takt's robot follows a UR controller.
int run_follower(const GatewayRun& options);

}  // namespace takt::ur
