#include "server/simulation/step/divergence_monitor.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "idl/common/text.h"
#include "plant_models/state_bytes.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {
constexpr double kPassedOn = 3.0;        // from heavy to light
constexpr double kStored_m_per_s = 1.0;  // in springs and surfaces
constexpr double kRunawayJoint = 10.0;   // times the joint's rated value
constexpr double kFurthest = 1e9;        // m, m/s: of saved numbers

double reach(const BodyBox& box) {
  return box.center_B.norm() + box.half_B.norm();
}

std::string place(const Vec3& p) {
  char text[100];
  std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g) m", p.x(), p.y(), p.z());
  return text;
}

/// Of the centre of mass of a body.
Vec3 velocity(const BodyMotion& motion) {
  return motion.V_WB.at(motion.p_WBcm - motion.X_WB.p);
}
}  // namespace

DivergenceMonitor::DivergenceMonitor(const CellModel& model) : model_(model) {
  const Vec3& gravity_W = model.interaction.gravity_W;
  gravity_m_per_s2_ = gravity_W.norm();
  if (gravity_m_per_s2_ > 0.0) up_W_ = -gravity_W / gravity_m_per_s2_;
  double tool_m = 0.0, part_m = 0.0;
  for (const Component& component : model.components) {
    double& longest = component.type == ComponentType::part ? part_m : tool_m;
    if (component.type != ComponentType::ground) longest = std::max(longest, reach(component.box));
  }
  lever_m_ = tool_m + 2.0 * part_m;
  wrenches_.resize(model.components.size());
  reset();
}

void DivergenceMonitor::reset() {
  highest_m_ = -kFurthest;
  given_m_per_s_ = gripper_m_per_s_ = 0.0;
  work_ = {};
  for (std::size_t i = 0; i < model_.parts.size(); ++i) {
    const RigidBodyParameters& part = model_.parts[i];
    BodyMotion motion;
    motion.X_WB = part.X_WB_initial;
    motion.V_WB = part.V_WB_initial;
    motion.p_WBcm = part.X_WB_initial * part.p_BBcm;
    given(i, motion);
  }
}

void DivergenceMonitor::save(StateWriter& out) const {
  out.put(highest_m_), out.put(given_m_per_s_), out.put(gripper_m_per_s_);
  out.put(work_.time_s), out.put(work_.power_W), out.put(work_.net_J), out.put(work_.largest_net_J);
}

void DivergenceMonitor::load(StateReader& in) {
  highest_m_ = in.number("the greatest height");
  given_m_per_s_ = in.number("a speed");
  gripper_m_per_s_ = in.number("a speed");
  work_.time_s = in.number("a time");
  work_.power_W = in.number("a power");
  work_.net_J = in.number("a work");
  work_.largest_net_J = in.number("a work");
}

void DivergenceMonitor::given(std::size_t part, const BodyMotion& motion) {
  highest_m_ = std::max(highest_m_, height(motion.p_WBcm));
  given_m_per_s_ = std::max(given_m_per_s_, speed_of_energy(part, motion));
}

double DivergenceMonitor::height(const Vec3& p_W) const {
  return up_W_.dot(p_W);
}

double DivergenceMonitor::speed_of_energy(std::size_t part, const BodyMotion& motion) const {
  const RigidBodyParameters& p = model_.parts[part];
  const Vec3 w_B = motion.X_WB.R.transpose() * motion.V_WB.w;
  return std::sqrt(velocity(motion).squaredNorm() + w_B.dot(p.I_BBcm_B * w_B) / p.mass_kg);
}

void DivergenceMonitor::note_grippers(const CellMotion& motion, std::span<const int> parts,
                                      const ComponentInteraction& interaction) {
  for (const GripperModel& gripper : model_.grippers) {
    const int palm = gripper.parameters.palm;
    const BodyMotion& body = motion.bodies[static_cast<std::size_t>(palm)];
    const double turn = body.V_WB.w.norm();
    double lever_m = lever_m_;
    if (turn > 0.0) {  // an attached Part may be far away
      for (const int i : parts) {
        const int part = model_.parts[static_cast<std::size_t>(i)].body;
        if (interaction.partner(part) != palm) continue;
        lever_m = std::max(
            lever_m, (motion.bodies[static_cast<std::size_t>(part)].p_WBcm - body.X_WB.p).norm() + lever_m_);
      }
    }
    gripper_m_per_s_ = std::max(gripper_m_per_s_, body.V_WB.v.norm() + turn * lever_m);
    for (const int jaw : gripper.parameters.jaws) {
      const Twist& V = motion.bodies[static_cast<std::size_t>(jaw)].V_WB;
      gripper_m_per_s_ = std::max(gripper_m_per_s_, V.v.norm() + V.w.norm() * lever_m);
    }
  }
}

