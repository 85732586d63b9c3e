#pragma once
// What the controller says of its program to viewers and recorders: the text once, the steps as they begin and end.
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/controller/controller.h"

namespace takt::tool {

class ProgramReporter {
 public:
  /// Wall time between two samples of the steps, at least.
  static constexpr Seconds kPeriod{0.1};

  /// Keeps the newest steps of the program. `name`: of the controller, as it is registered. All others outlive this.
  ProgramReporter(Client& cell, controller::Controller& controller, const CellInfo& info,
                  const std::string& name);

  /// Sends the program's text. Returns why that is not possible, in a sentence, or an empty text: a secured cell whose
  /// identities are older lets no controller write these topics. Then nothing is sent.
  std::string begin(const std::string& file);
  /// Notes where the program is, and sends its steps if that is due.
  void note(std::uint32_t epoch, double time_s, bool finished);
  /// Whether something has changed that has not been sent.
  bool is_behind() const {
    return sent_changes_ != controller_.steps().changes() || sent_finished_ != finished_;
  }
  /// Sends the steps.
  void send();

 private:
  using Clock = std::chrono::steady_clock;
  Client& cell_;
  controller::Controller& controller_;
  /// Of the robots that the program drives: index, name, steps.
  struct Robot {
    int index;
    std::string name;
    takt_msgs::msg::ProgramSteps steps;
  };
  std::vector<Robot> robots_;
  std::string name_;
  std::uint32_t epoch_ = 0;
  double time_s_ = 0.0;
  bool finished_ = false;
  std::uint64_t sent_changes_ = ~std::uint64_t{0};
  bool sent_finished_ = false;
  Clock::time_point sent_{};
};

}  // namespace takt::tool
