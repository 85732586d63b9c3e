// takt-rsi: a robot of a cell as the KRC of an RSI program, or as the follower of a KRC.
#include "client_lib/tools/gateway_program.h"
#include "client_lib/tools/takt_rsi/rsi_session.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  takt-rsi config/gateways/rsi_controller.yaml --start               the robot answers to an RSI program of yours
  takt-rsi config/gateways/rsi_controller.yaml --lockstep --start    the same, with the same bits in each run
  takt-rsi config/gateways/rsi_sensor_pc.yaml --start                the robot follows a KRC or a virtual controller

The mapping file names the robot, the role and the Ethernet configuration (docs/controllers_rsi_egm.md).

Exit codes: 0 ended by the sensor PC, by --until or a signal; 1 RSI has stopped with an error; 2 wrong usage.)";

}  // namespace

int main(int argc, char** argv) {
  return takt::tool::run_gateway_program(
      {.name = "takt-rsi",
       .description = "KUKA's RobotSensorInterface for one robot of a takt cell.",
       .footer = kExamples,
       .lockstep = "each packet waits for its answer, and the cell for both",
       .run = takt::tool::run_rsi},
      argc, argv);
}