void DivergenceMonitor::note_carriers(const CellMotion& motion, std::span<const int> parts,
                                      const ComponentInteraction& interaction, const CellPlant& plant) {
  const std::vector<char>& movable = plant.movable_grounds();
  for (std::size_t c = 0; c < movable.size(); ++c) {
    if (movable[c] == 0) continue;
    const Twist& V = motion.bodies[c].V_WB;
    gripper_m_per_s_ = std::max(gripper_m_per_s_, V.v.norm() + V.w.norm() * lever_m_);
  }
  if (movable.empty()) return;
  for (const int i : parts) {
    const int part = model_.parts[static_cast<std::size_t>(i)].body, partner = interaction.partner(part);
    if (partner < 0 || movable[static_cast<std::size_t>(partner)] == 0) continue;
    const BodyMotion& carrier = motion.carrier(partner);
    const Vec3 arm = motion.bodies[static_cast<std::size_t>(part)].p_WBcm - carrier.X_WB.p;
    gripper_m_per_s_ =
        std::max(gripper_m_per_s_, carrier.V_WB.at(arm).norm() + carrier.V_WB.w.norm() * lever_m_);
  }
}

void DivergenceMonitor::note_force_elements(double time_s, const CellMotion& motion, const CellPlant& plant) {
  if (plant.force_elements().empty()) return;
  std::fill(wrenches_.begin(), wrenches_.end(), Wrench{});
  for (const ForceElement* element : plant.force_elements()) element->add_wrenches(motion, wrenches_);
  double power_W = 0.0;
  for (const RigidBodyParameters& part : model_.parts) {
    const auto body = static_cast<std::size_t>(part.body);
    const Wrench& F_Bcm_W = wrenches_[body];
    power_W += F_Bcm_W.f.dot(velocity(motion.bodies[body])) + F_Bcm_W.t.dot(motion.bodies[body].V_WB.w);
  }
  work_.net_J += 0.5 * (work_.power_W + power_W) * (time_s - work_.time_s);
  work_.largest_net_J = std::max(work_.largest_net_J, work_.net_J);
  work_.power_W = power_W;
  work_.time_s = time_s;
}

std::string DivergenceMonitor::outside(const Vec3& p_W) const {
  if (!model_.bounds) return {};
  const auto& [lower, upper] = *model_.bounds;
  if ((p_W.array() >= lower.array()).all() && (p_W.array() <= upper.array()).all()) return {};
  return "outside the world, which reaches from " + place(lower) + " to " + place(upper) +
         " (world.bounds_m)";
}

std::string DivergenceMonitor::runaway_joint(double time_s, const CellPlant& plant) const {
  for (std::size_t r = 0; r < model_.robots.size(); ++r) {
    if (plant.dynamic(r) == nullptr) continue;
    const std::vector<JointModel>& joints = model_.robots[r].arm.joints;
    const auto n = static_cast<std::size_t>(plant.dynamic(r)->joint_count());
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const double speed = std::abs(plant.segment(r)[n + j]);
      if (!(joints[j].max_velocity > 0.0) || speed <= kRunawayJoint * joints[j].max_velocity) continue;
      const std::string unit = joints[j].type == JointType::revolute ? " rad/s" : " m/s";
      std::string text = "joint '";
      text.append(joints[j].name).append("' of ").append(model_.description.robots[r].name);
      text.append(" runs away at t = ")
          .append(number_text(time_s, 6))
          .append(" s: ")
          .append(number_text(speed, 6));
      text.append(unit).append(", more than ten times what it is made for (");
      text.append(number_text(joints[j].max_velocity, 6)).append(unit);
      text.append("); the last accepted state is kept. A smaller solver.step_s, or another ");
      text.append("solver.dynamics.method, may hold it.");
      return text;
    }
  }
  return {};
}

std::string DivergenceMonitor::look(double time_s, std::span<const int> parts, const CellMotion& motion,
                                    const ComponentInteraction& interaction, const CellPlant& plant) {
  note_grippers(motion, parts, interaction);
  note_carriers(motion, parts, interaction, plant);
  note_force_elements(time_s, motion, plant);
  for (const int i : parts) {
    const auto part = static_cast<std::size_t>(i);
    const BodyMotion& body = motion.bodies[static_cast<std::size_t>(model_.parts[part].body)];
    const double h = height(body.p_WBcm);
    highest_m_ = std::max(highest_m_, h);
    const double driven = given_m_per_s_ + gripper_m_per_s_;
    const double speed = speed_of_energy(part, body);
    const double most = kPassedOn * std::sqrt(driven * driven + 2.0 * gravity_m_per_s2_ * (highest_m_ - h) +
                                              2.0 * work_.largest_net_J / model_.parts[part].mass_kg) +
                        kStored_m_per_s;
    const auto name = [&] {
      return model_.components[static_cast<std::size_t>(model_.parts[part].body)].name;
    };
    if (speed > most)
      return name() + " gains energy without a cause at t = " + number_text(time_s, 6) + " s, at " +
             place(body.p_WBcm) + ": it moves as fast as " + number_text(speed, 6) +
             " m/s, while grippers (" + number_text(gripper_m_per_s_, 6) +
             " m/s) and gravity can have given it no more than " + number_text(most, 6) +
             " m/s; the last accepted state is kept. A smaller solver.step_s or solver.tolerance may help; "
             "explicit methods (rk2, rk4) do not hold stiff contact or long steps.";
    if (std::string where = outside(body.p_WBcm); !where.empty())
      return name() + " has left the world at t = " + number_text(time_s, 6) + " s: it is at " +
             place(body.p_WBcm) + ", " + where +
             "; the last accepted state is kept. Does something carry it, or is the step too long? If it "
             "belongs there, widen world.bounds_m.";
  }
  return runaway_joint(time_s, plant);
}

}  // namespace takt
