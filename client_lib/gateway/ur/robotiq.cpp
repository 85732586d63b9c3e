#include "client_lib/gateway/ur/robotiq.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "idl/common/text.h"

namespace takt::ur {
namespace {

constexpr int kLargest = 255;
constexpr double kLeastForceShare = 1.0 / 12.0;
/// A command shows in the gripper's state after this time.
constexpr double kReaction_s = 0.25;
/// Of the requested position, in counts.
constexpr int kArrived = 2;
enum Object : int { kMoves = 0, kStoppedOpening = 1, kStoppedClosing = 2, kAtRequest = 3 };

int position_of(const MeasuredGripper& gripper) {
  if (gripper.most_width_m <= 0.0) return 0;
  const double share = 1.0 - gripper.width_m / gripper.most_width_m;
  return static_cast<int>(std::lround(kLargest * std::clamp(share, 0.0, 1.0)));
}

std::string_view next_word(std::string_view& text) {
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r"), text.size());
  const std::size_t end = std::min(text.find_first_of(" \t\r", begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

}  // namespace

RobotiqGripper::Answer RobotiqGripper::answer(std::string_view line, const MeasuredGripper& gripper,
                                              double time_s) {
  const std::string verb = lower_text(next_word(line));  // programs of URScript send get and set
  if (verb == "set") return set(line, gripper, time_s);
  const std::string name(next_word(line));
  const int value = verb == "get" ? value_of(name, gripper, time_s) : -1;
  return {value < 0 ? "?\n" : name + " " + std::to_string(value) + "\n"};
}

RobotiqGripper::Answer RobotiqGripper::set(std::string_view pairs, const MeasuredGripper& gripper,
                                           double time_s) {
  auto changed = set_;
  bool goes = false;
  for (std::string_view name = next_word(pairs); !name.empty(); name = next_word(pairs)) {
    const std::string_view digits = next_word(pairs);
    int value = -1;
    const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const auto variable = changed.find(name);
    if (variable == changed.end() || problem != std::errc{} || end != digits.data() + digits.size() ||
        value < 0 || value > kLargest)
      return {"?\n"};  // and nothing is set
    variable->second = value;
    goes = goes || name == "POS" || name == "GTO" || name == "FOR";
  }
  const bool stops = set_["GTO"] != 0 && changed["GTO"] == 0;
  set_ = std::move(changed);
  if (!goes || set_["ACT"] == 0 || (set_["GTO"] == 0 && !stops)) return {"ack"};
  Command command;
  command.force_N = gripper.most_force_N * (kLeastForceShare + (1.0 - kLeastForceShare) * set_["FOR"] /
                                                                   static_cast<double>(kLargest));
  command.width_m =
      stops ? gripper.width_m : gripper.most_width_m * (1.0 - set_["POS"] / static_cast<double>(kLargest));
  requested_ = stops ? position_of(gripper) : set_["POS"];
  commanded_s_ = time_s;
  return {"ack", command};
}

int RobotiqGripper::value_of(std::string_view name, const MeasuredGripper& gripper, double time_s) const {
  if (name == "POS") return position_of(gripper);
  if (name == "PRE") return set_.find("POS")->second;
  if (name == "STA") return set_.find("ACT")->second != 0 ? 3 : 0;
  if (name == "OBJ") return object(gripper, time_s);
  if (name == "FLT") return 0;
  const auto found = set_.find(name);
  return found == set_.end() ? -1 : found->second;
}

int RobotiqGripper::object(const MeasuredGripper& gripper, double time_s) const {
  const int position = position_of(gripper);
  const bool fresh = requested_ && time_s < commanded_s_ + kReaction_s;
  if (!requested_) return gripper.moves ? kMoves : gripper.holds ? kStoppedClosing : kAtRequest;
  if (std::abs(position - *requested_) <= kArrived && !gripper.moves) return kAtRequest;
  if (gripper.moves || fresh) return kMoves;
  return *requested_ > position ? kStoppedClosing : kStoppedOpening;
}

}  // namespace takt::ur
