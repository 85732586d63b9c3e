#include "client_lib/view/pendant.h"

#include <algorithm>
#include <cmath>

#include "client_lib/kinematics/arm.h"
#include "idl/common/eigen_messages.h"
#include "idl/common/text.h"

namespace takt::view {
namespace {

constexpr std::chrono::seconds kAfter{3};        ///< that the pendant stays a sender
constexpr std::chrono::milliseconds kLook{500};  ///< between two looks whether it may leave
constexpr double kStands = 0.005;                ///< part of a joint's largest speed below which it stands
constexpr double kAcceleration_per_speed = 2.5;  ///< of the tool centre point, 1/s
constexpr double kRotation_per_translation =
    2.5;  ///< speed of the rotation to that of the translation, rad/m

ClientOptions weakest(ClientOptions options) {
  options.name = "pendant";
  options.ownership_strength = 0;
  return options;
}

[[noreturn]] void refuse(ControlResult result, const std::string& sentence) {
  throw ClientError(ClientError::Kind::refused, sentence, result);
}

}  // namespace

Pendant::Pendant(ClientOptions options) : options_(weakest(std::move(options))), thread_([this] { run(); }) {}

Pendant::~Pendant() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

/// Leaves when the motions are over; one that the cell has lost, too.
void Pendant::run() {
  std::unique_lock lock(mutex_);
  while (!over_) {
    if (client_)
      changed_.wait_for(lock, kLook);
    else
      changed_.wait(lock);
    if (!client_ || std::chrono::steady_clock::now() < newest_ + kAfter) continue;
    bool needed = false;
    try {
      needed = client_->connected() && client_->state().time < until_s_;
    } catch (const ClientError&) {
    }
    if (!needed) client_.reset();
  }
}

std::optional<Answer> Pendant::request(const std::string& name, const Arguments& arguments) {
  return answer_one_of<pendant::JogJoints, pendant::JogLine, pendant::StopJogging, pendant::CommandGripper,
                       pendant::CommandSignal>(
      name, arguments, [this](const auto& request) { return execute_as_sender(request); });
}

template <Request Type>
Answer Pendant::execute_as_sender(const Type& request) {
  const std::lock_guard lock(mutex_);
  if (client_ && !client_->connected()) client_.reset();
  if (!client_) client_ = std::make_unique<Client>(options_);
  newest_ = std::chrono::steady_clock::now();
  changed_.notify_all();
  try {
    return execute(request);
  } catch (const ClientError& error) {
    if (!error.result()) throw;
    return {*error.result(), error.what(), {}};
  } catch (const MotionError& error) {
    std::string sentence = error.what();
    sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
    if (sentence.back() != '.') sentence += '.';
    return {ControlResult::failed, sentence, {}};
  }
}

void Pendant::require_free(const char* kind, const std::string& target, int index) const {
  if (index < 0)
    refuse(ControlResult::not_found, "The cell has no " + std::string(kind) + " '" + target + "'.");
  for (const auto& [owned, sender] : client_->status().owners)
    if (owned == target && sender != client_->client_id())
      refuse(ControlResult::incorrect_state,
             "'" + target + "' is commanded by " + sender + "; end that client first.");
}

std::vector<double> Pendant::standing(const std::string& robot) const {
  const auto cell = client_->cell();
  const int index = cell->find_robot(robot);
  require_free("robot", robot, index);
  // Its reply drops older states: the caller may have seen a newer one by a connection of its own.
  (void)client_->get_state();
  const State state = client_->state();
  const auto& joints = cell->robots[static_cast<std::size_t>(index)].joints;
  const auto& now = state.robot(robot);
  for (std::size_t i = 0; i < joints.size() && i < now.velocity.size(); ++i)
    if (std::abs(now.velocity[i]) > kStands * joints[i].max_velocity)
      refuse(ControlResult::incorrect_state, "'" + robot + "' moves; wait until it stands, or stop it.");
  return now.position;
}

template <Request Type>
Answer Pendant::move(const std::string& robot, const std::vector<TrajectoryPoint>& points) {
  const double duration_s = send(robot, points);
  const bool plays = client_->status().state == SimulationState::playing;
  return {ControlResult::ok,
          "'" + robot + "' moves for " + fixed_text(duration_s, 1) + " s" +
              (plays ? "." : " once the simulation plays."),
          arguments_of(ResponseOf<Type>{duration_s})};
}

double Pendant::send(const std::string& robot, const std::vector<TrajectoryPoint>& points) {
  client_->send_trajectory(robot, points);
  const double duration_s = points.empty() ? 0.0 : points.back().time_s;
  until_s_ = client_->state().time + duration_s;
  return duration_s;
}

Answer Pendant::execute(const pendant::JogJoints& request) {
  const std::vector<double> from = standing(request.robot);
  const Arm arm(*client_->cell(), request.robot);
  return move<pendant::JogJoints>(request.robot,
                                  arm.plan_joint_move(from, request.positions, {.speed = request.speed}));
}

Answer Pendant::execute(const pendant::JogLine& request) {
  const std::vector<double> from = standing(request.robot);
  const auto cell = client_->cell();
  Arm arm(*cell, request.robot, request.gripper);
  arm.set_base(client_->state());
  const Pose X_WT = arm.forward_kinematics(from);
  Eigen::Matrix3d R_WJ = Eigen::Matrix3d::Identity();  // J: the frame whose axes count
  if (request.frame == JogFrame::tool) R_WJ = X_WT.R;
  if (request.frame == JogFrame::base) R_WJ = arm.base().R;
  Pose goal = X_WT;
  goal.p += R_WJ * to_eigen(request.translation);
  const Eigen::Vector3d turn_W = R_WJ * to_eigen(request.rotation);
  if (const double angle = turn_W.norm(); angle > 0.0)
    goal.R = Eigen::AngleAxisd(angle, turn_W / angle).toRotationMatrix() * X_WT.R;
  LineOptions options;
  options.speed_m_per_s = request.speed;
  options.acceleration_m_per_s2 = kAcceleration_per_speed * request.speed;
  options.rotation_speed_rad_per_s = kRotation_per_translation * request.speed;
  options.rotation_acceleration_rad_per_s2 = kAcceleration_per_speed * options.rotation_speed_rad_per_s;
  return move<pendant::JogLine>(request.robot, arm.plan_line(from, goal, options));
}

Answer Pendant::execute(const pendant::StopJogging& request) {
  require_free("robot", request.robot, client_->cell()->find_robot(request.robot));
  (void)send(request.robot, {});
  return {ControlResult::ok, "'" + request.robot + "' stops.", {}};
}

Answer Pendant::execute(const pendant::CommandGripper& request) {
  require_free("gripper", request.gripper, client_->cell()->find_gripper(request.gripper));
  client_->set_gripper(request.gripper, request.action, request.width, request.max_force);
  return {ControlResult::ok, "'" + request.gripper + "' is commanded.", {}};
}

Answer Pendant::execute(const pendant::CommandSignal& request) {
  require_free("device", request.device, client_->cell()->find_device(request.device));
  client_->set_signals(request.device, {{request.signal, request.value}});
  return {ControlResult::ok, "'" + request.device + "." + request.signal + "' is commanded.", {}};
}

}  // namespace takt::view
