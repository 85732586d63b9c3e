#include "server/devices/screw_joints.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/contact/holding/component_interaction.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {
constexpr KindSignal kThreadSignals[] = {reported("turns", "", "that the part is out of its seat"),
                                         reported_flag("held", "the thread holds the part")};
constexpr KindSignal kScrewdriverSignals[] = {
    commanded("speed", "rad/s", "±`max_speed_rad_per_s`", "of the bit; positive turns a part out"),
    reported("torque", "N m", "of the bit, without sign"),
    reported_flag("engaged", "the bit meets the head of a part with a `thread`"),
    reported("power", "W", "torque times speed"), reported("energy", "J", "since the start")};
constexpr KindSignal kNutRunnerSignals[] = {
    commanded("speed", "rad/s", "0 to `max_speed_rad_per_s`", "of the bit, which turns a part in"),
    commanded("torque_limit", "N m", "0 to `max_torque_N_m`", "where it stops"),
    reported("torque", "N m", "of the bit"),
    reported("angle", "rad", "since `speed` has become positive"),
    reported_flag("engaged", "the bit meets the head of a part with a `thread`"),
    reported_flag("done", "`torque_limit` has been reached since `speed` has become positive"),
    reported("power", "W", "torque times speed"),
    reported("energy", "J", "since the start")};
}  // namespace

void describe(Fields& f, ScenarioScrewJoint& s) {
  f.field("in", s.held_by.component, Text{},
          "Part or ground that the part is screwed into; a part without a thread of its own.", kRequired);
  s.held_by.place = f.place("in");
  f.field("pitch_m", s.pitch_m, positive("m"), "Travel for each turn.", kRequired);
  f.field("length_m", s.length_m, positive("m"), "Length that is engaged at the start.", kRequired);
  f.field("driving_torque_N_m", s.driving_torque_N_m, positive("N m"), "Torque that turns it, either way.",
          kRequired);
  f.field("axis", s.axis_B, vector3(""),
          "Direction in which it comes out, in the frame of the part; of any length.");
  f.check(s.axis_B.norm() > 1e-6, "axis", "a vector without direction", "e.g. [0, 0, 1]");
  f.field("head_m", s.p_BH, vector3("m"), "Where a screwdriver meets it, in the frame of the part.");
  f.field("stiffness_N_per_m", s.stiffness_N_per_m, positive("N/m"),
          "Stiffness of the thread at level of detail 3.");
  f.section(
      "hole",
      "Where the part sits when it is screwed in, in the frame of `in`; with it the part starts outside.",
      s.X_HB, [&](Pose& pose) { f.pose("pose", pose, "Pose of the seated part."); });
}

namespace {
Pose initial_pose(const CellModel& cell, int component) {
  for (const RigidBodyParameters& part : cell.parts)
    if (part.body == component) return part.X_WB_initial;
  for (const GroundModel& ground : cell.grounds)
    if (ground.component == component) return ground.X_WB;
  return {};
}
}  // namespace

void build(const ScenarioScrewJoint& s, DeviceBuilder& b) {
  ScrewJoints::Joint joint;
  joint.part = b.component;
  joint.holder = b.cell.description.find_component(s.held_by.component);
  joint.law = {s.pitch_m, s.length_m, s.driving_torque_N_m};
  joint.axis_B = s.axis_B.normalized();
  joint.p_BH = s.p_BH;
  joint.stiffness_ratio =
      s.stiffness_N_per_m / b.cell.components[static_cast<std::size_t>(joint.part)].substitute.k_tr_N_per_m;
  ScrewJoints::Model& model = b.mechanism<ScrewJoints>();
  const std::vector<SignalDescription> signals = described(kThreadSignals);
  if (s.X_HB) {
    const struct {
      ScrewJoints::Joint joint;
      Pose X_HB;
    } outside{joint, *s.X_HB};
    joint.device = b.add_signal_table(outside, signals, {0.0, 0.0});
    model.starts_out.resize(model.joints.size(), 0);
    model.starts_out.push_back(1);
  } else {
    joint.device = b.add_signal_table(joint, signals, {0.0, 1.0});
    b.cell.joined.emplace_back(joint.part, joint.holder);
    if (!model.starts_out.empty()) model.starts_out.push_back(0);
  }
  model.seats.push_back(
      s.X_HB ? *s.X_HB : initial_pose(b.cell, joint.holder).inverse() * initial_pose(b.cell, joint.part));
  model.joints.push_back(joint);
}

