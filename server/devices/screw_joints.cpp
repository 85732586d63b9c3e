#include "server/devices/screw_joints.h"

#include <cmath>
#include <numbers>

#include "server/contact/holding/component_interaction.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

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
}

void build(const ScenarioScrewJoint& s, DeviceBuilder& b) {
  ScrewJoints::Joint joint;
  joint.part = b.component;
  joint.holder = b.cell.description.find_component(s.held_by.component);
  joint.law = {s.pitch_m, s.length_m, s.driving_torque_N_m};
  joint.axis_B = s.axis_B.normalized();
  joint.p_BH = s.p_BH;
  joint.stiffness_ratio =
      s.stiffness_N_per_m / b.cell.components[static_cast<std::size_t>(joint.part)].substitute.k_tr_N_per_m;
  joint.device = b.add_signal_table(joint, {reported("turns", ""), reported_flag("held")}, {0.0, 1.0});
  b.cell.joined.emplace_back(joint.part, joint.holder);
  b.mechanism<ScrewJoints>().joints.push_back(joint);
}

DeviceType screw_joint_type() {
  return device_type<ScenarioScrewJoint>(DeviceType::Owner::part, "thread",
                                         "The part is screwed in at the start.", "", false);
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
  driver.device =
      b.add_signal_table(driver, {commanded("speed", "rad/s", -fastest, fastest), reported("torque", "N m"),
                                  reported_flag("engaged"), reported("power", "W"), reported("energy", "J")});
  b.mechanism<ScrewJoints>().screwdrivers.push_back(driver);
}

DeviceType screwdriver_type() {
  return device_type<ScenarioScrewdriver>(
      DeviceType::Owner::cell, "screwdrivers", "Screwdrivers.",
      "A bit at the tool centre point of a gripper, which turns parts with a `thread`.", true);
}

namespace {
// A bit meets a head whose axis it is in line with to within 10 degrees.
constexpr double kInLine = 0.984807753012208;

SignalTable& board(CellPlant& plant, int device) {
  return static_cast<SignalTable&>(plant.device(static_cast<std::size_t>(device)));
}
}  // namespace

void ScrewJoints::start(ComponentInteraction& interaction) {
  for (std::size_t i = 0; i < turned_rad_.size(); ++i) {
    turned_rad_[i] = 0.0;
    interaction.attach(model_.joints[i].part, model_.joints[i].holder);
  }
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

int ScrewJoints::engaged_joint(const Screwdriver& driver, const CellMotion& motion) const {
  const Pose X_WT = motion.bodies[static_cast<std::size_t>(driver.palm)].X_WB * driver.X_GT;
  int nearest = -1;
  double distance = driver.reach_m;
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
    SignalTable& signals = board(plant, driver.device);
    const int met = engaged_joint(driver, motion);
    ThreadTurn turn;
    if (met >= 0 && is_held(model_.joints[static_cast<std::size_t>(met)], interaction)) {
      const auto i = static_cast<std::size_t>(met);
      const Joint& joint = model_.joints[i];
      turn = turn_thread(joint.law, turned_rad_[i], signals.value(speed), driver.max_torque_N_m, h);
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
  for (std::size_t i = 0; i < turned_rad_.size(); ++i) {
    SignalTable& signals = board(plant, model_.joints[i].device);
    signals.report(turns, turned_rad_[i] / (2.0 * std::numbers::pi));
    signals.report(held, is_held(model_.joints[i], interaction) ? 1.0 : 0.0);
  }
  return changed;
}

void ScrewJoints::save(StateWriter& out) const {
  out.put(std::span<const double>(turned_rad_));
}

void ScrewJoints::load(StateReader& in) {
  for (std::size_t i = 0; i < turned_rad_.size(); ++i)
    turned_rad_[i] = in.number(0.0, model_.joints[i].law.whole_angle_rad(), "the angle of a thread");
}

}  // namespace takt
