#include "client_lib/gateway/egm/follower.h"

#include <utility>

namespace takt::gateway::egm {

std::vector<double> Follower::joints_of(const Robot& robot, bool planned) {
  const Motion& motion = planned ? robot.planned : robot.feed_back;
  std::vector<double> joints = motion.joints;
  if (!joints.empty())
    joints.insert(joints.end(), motion.external_joints.begin(), motion.external_joints.end());
  return joints;
}

Reception Follower::receive(std::string_view bytes, double arrival_s) {
  Reception made;
  auto parsed = decode_robot(bytes);
  if (parsed.message && joints_of(*parsed.message, options_.planned).empty())
    parsed = {std::nullopt, options_.planned ? "planned has no joints" : "feedBack has no joints"};
  if (!parsed.message) {
    ++invalid_;
    made.fault = std::move(parsed.fault);
    return made;
  }
  const Robot& robot = *parsed.message;
  const bool begins = messages_ == 0 || silent(arrival_s) || (robot.header.seqno == 0 && last_seqno_ > 0);
  const PeerClock::Reading reading = clock_.read(robot.header.tm_ms.value_or(0), arrival_s, begins);
  ++messages_;
  last_arrival_s_ = arrival_s;
  made.old = reading.old;
  if (made.old) return made;
  last_seqno_ = robot.header.seqno;
  made.restarted = reading.restarted;
  if (made.restarted) ++restarts_;
  made.time_s = reading.time_s;
  made.drives = robot.motors != MotorState::off && robot.mci != MciState::error;
  made.state = std::move(parsed.message);
  return made;
}

std::string Follower::answer(const RapidData& data, std::uint32_t tm_ms) {
  Sensor sensor;
  sensor.header = {answer_seqno_++, tm_ms, MessageType::correction};
  sensor.rapid_data = data;
  return encode(sensor);
}

}  // namespace takt::gateway::egm
