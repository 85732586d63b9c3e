// takt-modbus: a PLC reads and writes signals and grippers of a cell over Modbus TCP.
#include "client_lib/tools/gateway_program.h"
#include "client_lib/tools/takt_modbus/modbus_session.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  takt-modbus config/gateways/modbus_server.yaml --start               the PLC polls takt
  takt-modbus config/gateways/modbus_client.yaml --start               takt polls the PLC
  takt-modbus config/gateways/modbus_server.yaml --lockstep --start    a test master lets takt pass one period at a time

The mapping file has the addresses (docs/plc.md).

Exit codes: 0 ended by --until or a signal; 1 failed; 2 wrong usage.)";

}  // namespace

int main(int argc, char** argv) {
  return takt::tool::run_gateway_program(
      {.name = "takt-modbus",
       .description = "Modbus TCP for signals, grippers and robots of a takt cell, as server or client.",
       .footer = kExamples,
       .lockstep = "the cell passes one period each time the coil allow_step is written",
       .run = takt::tool::run_modbus},
      argc, argv);
}
