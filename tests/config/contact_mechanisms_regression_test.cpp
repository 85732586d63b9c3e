// Mechanisms of curved surfaces against the closed forms that engineers calculate with: a pair of gears, a screw
// that is tightened, a lamp with a round thread in its socket, a nut that a robot threads onto its bolt.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "config/meshes/generator/cap_screw_meshes.h"
#include "config/meshes/generator/lamp_meshes.h"
#include "config/meshes/generator/screw_meshes.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"

namespace takt {
namespace {

constexpr double kMechanismPi = std::numbers::pi;

/// A shipped scenario. `look` is called with the cell and the instant after each step.
class MechanismRun {
 public:
  explicit MechanismRun(const std::string& scene, const std::vector<std::string>& overrides = {}) {
    ScenarioOptions options;
    options.overrides = overrides;
    scenario_ =
        read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / (scene + ".yaml"), options);
    cell_ = build_cell(scenario_);
  }

  void run(double duration_s, const std::function<void(const Snapshot&)>& look) {
    Simulation simulation(cell_);
    Snapshot snapshot = simulation.make_snapshot();
    HeadlessOptions options;
    options.duration_s = duration_s;
    options.program = scenario_.controller_program;
    const HeadlessResult result = run_headless(simulation, scenario_, options, [&](const Simulation& s) {
      s.read_snapshot(snapshot);
      look(snapshot);
    });
    EXPECT_EQ(result.fault, "");
  }
  std::size_t component(const char* name) const {
    return static_cast<std::size_t>(cell_->description.find_component(name));
  }
  const RigidBodyParameters& part(std::size_t index) const { return cell_->parts[index]; }
  double g() const { return scenario_.gravity_m_per_s2.norm(); }
  /// The contact of two components; null if they do not press. `sign`: of its wrench on the first one.
  const ContactSample* contact(const Snapshot& snapshot, std::size_t on, std::size_t by, double& sign) const {
    for (const ContactSample& c : snapshot.contacts.pressing()) {
      const auto base = static_cast<std::size_t>(c.base), target = static_cast<std::size_t>(c.target);
      if ((base == on && target == by) || (base == by && target == on)) {
        sign = base == on ? 1.0 : -1.0;
        return &c;
      }
    }
    return nullptr;
  }

