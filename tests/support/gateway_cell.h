#pragma once
// A server program, a client, and the command lines of a gateway and of its peer in Python.
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/program_cell.h"
#include "tests/support/rsi_examples.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {

/// A UDP port for each domain, so that tests may run side by side; beyond those that Linux gives to any socket, below those of
/// DDS in the domains of tests.
inline int gateway_port() {
  return 61'000 + static_cast<int>(test_domain() % 50);
}

/// A server, a client, a gateway and its peer.
class GatewayCell : public ProgramCell {
 public:
  explicit GatewayCell(const std::string& scenario, int level_of_detail = 1)
      : ProgramCell("gateway", scenario, level_of_detail) {}

  /// `mapping` without its version line; `xml` is the Ethernet configuration.
  std::vector<std::string> gateway(const std::string& protocol, const std::string& mapping,
                                   std::vector<std::string> arguments, const std::string& xml = kRsiXml) {
    directory_.write("rsi.xml", xml);
    directory_.write("mapping.yaml", "takt_" + protocol + ": 1\nport: " + std::to_string(gateway_port()) +
                                         "\naddress: 127.0.0.1\n" + mapping);
    arguments.insert(arguments.begin(), directory_ / "mapping.yaml");
    return command("takt-" + protocol, arguments);
  }
  static std::vector<std::string> peer(const std::string& program, std::vector<std::string> arguments) {
    std::vector<std::string> command{"/usr/bin/python3", "-B",
                                     std::string(TAKT_SOURCE_DIR) + "/tests/support/programs/" + program,
                                     std::to_string(gateway_port())};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return command;
  }

  ChildProcess takt(const std::vector<std::string>& arguments) const {
    return ChildProcess(command("takt", arguments));
  }
  /// Not older than the cell is now: the gateway or its peer may have seen more of it than this client.
  State present_state() {
    client().get_state();
    return client().state();
  }
  double axis1_deg() { return present_state().robot("Robot1").position.at(0) * 180.0 / M_PI; }

 private:
  TemporaryDirectory directory_;
};

}  // namespace takt::test
