#pragma once
// A server program with a client, at a cell and a domain of their own.
#include <gtest/gtest.h>
#include <unistd.h>

#include <optional>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/test_domain.h"

namespace takt::test {

class ProgramCell {
 public:
  ProgramCell(const std::string& prefix, const std::string& scenario, int level_of_detail = 1)
      : name_(prefix + "_" + std::to_string(getpid())),
        domain_(std::to_string(test_domain())),
        server_(command("takt-server", {scenario, "--paused", "--lod", std::to_string(level_of_detail)})) {
    EXPECT_TRUE(server_.wait_for_output("ready")) << server_.text;
    ClientOptions options;
    options.cell = name_;
    options.domain = std::stoi(domain_);
    options.timeout = Seconds(60.0);
    options.liveliness_timeout = Seconds(60.0);
    client_.emplace(options);
  }
  ~ProgramCell() {
    client_->set_state(SimulationState::quitting);
    EXPECT_EQ(server_.wait(), 0) << server_.text;
  }
  ProgramCell(const ProgramCell&) = delete;
  ProgramCell& operator=(const ProgramCell&) = delete;

  Client& client() { return *client_; }
  /// A program of takt at this cell.
  std::vector<std::string> command(const std::string& program,
                                   const std::vector<std::string>& arguments) const {
    std::vector<std::string> all{kBin + "/" + program};
    all.insert(all.end(), arguments.begin(), arguments.end());
    all.insert(all.end(), {"--cell", name_, "--domain", domain_});
    return all;
  }

 private:
  const std::string name_, domain_;
  ChildProcess server_;
  std::optional<Client> client_;
};

}  // namespace takt::test