DeviceType screw_joint_type() {
  return device_type<ScenarioScrewJoint>(DeviceType::Owner::part, "thread",
                                         "The part is screwed in at the start.", "", false, kThreadSignals);
}

void describe(Fields& f, ScenarioScrewdriver& s) {
  f.field("gripper", s.gripper, f.name_of({"grippers"}, "a gripper"),
          "Gripper whose tool centre point carries the bit, along its z axis.", kRequired);
  f.field("max_speed_rad_per_s", s.max_speed_rad_per_s, positive("rad/s"),
          "Largest speed that may be commanded.", kRequired);
  f.field("max_torque_N_m", s.max_torque_N_m, positive("N m"), "Largest torque.", kRequired);
  f.field("reach_m", s.reach_m, positive("m"),
          "Largest distance of the tool centre point from the head of a screw.");
}

void build(const ScenarioScrewdriver& s, DeviceBuilder& b) {
  ScrewJoints::Screwdriver driver;
  driver.max_torque_N_m = s.max_torque_N_m;
  driver.reach_m = s.reach_m;
  const auto& gripper =
      b.cell.description.grippers[static_cast<std::size_t>(b.cell.description.find_gripper(s.gripper))];
  driver.palm = gripper.component;
  driver.X_GT = gripper.X_GT;
  const double fastest = s.max_speed_rad_per_s;
  driver.device = b.add_signal_table(driver, described(kScrewdriverSignals, {{-fastest, fastest}}));
  b.mechanism<ScrewJoints>().screwdrivers.push_back(driver);
}

DeviceType screwdriver_type() {
  return device_type<ScenarioScrewdriver>(
      DeviceType::Owner::cell, "screwdrivers", "Screwdrivers.",
      "A bit at the tool centre point of a gripper, which turns parts with a `thread`.", true,
      kScrewdriverSignals);
}

void describe(Fields& f, ScenarioNutRunner& s) {
  f.field("gripper", s.gripper, f.name_of({"grippers"}, "a gripper"),
          "Gripper whose tool centre point carries the bit, along its z axis.", kRequired);
  f.field("max_speed_rad_per_s", s.max_speed_rad_per_s, positive("rad/s"),
          "Largest speed that may be commanded.", kRequired);
  f.field("max_torque_N_m", s.max_torque_N_m, positive("N m"), "Largest torque limit.", kRequired);
  f.field("stiffness_N_m_per_rad", s.stiffness_N_m_per_rad, positive("N m/rad"),
          "Rise of the torque with the angle, beyond the seat of the screw.", kRequired);
  f.field("reach_m", s.reach_m, positive("m"),
          "Largest distance of the tool centre point from the head of a screw.");
}

void build(const ScenarioNutRunner& s, DeviceBuilder& b) {
  ScrewJoints::NutRunner runner;
  const auto& gripper =
      b.cell.description.grippers[static_cast<std::size_t>(b.cell.description.find_gripper(s.gripper))];
  runner.palm = gripper.component;
  runner.X_GT = gripper.X_GT;
  runner.reach_m = s.reach_m;
  runner.tightening.stiffness_N_m_per_rad = s.stiffness_N_m_per_rad;
  runner.device = b.add_signal_table(
      runner, described(kNutRunnerSignals, {{0.0, s.max_speed_rad_per_s}, {0.0, s.max_torque_N_m}}),
      {0.0, s.max_torque_N_m});
  b.mechanism<ScrewJoints>().runners.push_back(runner);
}

DeviceType nut_runner_type() {
  return device_type<ScenarioNutRunner>(
      DeviceType::Owner::cell, "nut_runners", "Nut runners.",
      "A bit at the tool centre point of a gripper, which turns parts with a `thread` in, up to a torque.",
      true, kNutRunnerSignals);
}

namespace {
// A Part that is out is taken by its thread from this distance of where it came out.
constexpr double kAtThread_m = 1e-3;
// A bit meets a head whose axis it is in line with to within 10 degrees.
constexpr double kInLine = 0.984807753012208;
}  // namespace

