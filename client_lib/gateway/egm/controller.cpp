#include "client_lib/gateway/egm/controller.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "client_lib/kinematics/inverse_kinematics.h"
#include "idl/common/text.h"

namespace takt::gateway::egm {
namespace {

constexpr std::size_t kRobotJoints = 6;
/// A seqno this far back comes from a sensor that has restarted.
constexpr std::uint32_t kFarBack = 100;
/// So many old numbers that rise in a row come from a sensor that has restarted.
constexpr int kRising = 5;

/// Factor that takes exp(-rate * dt) of a difference away: stable for every rate and dt.
double share_of(double rate_per_s, double dt_s) {
  return 1.0 - std::exp(-rate_per_s * dt_s);
}

}  // namespace

Pose pose_of(const EgmPose& pose) {
  const Vec3 p = Vec3(pose.position_mm[0], pose.position_mm[1], pose.position_mm[2]) * 1e-3;
  if (pose.euler_deg)
    return {rotation_of_zyx((*pose.euler_deg)[2], (*pose.euler_deg)[1], (*pose.euler_deg)[0]), p};
  const Quat q(pose.quaternion[0], pose.quaternion[1], pose.quaternion[2], pose.quaternion[3]);
  return {q.normalized().toRotationMatrix(), p};
}

EgmPose egm_pose_of(const Pose& X) {
  const Quat q = X.quaternion();
  const auto zyx = zyx_of_rotation(X.R);
  return {{X.p.x() * 1e3, X.p.y() * 1e3, X.p.z() * 1e3},
          {q.w(), q.x(), q.y(), q.z()},
          std::array<double, 3>{zyx[2], zyx[1], zyx[0]}};
}

Controller::Controller(const ControllerOptions& options, std::size_t joint_count, PoseKinematics kinematics)
    : options_(options), count_(joint_count), kinematics_(std::move(kinematics)) {
  if (options_.guidance != Guidance::joint && (!kinematics_.forward || !kinematics_.inverse))
    throw std::invalid_argument("Guidance of the pose or along a path needs a robot of six joints or more.");
}

void Controller::start(const std::vector<double>& joints) {
  planned_ = start_ = reference_ = joints;
  speed_.assign(count_, 0.0);
  filtered_ = speed_reference_ = speed_;
  if (options_.guidance != Guidance::joint) planned_pose_ = reference_pose_ = kinematics_.forward(joints);
  if (options_.guidance == Guidance::path) path_.emplace(planned_pose_, options_.path);
  along_m_ = 0.0;
  correction_m_ = wanted_correction_m_ = Vec3::Zero();
  pose_speed_ = {};
  has_reference_ = converged_ = heard_ = false;
  silent_s_ = running_s_ = within_s_ = 0.0;
  seqno_ = 0;
  last_seqno_.reset();
  rising_old_ = 0;
  session_ = Session::running;
}

Taken Controller::receive(std::string_view bytes) {
  const auto parsed = decode_sensor(bytes);
  if (!parsed.message) {
    fault_ = parsed.fault;
    return Taken::invalid;
  }
  const Sensor& sensor = *parsed.message;
  const std::uint32_t seqno = sensor.header.seqno;
  const bool ordered = sensor.header.has_seqno && session_ != Session::lost && last_seqno_;
  if (ordered && seqno != 0 && seqno <= *last_seqno_ && *last_seqno_ - seqno < kFarBack) {
    rising_old_ = rising_old_ > 0 && seqno > last_old_ ? rising_old_ + 1 : 1;
    last_old_ = seqno;
    if (rising_old_ < kRising) {
      ++old_;
      return Taken::old;
    }
  } else if (ordered && seqno == 0 && *last_seqno_ == 0) {
    ++old_;  // the first message, doubled
    return Taken::old;
  }
  if (session_ == Session::lost) start(planned_);
  if (!take(sensor)) return Taken::invalid;
  rising_old_ = 0;
  if (sensor.header.has_seqno) last_seqno_ = seqno;
  silent_s_ = 0.0;
  heard_ = true;
  ++applied_;
  return Taken::applied;
}

bool Controller::take(const Sensor& sensor) {
  if (sensor.path_correction_mm.has_value() != (options_.guidance == Guidance::path)) {
    fault_ = std::string("41826: the message is one of another mode, ") +
             (sensor.path_correction_mm ? "a path correction; this controller runs EGMActJoint or EGMActPose"
                                        : "no path correction; this controller runs EGMActMove");
    return false;
  }
  if (sensor.path_correction_mm) {
    const auto& correction = *sensor.path_correction_mm;
    wanted_correction_m_ = Vec3(0.0, correction[1], correction[2]) * 1e-3;
    return true;
  }
  static const Motion kNothing;
  const Motion& planned = sensor.planned ? *sensor.planned : kNothing;
  const bool poses = options_.guidance == Guidance::pose;
  // Public clients fill in joints and poses together; a message of the other mode has nothing for this one.
  const bool for_joints = !planned.joints.empty() || !planned.external_joints.empty() ||
                          !sensor.joint_speeds.empty() || !sensor.external_speeds.empty();
  const bool for_pose = planned.pose || !sensor.cartesian_speeds.empty();
  if (poses ? for_joints && !for_pose : for_pose && !for_joints) {
    fault_ = std::string("41826: the message is one of another mode, with ") + (poses ? "joints" : "poses") +
             " alone; this controller runs " + (poses ? "EGMActPose" : "EGMActJoint");
    return false;
  }
  const auto count_is = [&](const std::vector<double>& values, std::size_t wanted, const char* name) {
    if (values.empty() || values.size() == wanted) return true;
    fault_ = std::string(name) + ": found " + std::to_string(values.size()) +
             " numbers; allowed: " + std::to_string(wanted);
    return false;
  };
  const std::size_t robot = std::min(count_, kRobotJoints), external = count_ - robot;
  if (poses) {
    if (!count_is(sensor.cartesian_speeds, 6, "speedRef.cartesians")) return false;
    if (planned.pose) {
      reference_pose_ = pose_of(*planned.pose);
      has_reference_ = true;
    }
    pose_speed_ = {};
    if (sensor.cartesian_speeds.size() == 6) {
      const auto& v = sensor.cartesian_speeds;
      pose_speed_ = {Vec3(v[0], v[1], v[2]) * 1e-3,
                     Vec3(radians_of(v[3]), radians_of(v[4]), radians_of(v[5]))};
    }
  } else {
    if (!count_is(planned.joints, robot, "planned.joints") ||
        !count_is(planned.external_joints, external, "planned.externalJoints") ||
        !count_is(sensor.joint_speeds, robot, "speedRef.joints") ||
        !count_is(sensor.external_speeds, external, "speedRef.externalJoints"))
      return false;
    const auto second = static_cast<std::ptrdiff_t>(robot);
    std::copy(planned.joints.begin(), planned.joints.end(), reference_.begin());
    std::copy(planned.external_joints.begin(), planned.external_joints.end(), reference_.begin() + second);
    has_reference_ = has_reference_ || !(planned.joints.empty() && planned.external_joints.empty());
    std::fill(speed_reference_.begin(), speed_reference_.end(), 0.0);
    std::copy(sensor.joint_speeds.begin(), sensor.joint_speeds.end(), speed_reference_.begin());
    std::copy(sensor.external_speeds.begin(), sensor.external_speeds.end(),
              speed_reference_.begin() + second);
  }
  if (sensor.rapid_data) rapid_data_ = sensor.rapid_data;
  return true;
}

std::vector<double> Controller::speed_to(const Pose& X, double dt_s) {
  std::vector<double> speed(count_, 0.0);
  const auto joints = kinematics_.inverse(X, planned_);
  if (!joints) {
    fault_ = "The reference is out of reach; the robot holds.";
    return speed;
  }
  for (std::size_t i = 0; i < count_; ++i) speed[i] = ((*joints)[i] - planned_[i]) / dt_s;
  return speed;
}

std::vector<double> Controller::wanted_speed(double dt_s) {
  const double share = share_of(options_.position_gain_per_s, dt_s);
  std::vector<double> speed(count_, 0.0);
  if (options_.guidance == Guidance::path) {
    if (!heard_) return speed;
    along_m_ = std::min(along_m_ + 1e-3 * options_.path_speed_mm_per_s * dt_s, path_->length_m());
    correction_m_ += share * (wanted_correction_m_ - correction_m_);
    has_reference_ = along_m_ == path_->length_m();
    reference_pose_ = path_->at(along_m_, correction_m_);
    return speed_to(reference_pose_, dt_s);
  }
  if (options_.guidance == Guidance::joint) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (has_reference_) speed[i] = share / dt_s * (reference_[i] - planned_[i]);
      speed[i] += speed_reference_[i];
    }
    return speed;
  }
  Pose next = planned_pose_;
  Vec3 turn = pose_speed_.w * dt_s;
  next.p += pose_speed_.v * dt_s;
  if (has_reference_) {
    next.p += share * (reference_pose_.p - planned_pose_.p);
    turn += share * rotation_vector(reference_pose_.R * planned_pose_.R.transpose());
  }
  if (const double angle = turn.norm(); angle > 0.0)
    next.R = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * planned_pose_.R;
  return speed_to(next, dt_s);
}

