#pragma once
// A server program, a client, and the command lines of a gateway and of its peer in Python.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/rsi_examples.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_domain.h"

namespace takt::test {

/// A UDP port for each domain, so that tests may run side by side.
inline int gateway_port() {
  return 42000 + static_cast<int>(test_domain());
}

/// A server, a client, a gateway and its peer.
class GatewayCell {
 public:
  explicit GatewayCell(const std::string& scenario, int level_of_detail = 1)
      : name_("gateway_" + std::to_string(getpid())),
        domain_(std::to_string(test_domain())),
        server_({kBin + "/takt-server", scenario, "--paused", "--cell", name_, "--domain", domain_, "--lod",
                 std::to_string(level_of_detail)}) {
    EXPECT_TRUE(server_.wait_for_output("ready")) << server_.text;
    ClientOptions options;
    options.cell = name_;
    options.domain = std::stoi(domain_);
    options.timeout = Seconds(60.0);
    options.liveliness_timeout = Seconds(60.0);
    client_.emplace(options);
  }
  ~GatewayCell() {
    client_->set_state(SimulationState::quitting);
    EXPECT_EQ(server_.wait(), 0) << server_.text;
  }
  GatewayCell(const GatewayCell&) = delete;
  GatewayCell& operator=(const GatewayCell&) = delete;

  Client& client() { return *client_; }
  /// `mapping` without its version line; `xml` is the Ethernet configuration.
  std::vector<std::string> gateway(const std::string& protocol, const std::string& mapping,
                                   std::vector<std::string> arguments, const std::string& xml = kRsiXml) {
    directory_.write("rsi.xml", xml);
    directory_.write("mapping.yaml", "takt_" + protocol + ": 1\nport: " + std::to_string(gateway_port()) +
                                         "\naddress: 127.0.0.1\n" + mapping);
    std::vector<std::string> command{
        kBin + "/takt-" + protocol, directory_ / "mapping.yaml", "--cell", name_, "--domain", domain_};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return command;
  }
  static std::vector<std::string> peer(const std::string& program, std::vector<std::string> arguments) {
    std::vector<std::string> command{"/usr/bin/python3", "-B",
                                     std::string(TAKT_SOURCE_DIR) + "/tests/support/programs/" + program,
                                     std::to_string(gateway_port())};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return command;
  }

  ChildProcess takt(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {kBin + "/takt", "--cell", name_, "--domain", domain_});
    return ChildProcess(arguments);
  }
  double axis1_deg() { return client_->state().robot("Robot1").position.at(0) * 180.0 / M_PI; }

 private:
  const std::string name_, domain_;
  ChildProcess server_;
  TemporaryDirectory directory_;
  std::optional<Client> client_;
};

}  // namespace takt::test