 private:
  Scenario scenario_;
  std::shared_ptr<const CellModel> cell_;
};

struct MeanValue {
  double sum = 0.0;
  int count = 0;
  void add(double value) { sum += value, ++count; }
  double value() const { return sum / count; }
};

double about_z(const ComponentSample& c) {
  const Mat3 R = c.q_WB.toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

TEST(GearPair, InvolutesTurnTheWheelByTheRatioOfTheirTeeth) {
  const meshes::GearParameters g;
  const double base_1 = 0.5 * g.module * g.pinion_teeth * std::cos(g.pressure_angle),
               base_2 = 0.5 * g.module * g.wheel_teeth * std::cos(g.pressure_angle);
  const double half_gap_m =
      g.backlash * std::cos(g.pressure_angle);  // of two flanks, along the line of action
  MechanismRun scene("contact/gear_pair");
  const std::size_t pinion = scene.component("Pinion"), wheel = scene.component("Wheel");
  const double e_m = 0.012, weight_N = scene.part(0).mass_kg * scene.g();
  const double I_1 = scene.part(0).I_BBcm_B(2, 2) + scene.part(0).mass_kg * e_m * e_m,
               I_2 = scene.part(1).I_BBcm_B(2, 2);
  const double start = kMechanismPi / g.wheel_teeth;
  MeanValue driving_gap_m, driven_gap_m, energy_ratio, torque_on_pinion, torque_on_wheel;
  Vec3 force = Vec3::Zero();
  double first_speed = 0.0, last_speed = 0.0, first_s = 0.0, last_s = 0.0;
  scene.run(0.2, [&](const Snapshot& s) {
    const ComponentSample &c1 = s.components[pinion], &c2 = s.components[wheel];
    const double a = about_z(c1), b = about_z(c2) - start, w1 = c1.V_WB.w.z(), w2 = c2.V_WB.w.z();
    if (s.time_s > 0.08)
      energy_ratio.add(0.5 * (I_1 * w1 * w1 + I_2 * w2 * w2) / (weight_N * e_m * std::sin(-a)));
    const bool driving = s.time_s > 0.06 && s.time_s<0.135, driven = s.time_s> 0.165;
    double sign = 0.0;
    const ContactSample* contact = scene.contact(s, wheel, pinion, sign);
    if (driving && torque_on_wheel.count == 0) first_speed = w2, first_s = s.time_s;
    if (driving) last_speed = w2, last_s = s.time_s;
    const Vec3 F = contact != nullptr ? Vec3(sign * contact->F_base_W.f) : Vec3::Zero();
    const Vec3 p = contact != nullptr ? contact->p_WC : Vec3::Zero();
    if (driving) {
      force += F;
      torque_on_wheel.add((p - c2.p_WB).cross(F).z());
      torque_on_pinion.add(-(p - c1.p_WB).cross(F).z());
    }
    if (contact == nullptr || !(driving || driven)) return;
    // Of the flanks that press, along the line of action; bearings and flanks give.
    const Vec3 n(std::sin(g.pressure_angle),
                 driving ? -std::cos(g.pressure_angle) : std::cos(g.pressure_angle), 0.0);
    const Vec3 apart = c2.p_WB - c1.p_WB - Vec3(0.5 * g.module * (g.pinion_teeth + g.wheel_teeth), 0.0, 0.0);
    const double turned_m = base_2 * b + base_1 * a;
    (driving ? driving_gap_m : driven_gap_m)
        .add(n.dot(apart) + (driving ? turned_m : -turned_m) + half_gap_m +
             contact->result.largest_penetration_m);
  });
  EXPECT_GT(driving_gap_m.count, 40);
  EXPECT_GT(driven_gap_m.count, 20);
  EXPECT_NEAR(driving_gap_m.value(), 0.0, 8e-6);
  EXPECT_NEAR(driven_gap_m.value(), 0.0, 8e-6);
  EXPECT_NEAR(energy_ratio.value(), 1.0, 0.015);
  const double ratio = static_cast<double>(g.wheel_teeth) / g.pinion_teeth;
  EXPECT_NEAR(torque_on_wheel.value() / torque_on_pinion.value(), ratio, 0.01 * ratio);
  EXPECT_NEAR(std::atan2(force.x(), -force.y()), g.pressure_angle, 0.01);
  EXPECT_NEAR(torque_on_wheel.value() * (last_s - first_s), I_2 * (last_speed - first_speed),
              0.02 * I_2 * (last_speed - first_speed));
  RecordProperty("gaps_um", std::to_string(1e6 * driving_gap_m.value()) + " " +
                                std::to_string(1e6 * driven_gap_m.value()));
  RecordProperty("energy", std::to_string(energy_ratio.value()));
}

/// M = F (r tan(lambda + rho) + mu r_head), tan lambda = pitch / (2 pi r), tan rho = mu / cos 30 deg.
TEST(ScrewTightened, TheTorqueIsThatOfThreadAndHead) {
  const meshes::CapScrewParameters p;
  constexpr double kFriction = 0.12;
  const double r = 0.5 * p.diameter - 0.3248 * p.pitch, outer = meshes::head_radius(p),
               inner = meshes::washer_inner_radius(p);
  const double r_head =
      2.0 / 3.0 * (std::pow(outer, 3) - std::pow(inner, 3)) / (outer * outer - inner * inner);
  const double lever_m = r * std::tan(std::atan(p.pitch / (2.0 * kMechanismPi * r)) +
                                      std::atan(kFriction / std::cos(kMechanismPi / 6.0))) +
                         kFriction * r_head;
  // Half a turn deeper than in the scene.
  MechanismRun scene("contact/screw_tightened",
                     {"parts.Screw.pose={position_m: [0, 0, 0.0080904], rpy_deg: [180, 0, 180]}",
                      "robots.Spindle.trajectory.end_rad=[-1.8584]"});
  const std::size_t screw = scene.component("Screw"), washer = scene.component("Washer"),
                    driver = scene.component("Driver");
  MeanValue running_N_m, lever;
  double tension_N = 0.0;
  scene.run(0.26, [&](const Snapshot& s) {
    double on_head = 0.0, on_socket = 0.0;
    const ContactSample* head = scene.contact(s, screw, washer, on_head);
    const ContactSample* bit = scene.contact(s, screw, driver, on_socket);
    const ComponentSample& c = s.components[screw];
    tension_N = head != nullptr ? on_head * head->F_base_W.f.z() : 0.0;
    const double torque_N_m =
        bit == nullptr ? 0.0
                       : -on_socket * (bit->F_base_W.t + (bit->p_WC - c.p_WB).cross(bit->F_base_W.f)).z();
    if (s.time_s > 0.05 && head == nullptr) running_N_m.add(torque_N_m);
    if (tension_N > 10.0 && c.V_WB.w.z() < -1.0) lever.add(torque_N_m / tension_N);
  });
  EXPECT_GT(running_N_m.count, 50);
  EXPECT_LT(std::abs(running_N_m.value()), 1e-3);
  EXPECT_GT(tension_N, 30.0);
  EXPECT_GT(lever.count, 15);
  EXPECT_NEAR(lever.value(), lever_m, 0.04 * lever_m);
  RecordProperty("lever_mm", std::to_string(1e3 * lever.value()) + " " + std::to_string(1e3 * lever_m));
}

/// phi'' = g L / (I / m + h L), h = pitch / 2 pi, L = r tan(lambda - atan(mu / cos b)): arcs of the radius R
/// touch under the angle b, sin b = (2 R - depth + clearance) / 2 R, in the middle between their centres.
TEST(LampInSocket, ARoundThreadTurnsAsTheRigidScrewDoes) {
  const meshes::LampParameters p;
  const double depth = p.crest_radius - p.root_radius,
               arc = (0.25 * p.pitch * p.pitch + depth * depth) / (4.0 * depth),
               beside = 2.0 * arc - depth + p.clearance;
  const double r = p.crest_radius - arc + 0.5 * beside, h = p.pitch / (2.0 * kMechanismPi),
               cos_b = std::sqrt(1.0 - std::pow(0.5 * beside / arc, 2));
  const double lever = r * std::tan(std::atan(h / r) - std::atan(0.02 / cos_b));
  MechanismRun scene("contact/lamp_in_socket");
  const std::size_t lamp = scene.component("Lamp");
  const double expected =
      scene.g() * lever / (scene.part(0).I_BBcm_B(2, 2) / scene.part(0).mass_kg + h * lever);
  // From where the play is gone.
  struct {
    double time_s, angle, speed, z_m;
  } first{}, last{};
  scene.run(0.4, [&](const Snapshot& s) {
    const ComponentSample& c = s.components[lamp];
    last = {s.time_s, about_z(c), c.V_WB.w.z(), c.p_WB.z()};
    if (first.time_s == 0.0 && s.time_s > 0.1) first = last;
  });
  EXPECT_NEAR((last.speed - first.speed) / (last.time_s - first.time_s), -expected, 0.06 * expected);
  EXPECT_NEAR(last.z_m - first.z_m, h * (last.angle - first.angle), 1e-5);
  RecordProperty("acceleration", std::to_string((last.speed - first.speed) / (last.time_s - first.time_s)) +
                                     " " + std::to_string(expected));
}

/// In the thread M = F r tan(lambda + rho), tan lambda = lead / (2 pi r), tan rho = mu / cos 30 deg, and on the spacer
/// F mu r_face: r_face is the mean radius of the nut's hexagon around the spacer's hole.
TEST(NutOnBolt, ARobotThreadsItAndTheTorqueIsThatOfThreadAndFace) {
  const meshes::ScrewParameters p;
  constexpr double kFriction = 0.12;
  const double r = 0.5 * p.diameter - 0.3248 * p.pitch, hole = 0.55 * p.diameter;
  const double thread_lever_m = r * std::tan(std::atan(p.pitch / (2.0 * kMechanismPi * r)) +
                                             std::atan(kFriction / std::cos(kMechanismPi / 6.0)));
  double moment = 0.0, area = 0.0;
  for (int i = 0; i < 1000; ++i) {  // a twelfth of the hexagon
    const double edge = 0.5 * p.across_flats / std::cos(kMechanismPi / 6.0 * (i + 0.5) / 1000.0);
    moment += (std::pow(edge, 3) - std::pow(hole, 3)) / 3.0;
    area += (edge * edge - hole * hole) / 2.0;
  }
  const double face_lever_m = kFriction * moment / area;

  MechanismRun scene("nut_on_bolt");
  const std::size_t nut = scene.component("Nut"), bolt = scene.component("Bolt"),
                    spacer = scene.component("Spacer");
  struct Load {
    double force_N = 0.0, torque_N_m = 0.0;  // onto the nut: along its axis, against its turning
  };
  const auto load = [&](const Snapshot& s, std::size_t by) {
    double sign = 0.0;
    const ContactSample* c = scene.contact(s, nut, by, sign);
    if (c == nullptr) return Load{};
    const Vec3 lever_W = c->p_WC - s.components[nut].p_WB;
    return Load{std::abs(c->F_base_W.f.z()), sign * (c->F_base_W.t + lever_W.cross(c->F_base_W.f)).z()};
  };
  MeanValue thread, face;
  double tension_N = 0.0, tightest_N = 0.0, resting_z_m = 0.0;
  scene.run(57.5, [&](const Snapshot& s) {
    const Load on_thread = load(s, bolt), on_face = load(s, spacer);
    tension_N = on_face.force_N;
    tightest_N = std::max(tightest_N, tension_N);
    resting_z_m = s.components[nut].p_WB.z();
    if (tension_N < 600.0 || s.components[nut].V_WB.w.z() > -0.05) return;
    thread.add(on_thread.torque_N_m / on_thread.force_N);
    face.add(on_face.torque_N_m / on_face.force_N);
  });
  EXPECT_GT(thread.count, 20);
  EXPECT_NEAR(thread.value(), thread_lever_m, 0.02 * thread_lever_m);
  EXPECT_NEAR(face.value(), face_lever_m, 0.01 * face_lever_m);
  // The jaws are open: the thread locks itself, after it has sprung back a little (at tolerances of 1e-4 and 2.5e-5 the
  // tensions differ by 0.2 N).
  EXPECT_NEAR(tightest_N, 803.24, 0.2);
  EXPECT_NEAR(tension_N, tightest_N, 0.03 * tightest_N);
  EXPECT_NEAR(resting_z_m, 0.71 + p.spacer_height, 2e-4);
  RecordProperty("levers_mm",
                 std::to_string(1e3 * thread.value()) + " " + std::to_string(1e3 * thread_lever_m) + " " +
                     std::to_string(1e3 * face.value()) + " " + std::to_string(1e3 * face_lever_m));
}

}  // namespace
}  // namespace takt
