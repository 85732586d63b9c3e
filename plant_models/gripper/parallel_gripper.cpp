#include "plant_models/gripper/parallel_gripper.h"

#include <algorithm>
#include <cmath>

#include "plant_models/state_bytes.h"

namespace takt {

ParallelGripper::ParallelGripper(const ParallelGripperParameters& parameters) : parameters_(parameters) {
  reset();
}

void ParallelGripper::reset() {
  const double half = 0.5 * parameters_.initial_width_m;
  tracks_.fill({0.0, half, half, false});
  force_limit_N_ = std::numeric_limits<double>::infinity();
}

void ParallelGripper::move_to(double t, double width_m) {
  for (const Side side : {left, right}) {
    Track& track = tracks_[static_cast<size_t>(side)];
    const double now = coordinate(t, side);
    const double target = 0.5 * width_m;
    if (track.blocked && target < now) continue;  // still pressed against its obstacle
    track = {t, now, target, false};
  }
}

void ParallelGripper::stop_jaw(double t, Side side, double coordinate_m) {
  tracks_[static_cast<size_t>(side)] = {t, coordinate(t, side), coordinate_m, true};
}

void ParallelGripper::continue_from(double t, Side side, double coordinate_m) {
  Track& track = tracks_[static_cast<size_t>(side)];
  track.t0 = t;
  track.start = coordinate_m;
}

void ParallelGripper::drive_jaw(double t, Side side, double from_m, double to_m) {
  tracks_[static_cast<size_t>(side)] = {t, from_m, to_m, false};
}

double ParallelGripper::coordinate(double t, Side side) const {
  const Track& track = tracks_[static_cast<size_t>(side)];
  const double travel = parameters_.jaw_speed_m_per_s * std::max(0.0, t - track.t0);
  return track.target >= track.start ? std::min(track.target, track.start + travel)
                                     : std::max(track.target, track.start - travel);
}

double ParallelGripper::speed(double t, Side side) const {
  const Track& track = tracks_[static_cast<size_t>(side)];
  const double y = coordinate(t, side);
  if (y == track.target) return 0.0;
  return track.target > y ? parameters_.jaw_speed_m_per_s : -parameters_.jaw_speed_m_per_s;
}

double ParallelGripper::next_time_event(double t) const {
  double next = PlantModel::next_time_event(t);
  for (const Track& track : tracks_) {
    const double arrival = track.t0 + std::abs(track.target - track.start) / parameters_.jaw_speed_m_per_s;
    if (track.target != track.start && arrival > t) next = std::min(next, arrival);
  }
  return next;
}

bool ParallelGripper::closing(double t, Side side) const {
  return coordinate(t, side) > tracks_[static_cast<size_t>(side)].target;
}

bool ParallelGripper::moving(double t) const {
  return coordinate(t, left) != tracks_[0].target || coordinate(t, right) != tracks_[1].target;
}

Pose ParallelGripper::jaw_pose(Side side, double coordinate_m) {
  Pose X_GJ;
  if (side == left) {
    X_GJ.p.y() = coordinate_m;
  } else {
    X_GJ.p.y() = -coordinate_m;
    X_GJ.R.diagonal() = Vec3(-1.0, -1.0, 1.0);
  }
  return X_GJ;
}

void ParallelGripper::save(StateWriter& out) const {
  for (const Track& track : tracks_)
    out.put(track.t0), out.put(track.start), out.put(track.target), out.put(track.blocked);
  out.put(force_limit_N_);
}

void ParallelGripper::load(StateReader& in) {
  constexpr double kLargest_m = 1e3;  // no jaw travels further, and bisections over it end
  for (Track& track : tracks_) {
    track.t0 = in.number("the time of a jaw's command");
    track.start = in.number(-kLargest_m, kLargest_m, "where a jaw began");
    track.target = in.number(-kLargest_m, kLargest_m, "where a jaw goes");
    track.blocked = in.flag("'blocked'");
  }
  force_limit_N_ = in.number(0.0, std::numeric_limits<double>::infinity(), "the limit of a jaw's force");
}

void ParallelGripper::write_motion(double t, const double*, CellMotion& motion) const {
  const ArmMotion& arm = motion.arms[static_cast<size_t>(parameters_.robot)];
  BodyMotion& palm = motion.bodies[static_cast<size_t>(parameters_.palm)];
  palm.X_WB = arm.X_WF * parameters_.X_FG;
  palm.V_WB = {arm.V_WF.at(palm.X_WB.p - arm.X_WF.p), arm.V_WF.w};
  palm.p_WBcm = palm.X_WB.p;
  for (const Side side : {left, right}) {
    const double y = coordinate(t, side);
    BodyMotion& jaw = motion.bodies[static_cast<size_t>(parameters_.jaws[static_cast<size_t>(side)])];
    jaw.X_WB = palm.X_WB * jaw_pose(side, y);
    const Vec3 outwards_W = palm.X_WB.R.col(1) * (side == left ? 1.0 : -1.0);
    jaw.V_WB = {palm.V_WB.at(jaw.X_WB.p - palm.X_WB.p) + speed(t, side) * outwards_W, palm.V_WB.w};
    jaw.p_WBcm = jaw.X_WB.p;
  }
}

}  // namespace takt