void Controller::step(double dt_s, const std::vector<double>& measured) {
  if (session_ == Session::running && heard_) silent_s_ += dt_s;
  if (session_ == Session::running && silent_s_ > options_.comm_timeout_s) {
    session_ = Session::lost;
    fault_ = "41822: no data from the UdpUc device for " + number_text(options_.comm_timeout_s) +
             " s; RAPID stops and the robot holds.";
  }
  if (session_ != Session::running) {
    std::fill(speed_.begin(), speed_.end(), 0.0);
    return;
  }
  running_s_ += dt_s;
  const std::vector<double> wanted = wanted_speed(dt_s);
  const double ramp = options_.ramp_in_s > 0.0 ? std::min(1.0, running_s_ / options_.ramp_in_s) : 1.0;
  const double smooth =
      options_.low_pass_Hz > 0.0 ? share_of(2.0 * std::numbers::pi * options_.low_pass_Hz, dt_s) : 1.0;
  double fastest = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    filtered_[i] += smooth * (ramp * wanted[i] - filtered_[i]);
    fastest = std::max(fastest, std::abs(filtered_[i]));
  }
  const double most = options_.max_speed_deviation_deg_per_s;
  const double factor = fastest > most ? most / fastest : 1.0;
  if (factor < 1.0) ++limited_;
  const std::vector<double> before = planned_;
  for (std::size_t i = 0; i < count_; ++i) {
    double next = planned_[i] + factor * filtered_[i] * dt_s;
    next = std::clamp(next, start_[i] - options_.max_position_deviation_deg,
                      start_[i] + options_.max_position_deviation_deg);
    if (i < options_.lower.size()) next = std::clamp(next, options_.lower[i], options_.upper[i]);
    planned_[i] = next;
    speed_[i] = (next - before[i]) / dt_s;
  }
  if (options_.guidance != Guidance::joint) planned_pose_ = kinematics_.forward(planned_);
  bool within = has_reference_;
  if (options_.guidance == Guidance::joint) {
    for (std::size_t i = 0; i < count_; ++i)
      within = within && std::abs(reference_[i] - measured[i]) <= options_.convergence_deg;
  } else {
    const Pose at = kinematics_.forward(measured);
    within =
        within && (reference_pose_.p - at.p).norm() * 1e3 <= options_.convergence_mm &&
        degrees_of(rotation_vector(reference_pose_.R * at.R.transpose()).norm()) <= options_.convergence_deg;
  }
  within_s_ = within ? within_s_ + dt_s : 0.0;
  converged_ = within && within_s_ >= options_.condition_time_s;
}

std::string Controller::message(Robot robot, std::uint32_t tm_ms, bool motors_on) {
  const std::size_t count = std::min(count_, kRobotJoints);
  robot.header = {seqno_++, tm_ms, MessageType::data};
  robot.planned.joints.assign(planned_.begin(), planned_.begin() + static_cast<std::ptrdiff_t>(count));
  robot.planned.external_joints.assign(planned_.begin() + static_cast<std::ptrdiff_t>(count), planned_.end());
  robot.planned.time_us = robot.feed_back.time_us;
  const bool running = session_ == Session::running && motors_on;
  robot.motors = motors_on ? MotorState::on : MotorState::off;
  robot.mci = running ? MciState::running : MciState::stopped;
  robot.rapid = running ? RapidState::running : RapidState::stopped;
  robot.converged = converged_;
  return encode(robot);
}

}  // namespace takt::gateway::egm