void ScrewJoints::start(ComponentInteraction& interaction) {
  for (std::size_t i = 0; i < turned_rad_.size(); ++i) {
    turned_rad_[i] = starts_out(i) ? model_.joints[i].law.whole_angle_rad() : 0.0;
    tight_rad_[i] = tight_N_m_[i] = 0.0;
    if (starts_out(i)) continue;
    interaction.attach(model_.joints[i].part, model_.joints[i].holder);
  }
  std::fill(running_.begin(), running_.end(), 0);
}

bool ScrewJoints::is_held(const Joint& joint, const ComponentInteraction& interaction) const {
  return interaction.attached_to(joint.part) == joint.holder;
}

void ScrewJoints::choose_stiffness(const std::function<bool(int)>& by_contact,
                                   ComponentInteraction& interaction) const {
  for (const Joint& joint : model_.joints) {
    const bool own = by_contact(joint.part) && is_held(joint, interaction);
    interaction.set_stiffness(joint.part, own ? joint.stiffness_ratio : 1.0);
  }
}

int ScrewJoints::engaged_joint(int palm, const Pose& X_GT, double reach_m, const CellMotion& motion) const {
  const Pose X_WT = motion.bodies[static_cast<std::size_t>(palm)].X_WB * X_GT;
  int nearest = -1;
  double distance = reach_m;
  for (std::size_t i = 0; i < model_.joints.size(); ++i) {
    const Joint& joint = model_.joints[i];
    const Pose& X_WB = motion.bodies[static_cast<std::size_t>(joint.part)].X_WB;
    const double away = (X_WB * joint.p_BH - X_WT.p).norm();
    if (away > distance || X_WT.R.col(2).dot(X_WB.R * joint.axis_B) > -kInLine) continue;
    nearest = static_cast<int>(i);
    distance = away;
  }
  return nearest;
}

bool ScrewJoints::update(double h, const CellMotion& motion, CellPlant& plant,
                         ComponentInteraction& interaction) {
  bool changed = false;
  for (const Screwdriver& driver : model_.screwdrivers) {
    SignalTable& signals = signal_table(plant, driver.device);
    const int met = engaged_joint(driver.palm, driver.X_GT, driver.reach_m, motion);
    ThreadTurn turn;
    if (met >= 0 && is_held(model_.joints[static_cast<std::size_t>(met)], interaction)) {
      const auto i = static_cast<std::size_t>(met);
      const Joint& joint = model_.joints[i];
      const double wanted = plant.motion_allowed() ? signals.value(speed) : 0.0;
      if (tight_rad_[i] > 0.0 && wanted > 0.0) {  // loosened first
        turn.torque_N_m = std::min(tight_N_m_[i], driver.max_torque_N_m);
        const double by = turn.torque_N_m < tight_N_m_[i] ? 0.0 : std::min(wanted * h, tight_rad_[i]);
        tight_rad_[i] -= by;
        tight_N_m_[i] -= (tight_N_m_[i] - joint.law.driving_torque_N_m) * by / (tight_rad_[i] + by);
        interaction.turn(joint.part, {joint.axis_B, by, 0.0, h, turn.torque_N_m, driver.palm});
        signals.report(power, turn.torque_N_m * by / h);
        signals.report(energy, signals.value(energy) + turn.torque_N_m * by);
        signals.report(torque, turn.torque_N_m);
        signals.report(engaged, 1.0);
        continue;
      }
      turn = turn_thread(joint.law, turned_rad_[i], wanted, driver.max_torque_N_m, h);
      if (turn.torque_N_m > 0.0) {
        const double sense = signals.value(speed) > 0.0 ? 1.0 : -1.0;
        interaction.turn(joint.part, {joint.axis_B, turn.angle_rad, joint.law.travel_m(turn.angle_rad), h,
                                      sense * turn.torque_N_m, driver.palm});
      }
      turned_rad_[i] += turn.angle_rad;
      if (turn.free) {
        interaction.detach(joint.part);
        changed = true;
      }
    }
    signals.report(torque, turn.torque_N_m);
    signals.report(engaged, met >= 0 ? 1.0 : 0.0);
    signals.report(power, turn.torque_N_m * std::abs(turn.angle_rad) / h);
    signals.report(energy, signals.value(energy) + turn.torque_N_m * std::abs(turn.angle_rad));
  }
  for (std::size_t i = 0; i < model_.runners.size(); ++i) changed |= run(i, h, motion, plant, interaction);
  for (std::size_t i = 0; i < turned_rad_.size(); ++i) {
    SignalTable& signals = signal_table(plant, model_.joints[i].device);
    signals.report(turns, turned_rad_[i] / (2.0 * std::numbers::pi));
    signals.report(held, is_held(model_.joints[i], interaction) ? 1.0 : 0.0);
  }
  return changed;
}

