#include "server/simulation/step/screw_joints.h"

#include <cmath>
#include <numbers>

#include "plant_models/signal_board.h"
#include "server/contact/holding/component_interaction.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {
// A bit meets a head whose axis it is in line with to within 10 degrees.
constexpr double kInLine = 0.984807753012208;

SignalTable& board(CellPlant& plant, int device) {
  return static_cast<SignalTable&>(plant.device(static_cast<std::size_t>(device)));
}
}  // namespace

ScrewJoints::ScrewJoints(const CellModel& model) : model_(model), turned_rad_(model.threads.size(), 0.0) {}

void ScrewJoints::start(ComponentInteraction& interaction) {
  for (std::size_t i = 0; i < turned_rad_.size(); ++i) {
    turned_rad_[i] = 0.0;
    interaction.attach(model_.threads[i].part, model_.threads[i].holder);
  }
}

bool ScrewJoints::is_held(std::size_t thread, const ComponentInteraction& interaction) const {
  return interaction.attached_to(model_.threads[thread].part) == model_.threads[thread].holder;
}

void ScrewJoints::set_stiffness(std::size_t thread, bool by_contact,
                                ComponentInteraction& interaction) const {
  const ScrewJointModel& model = model_.threads[thread];
  interaction.set_stiffness(model.part,
                            by_contact && is_held(thread, interaction) ? model.stiffness_ratio : 1.0);
}

int ScrewJoints::engaged_thread(const ScrewdriverModel& driver, const CellMotion& motion) const {
  const Pose X_WT = motion.bodies[static_cast<std::size_t>(driver.palm)].X_WB * driver.X_GT;
  int nearest = -1;
  double distance = driver.reach_m;
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    const ScrewJointModel& thread = model_.threads[i];
    const Pose& X_WB = motion.bodies[static_cast<std::size_t>(thread.part)].X_WB;
    const double away = (X_WB * thread.p_BH - X_WT.p).norm();
    if (away > distance || X_WT.R.col(2).dot(X_WB.R * thread.axis_B) > -kInLine) continue;
    nearest = static_cast<int>(i);
    distance = away;
  }
  return nearest;
}

bool ScrewJoints::update(double h, const CellMotion& motion, CellPlant& plant,
                         ComponentInteraction& interaction) {
  bool changed = false;
  for (const ScrewdriverModel& driver : model_.screwdrivers) {
    SignalTable& signals = board(plant, driver.device);
    const int met = engaged_thread(driver, motion);
    ThreadTurn turn;
    if (met >= 0 && is_held(static_cast<std::size_t>(met), interaction)) {
      const auto i = static_cast<std::size_t>(met);
      const ScrewJointModel& thread = model_.threads[i];
      turn = turn_thread(thread.law, turned_rad_[i], signals.value(speed), driver.max_torque_Nm, h);
      if (turn.torque_Nm > 0.0) {
        const double sense = signals.value(speed) > 0.0 ? 1.0 : -1.0;
        interaction.turn(thread.part, {thread.axis_B, turn.angle_rad, thread.law.travel_m(turn.angle_rad), h,
                                       sense * turn.torque_Nm, driver.palm});
      }
      turned_rad_[i] += turn.angle_rad;
      if (turn.free) {
        interaction.detach(thread.part);
        changed = true;
      }
    }
    signals.tell(torque, turn.torque_Nm);
    signals.tell(engaged, met >= 0 ? 1.0 : 0.0);
    signals.tell(power, turn.torque_Nm * std::abs(turn.angle_rad) / h);
    signals.tell(energy, signals.value(energy) + turn.torque_Nm * std::abs(turn.angle_rad));
  }
  for (std::size_t i = 0; i < turned_rad_.size(); ++i) {
    SignalTable& signals = board(plant, model_.threads[i].device);
    signals.tell(turns, turned_rad_[i] / (2.0 * std::numbers::pi));
    signals.tell(held, is_held(i, interaction) ? 1.0 : 0.0);
  }
  return changed;
}

void ScrewJoints::save(StateWriter& out) const {
  out.put(std::span<const double>(turned_rad_));
}

void ScrewJoints::load(StateReader& in) {
  for (std::size_t i = 0; i < turned_rad_.size(); ++i)
    turned_rad_[i] = in.number(0.0, model_.threads[i].law.whole_angle_rad(), "the angle of a thread");
}

}  // namespace takt
