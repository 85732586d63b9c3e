// takt-egm: a robot of a cell as the controller of an EGM program, or as the follower of an ABB controller.
#include "client_lib/tools/gateway_program.h"
#include "client_lib/tools/takt_egm/egm_session.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  takt-egm config/gateways/egm_controller.yaml --start               the robot answers to an EGM program of yours
  takt-egm config/gateways/egm_controller.yaml --lockstep --start    the same, with the same bits in each run
  takt-egm config/gateways/egm_sensor.yaml --start                the robot follows a controller or RobotStudio

The mapping file names the robot and the role (docs/controllers_rsi_egm.md).

Exit codes: 0 ended by --until or a signal; 1 failed; 2 wrong usage.)";

}  // namespace

int main(int argc, char** argv) {
  return takt::tool::run_gateway_program(
      {.name = "takt-egm",
       .description = "ABB's Externally Guided Motion for one robot of a takt cell.",
       .footer = kExamples,
       .lockstep = "each message waits for its answer, and the cell for both",
       .run = takt::tool::run_egm},
      argc, argv);
}