bool ScrewJoints::stands_at_thread(std::size_t index, const CellMotion& motion) const {
  const Joint& joint = model_.joints[index];
  const Pose X_WS = motion.bodies[static_cast<std::size_t>(joint.holder)].X_WB * model_.seats[index];
  const Vec3 axis_W = X_WS.R * joint.axis_B;
  const Pose& X_WB = motion.bodies[static_cast<std::size_t>(joint.part)].X_WB;
  return (X_WS.p + joint.law.length_m * axis_W - X_WB.p).norm() <= kAtThread_m &&
         axis_W.dot(X_WB.R * joint.axis_B) >= kInLine;
}

bool ScrewJoints::run(std::size_t index, double h, const CellMotion& motion, CellPlant& plant,
                      ComponentInteraction& interaction) {
  const NutRunner& runner = model_.runners[index];
  SignalTable& signals = signal_table(plant, runner.device);
  const int met = engaged_joint(runner.palm, runner.X_GT, runner.reach_m, motion);
  const double wanted = plant.motion_allowed() ? signals.value(run_speed) : 0.0;
  if (wanted > 0.0 && running_[index] == 0) signals.report(angle, 0.0), signals.report(done, 0.0);
  running_[index] = wanted > 0.0 ? 1 : 0;
  bool changed = false;
  double turned = 0.0, torque_N_m = 0.0;
  if (met >= 0 && wanted > 0.0) {
    const auto i = static_cast<std::size_t>(met);
    const Joint& joint = model_.joints[i];
    const int holder = interaction.attached_to(joint.part);
    if (holder == joint.holder) {
      const ThreadIn in = turn_in(joint.law, runner.tightening, turned_rad_[i], tight_rad_[i], wanted,
                                  signals.value(torque_limit), h);
      turned = in.down_rad + in.tight_rad;
      torque_N_m = in.torque_N_m;
      turned_rad_[i] -= in.down_rad;
      tight_rad_[i] += in.tight_rad;
      if (in.tight_rad > 0.0) tight_N_m_[i] = in.torque_N_m;
      interaction.turn(
          joint.part, {joint.axis_B, -turned, -joint.law.travel_m(in.down_rad), h, -torque_N_m, runner.palm});
      if (in.reached) signals.report(done, 1.0);
    } else if (holder == -1 && stands_at_thread(i, motion) &&
               interaction.attach(joint.part, joint.holder).empty()) {
      turned_rad_[i] = joint.law.whole_angle_rad();
      changed = true;
    }
  }
  signals.report(run_torque, torque_N_m);
  signals.report(angle, signals.value(angle) + turned);
  signals.report(run_engaged, met >= 0 ? 1.0 : 0.0);
  signals.report(run_power, torque_N_m * turned / h);
  signals.report(run_energy, signals.value(run_energy) + torque_N_m * turned);
  return changed;
}

void ScrewJoints::save(StateWriter& out) const {
  out.put(std::span<const double>(turned_rad_));
  if (model_.runners.empty()) return;
  out.put(std::span<const double>(tight_rad_)), out.put(std::span<const double>(tight_N_m_));
  for (const char running : running_) out.put(running != 0);
}

void ScrewJoints::load(StateReader& in) {
  for (std::size_t i = 0; i < turned_rad_.size(); ++i)
    turned_rad_[i] = in.number(0.0, model_.joints[i].law.whole_angle_rad(), "the angle of a thread");
  if (model_.runners.empty()) return;
  in.numbers(tight_rad_, "the angle of a tight screw"), in.numbers(tight_N_m_, "the torque of a tight screw");
  for (char& running : running_) running = in.flag("'a nut runner runs'") ? 1 : 0;
}

}  // namespace takt
