#include "server/devices/part_holders.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "plant_models/state_bytes.h"
#include "server/contact/holding/component_interaction.h"
#include "server/geometry/convex/distance.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {
constexpr int kMaxCups = 24;
constexpr int kRimPoints = 8;       // of a cup, that must lie on the Part
constexpr double kProbe_m = 1e-5;   // edge of a point
constexpr double kFull = 0.99;      // share of the pressure that counts as all of it
constexpr double kReleased = 0.05;  // share of the pressure at which a cup lets go of any Part
constexpr double kFingerWidth_m = 2e-4, kFingerDepth_m = 0.01;
constexpr double kTouchResolution_m = 1e-8;
constexpr double kTurn = 2.0 * std::numbers::pi;

void describe_place(Fields& f, ScenarioHolderPlace& s) {
  f.field("at", s.on, f.name_of({"grippers", "parts", "grounds"}, "a gripper, a part or a ground"),
          "Component that carries it: a gripper, a tool (a part), or a ground.", kRequired);
  f.section(
      "mount",
      "Its frame in that component, z towards the part; without it: the tool centre point of a gripper, "
      "else the frame of the component.",
      s.X_CH, [&](Pose& pose) { f.pose("pose", pose, "Pose of the frame."); });
}

PartHolders::Holder holder_on(const ScenarioHolderPlace& s, PartHolders::Kind kind, DeviceBuilder& b) {
  PartHolders::Holder holder;
  holder.kind = kind;
  holder.on = b.cell.description.find_component(s.on);
  if (const int gripper = b.cell.description.find_gripper(s.on); gripper >= 0)
    holder.X_CH = b.cell.description.grippers[static_cast<std::size_t>(gripper)].X_GT;
  if (s.X_CH) holder.X_CH = *s.X_CH;
  return holder;
}

struct HolderWords {
  const char *force, *load, *shear;
};
constexpr HolderWords kByPull{"largest pull that it holds at present; 0 without a part",
                              "pull of the part away from it", "load across its axis"};
/// The signals that all holders have, in front of those of the kind.
consteval std::array<KindSignal, 6> of_holder(KindSignal command, HolderWords words) {
  return {command,
          reported_flag("part_present", "it holds a part"),
          reported_count("part", "index of that part among the components, or -1"),
          reported("force", "N", words.force),
          reported("load", "N", words.load),
          reported("shear", "N", words.shear)};
}
template <std::size_t Count>
constexpr std::array<KindSignal, 6 + Count> with(const std::array<KindSignal, 6>& common,
                                                 const KindSignal (&further)[Count]) {
  std::array<KindSignal, 6 + Count> all{};
  std::copy(common.begin(), common.end(), all.begin());
  std::copy(std::begin(further), std::end(further), all.begin() + 6);
  return all;
}
constexpr auto kMagnetSignals = of_holder(commanded_flag("magnet", "1 switches it on, 0 off"), kByPull);
constexpr KindSignal kOfVacuum[] = {reported("pressure", "Pa", "difference to the surroundings"),
                                    reported_count("sealed_cups", "cups whose whole rim lies on the part")};
constexpr auto kVacuumSignals =
    with(of_holder(commanded_flag("vacuum", "1 evacuates, 0 lets air in"), kByPull), kOfVacuum);
constexpr KindSignal kOfJaws[] = {reported("diameter", "m", "between the jaws")};
constexpr auto kThreeJawSignals =
    with(of_holder(commanded_flag("close", "1 closes the jaws, 0 opens them"),
                   {"of each jaw; 0 without a part", "resultant that it transmits to the part", "always 0"}),
         kOfJaws);
constexpr KindSignal kOfChanger[] = {
    reported_count("tool", "number of the coupled tool in `tools`, from 1 on; 0: none")};
constexpr auto kChangerSignals = with(
    of_holder(commanded_flag("couple", "1 locks the tool that is in reach, 0 releases it"),
              {"locking force; 0 without a tool", "resultant that it transmits to the tool", "always 0"}),
    kOfChanger);

void add_holder(DeviceBuilder& b, PartHolders::Holder holder, std::span<const KindSignal> signals) {
  std::vector<double> initial(signals.size(), 0.0);
  initial[PartHolders::part_now] = -1.0;
  if (holder.kind == PartHolders::Kind::three_jaw) initial[PartHolders::diameter_now] = holder.max_diameter_m;
  holder.device = b.add_signal_table(holder, described(signals), initial);
  PartHolders::Model& model = b.mechanism<PartHolders>();
  model.holders.push_back(std::move(holder));
  model.parts.clear(), model.weights_W.clear();
  for (const RigidBodyParameters& part : b.cell.parts) {
    model.parts.push_back(part.body);
    model.weights_W.push_back(part.mass_kg * part.gravity_W);
  }
}
}  // namespace

void describe(Fields& f, ScenarioVacuumGripper::Cup& s) {
  f.field("position_m", s.p_HC, vector3("m"), "Centre of the lip in the frame of the gripper.");
  f.field("diameter_m", s.diameter_m, positive("m"), "Diameter of the sealed area.", kRequired);
}

void describe(Fields& f, ScenarioVacuumGripper& s) {
  describe_place(f, s.place);
  f.list("cups", s.cups, "Suction cups, which seal along the z axis of the frame.",
         "a list of {position_m, diameter_m}", kRequired);
  f.check(!s.cups.empty() && s.cups.size() <= kMaxCups, "cups", std::to_string(s.cups.size()) + " cups",
          "1 to " + std::to_string(kMaxCups) + " of {position_m, diameter_m}");
  f.field("pressure_Pa", s.pressure_Pa,
          NumberRange{.lower = 0.0, .upper = 101325.0, .lower_open = true, .unit = "Pa"},
          "Largest difference to the surroundings, with tight cups.", kRequired);
  f.field("leak", s.leak, NumberRange{.lower = 0.0, .upper = 1.0},
          "Share of the pressure difference that leaks away.");
  f.field("evacuation_time_s", s.evacuation_time_s, positive("s"),
          "Time constant of the pressure when it is switched on.");
  f.field("release_time_s", s.release_time_s, positive("s"), "Time constant when it is switched off.");
  f.field("grip_at", s.grip_at, NumberRange{.lower = 0.1, .upper = 1.0},
          "Share of the reached pressure difference from which it holds a part.");
  f.field("friction", s.friction, not_negative(""), "Coefficient of friction of the lips.");
  f.field("reach_m", s.reach_m, positive("m"), "A cup seals where its rim is no further from the part.");
}

void build(const ScenarioVacuumGripper& s, DeviceBuilder& b) {
  PartHolders::Holder holder = holder_on(s.place, PartHolders::Kind::vacuum, b);
  for (const ScenarioVacuumGripper::Cup& cup : s.cups)
    holder.cups.push_back({cup.p_HC, 0.5 * cup.diameter_m});
  holder.pressure_Pa = s.pressure_Pa * (1.0 - s.leak);
  holder.evacuation_time_s = s.evacuation_time_s;
  holder.release_time_s = s.release_time_s;
  holder.grip_at = s.grip_at;
  holder.friction = s.friction;
  holder.reach_m = s.reach_m;
  add_holder(b, std::move(holder), kVacuumSignals);
}

DeviceType vacuum_gripper_type() {
  return device_type<ScenarioVacuumGripper>(DeviceType::Owner::cell, "vacuum_grippers", "Vacuum grippers.",
                                            "Suction cups that hold a part by the pressure of the air.",
                                            false, kVacuumSignals);
}

void describe(Fields& f, ScenarioMagneticGripper& s) {
  describe_place(f, s.place);
  f.field("force_N", s.force_N, positive("N"), "Holding force on a part that covers the face.", kRequired);
  f.field("residual", s.residual, NumberRange{.lower = 0.0, .upper = 1.0},
          "Share of the force that remains when it is switched off.");
  f.field("friction", s.friction, not_negative(""), "Coefficient of friction of the face.");
  f.field("diameter_m", s.diameter_m, positive("m"), "Diameter of the face, which the part must cover.",
          kRequired);
  f.field("reach_m", s.reach_m, positive("m"), "Largest distance of the rim of the face from the part.");
}

void build(const ScenarioMagneticGripper& s, DeviceBuilder& b) {
  PartHolders::Holder holder = holder_on(s.place, PartHolders::Kind::magnet, b);
  holder.cups.push_back({Vec3::Zero(), 0.5 * s.diameter_m});
  holder.force_N = s.force_N;
  holder.residual = s.residual;
  holder.friction = s.friction;
  holder.reach_m = s.reach_m;
  add_holder(b, std::move(holder), kMagnetSignals);
}

DeviceType magnetic_gripper_type() {
  return device_type<ScenarioMagneticGripper>(DeviceType::Owner::cell, "magnetic_grippers",
                                              "Magnetic grippers.", "A magnet that holds a part.", false,
                                              kMagnetSignals);
}

void describe(Fields& f, ScenarioThreeJawGripper& s) {
  describe_place(f, s.place);
  f.field("max_diameter_m", s.max_diameter_m, positive("m"), "Diameter between the open jaws.", kRequired);
  f.field("jaw_speed_m_per_s", s.jaw_speed_m_per_s, positive("m/s"), "Radial speed of each jaw.", kRequired);
  f.field("force_N", s.force_N, positive("N"), "Force of each jaw.", kRequired);
  f.field("friction", s.friction, positive(""), "Coefficient of friction of the jaws.");
  f.field("finger_length_m", s.finger_length_m, positive("m"),
          "Length of a jaw along z, about the origin of the frame.");
  f.field("centering_m", s.centering_m, positive("m"),
          "It holds a part that all jaws touch when each closes by this length.");
}

void build(const ScenarioThreeJawGripper& s, DeviceBuilder& b) {
  PartHolders::Holder holder = holder_on(s.place, PartHolders::Kind::three_jaw, b);
  holder.max_diameter_m = s.max_diameter_m;
  holder.jaw_speed_m_per_s = s.jaw_speed_m_per_s;
  holder.force_N = s.force_N;
  holder.friction = s.friction;
  holder.finger_length_m = s.finger_length_m;
  holder.centering_m = s.centering_m;
  add_holder(b, std::move(holder), kThreeJawSignals);
}

DeviceType three_jaw_gripper_type() {
  return device_type<ScenarioThreeJawGripper>(DeviceType::Owner::cell, "three_jaw_grippers",
                                              "Three-jaw grippers.", "Three jaws that close towards an axis.",
                                              false, kThreeJawSignals);
}

void describe(Fields& f, ScenarioToolChanger::Tool& s) {
  f.field("part", s.part, f.name_of({"parts"}, "a part"), "The tool.", kRequired);
  f.pose("coupling", s.X_BK, "Frame in the tool that meets the frame of the changer.");
}

void describe(Fields& f, ScenarioToolChanger& s) {
  describe_place(f, s.place);
  f.list("tools", s.tools, "Tools that it can couple.", "a list of {part, coupling}", kRequired);
  f.field("locking_force_N", s.locking_force_N, positive("N"), "Largest load of the coupling.", kRequired);
  f.field("reach_m", s.reach_m, positive("m"), "Largest distance of the two frames when it couples.");
  f.field("reach_rad", s.reach_rad, positive("rad"), "Largest angle between them.");
}

void build(const ScenarioToolChanger& s, DeviceBuilder& b) {
  PartHolders::Holder holder = holder_on(s.place, PartHolders::Kind::changer, b);
  for (const ScenarioToolChanger::Tool& tool : s.tools)
    holder.tools.push_back({b.cell.description.find_component(tool.part), tool.X_BK});
  holder.force_N = s.locking_force_N;
  holder.reach_m = s.reach_m;
  holder.reach_rad = s.reach_rad;
  add_holder(b, std::move(holder), kChangerSignals);
}

DeviceType tool_changer_type() {
  return device_type<ScenarioToolChanger>(DeviceType::Owner::cell, "tool_changers", "Tool changers.",
                                          "A coupling that carries one of several tools.", false,
                                          kChangerSignals);
}

double PartHolders::Cup::area_m2() const {
  return std::numbers::pi * radius_m * radius_m;
}

PartHolders::PartHolders(const Model& model) : model_(model), states_(model.holders.size()) {
  const auto box = [](const Vec3& lower, const Vec3& upper) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i)
      corners.emplace_back((i & 1) != 0 ? upper.x() : lower.x(), (i & 2) != 0 ? upper.y() : lower.y(),
                           (i & 4) != 0 ? upper.z() : lower.z());
    return ConvexShape::from_points(corners);
  };
  probe_ = box(Vec3::Constant(-0.5 * kProbe_m), Vec3::Constant(0.5 * kProbe_m));
  for (const Holder& holder : model.holders) {
    const double half_m = std::max(0.5 * holder.finger_length_m, kProbe_m);
    fingers_.push_back(
        box({0.0, -0.5 * kFingerWidth_m, -half_m}, {kFingerDepth_m, 0.5 * kFingerWidth_m, half_m}));
  }
  near_.reserve(model.parts.size());
  notices_.reserve(model.holders.size());
}

void PartHolders::start(ComponentInteraction&) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    states_[i] = {};
    states_[i].radius_m = 0.5 * model_.holders[i].max_diameter_m;
  }
  notices_.clear();
}

Vec3 PartHolders::transmitted(int part, const CellMotion& motion,
                              const ComponentInteraction& interaction) const {
  Vec3 f_W = Vec3::Zero();
  for (const PairConnection& pair : interaction.connections_of(part))
    f_W += interaction.pair_wrench(pair, motion).f;
  for (std::size_t i = 0; i < states_.size(); ++i)
    if (model_.holders[i].on == part && states_[i].held >= 0)
      f_W += transmitted(states_[i].held, motion, interaction);
  return f_W;
}

double PartHolders::force_of(const Holder& holder, const State& state, bool commanded) const {
  switch (holder.kind) {
    case Kind::vacuum: {
      // The cups that seal are those of the moment in which the Part was taken.
      double area_m2 = 0.0;
      for (std::size_t i = 0; i < holder.cups.size(); ++i)
        if ((state.sealed >> i & 1) != 0) area_m2 += holder.cups[i].area_m2();
      return state.pressure_Pa * area_m2;
    }
    case Kind::magnet:
      return holder.force_N * (commanded ? 1.0 : holder.residual);
    case Kind::three_jaw:
    case Kind::changer:
      break;
  }
  return commanded ? holder.force_N : 0.0;
}

bool PartHolders::carries(const Holder& holder, double force_N, const Vec3& f_H) const {
  if (holder.kind == Kind::changer) return f_H.norm() <= force_N;
  if (holder.kind == Kind::three_jaw) return f_H.norm() <= 3.0 * holder.friction * force_N;
  const double pull_N = -f_H.z();
  return pull_N <= force_N && f_H.head<2>().norm() <= holder.friction * (force_N - pull_N);
}

bool PartHolders::lifts(const Holder& holder, const State& state, const Pose& X_WH, int part) const {
  const auto place = std::lower_bound(model_.parts.begin(), model_.parts.end(), part) - model_.parts.begin();
  const Vec3 f_H = -(X_WH.R.transpose() * model_.weights_W[static_cast<std::size_t>(place)]);
  return carries(holder, force_of(holder, state, true), f_H);
}

bool PartHolders::may_take(const Holder& holder, int part, const ComponentInteraction& interaction) const {
  return part != holder.on && interaction.attached_to(part) == -1 &&
         interaction.attached_to(holder.on) != part;
}

int PartHolders::sealed_cups(const Holder& holder, const Pose& X_WH, int part,
                             ComponentInteraction& interaction) const {
  const CollisionWorld& world = interaction.collision_world();
  int sealed = 0;
  for (std::size_t i = 0; i < holder.cups.size(); ++i) {
    const Cup& cup = holder.cups[i];
    bool tight = true;
    for (int k = 0; k < kRimPoints && tight; ++k) {
      const double angle = kTurn * k / kRimPoints;
      const Vec3 p_H = cup.p_HC + cup.radius_m * Vec3(std::cos(angle), std::sin(angle), 0.0);
      const Pose X_WP{X_WH.R, X_WH * p_H};
      tight = false;
      for (const ConvexShape& shape : world.shapes(part)) {
        if (!shape.box.at(world.pose(part), holder.reach_m).overlaps({X_WP.p, X_WP.p})) continue;
        if (convex_distance(probe_, X_WP, shape, world.pose(part)).distance > holder.reach_m) continue;
        tight = true;
        break;
      }
    }
    if (tight) sealed |= 1 << i;
  }
  return sealed;
}

int PartHolders::find_part(const Holder& holder, State& state, const Pose& X_WH,
                           ComponentInteraction& interaction, const CellMotion& motion) {
  if (holder.kind == Kind::changer) {
    for (std::size_t i = 0; i < holder.tools.size(); ++i) {
      const Tool& tool = holder.tools[i];
      const Pose X_WK = motion.bodies[static_cast<std::size_t>(tool.part)].X_WB * tool.X_BK;
      if (!((X_WK.p - X_WH.p).norm() <= holder.reach_m) || !may_take(holder, tool.part, interaction))
        continue;
      const Eigen::AngleAxisd apart(Mat3(X_WH.R.transpose() * X_WK.R));
      if (std::abs(apart.angle()) > holder.reach_rad) continue;
      state.tool = static_cast<int>(i) + 1;
      return tool.part;
    }
    return -1;
  }
  Vec3 half = Vec3::Zero();
  for (const Cup& cup : holder.cups) half = half.cwiseMax(cup.p_HC.cwiseAbs() + Vec3::Constant(cup.radius_m));
  const Vec3 reach = X_WH.R.cwiseAbs() * half + Vec3::Constant(holder.reach_m);
  interaction.parts_near({X_WH.p - reach, X_WH.p + reach}, near_);
  int found = -1;
  state.sealed = 0;
  // Of several Parts the one that closes most cups, the first in the description.
  for (const int part : near_) {
    if (!may_take(holder, part, interaction)) continue;
    const int sealed = sealed_cups(holder, X_WH, part, interaction);
    if (std::popcount(static_cast<unsigned>(sealed)) <= std::popcount(static_cast<unsigned>(state.sealed)))
      continue;
    state.sealed = sealed;
    found = part;
  }
  return found;
}

int PartHolders::fingers_on(const Holder& holder, const Pose& X_WH, double radius_m, int part,
                            ComponentInteraction& interaction) const {
  const CollisionWorld& world = interaction.collision_world();
  const ConvexShape& finger = fingers_[static_cast<std::size_t>(&holder - model_.holders.data())];
  int touching = 0;
  for (int k = 0; k < 3; ++k) {
    const Mat3 R = X_WH.R * Eigen::AngleAxisd(kTurn * k / 3.0, Vec3::UnitZ()).toRotationMatrix();
    const Pose X_WF{R, X_WH.p + radius_m * R.col(0)};
    for (const ConvexShape& shape : world.shapes(part)) {
      if (!shape.box.at(world.pose(part), 0.0).overlaps(finger.box.at(X_WF, 0.0))) continue;
      if (convex_distance(finger, X_WF, shape, world.pose(part)).distance > 0.0) continue;
      touching |= 1 << k;
      break;
    }
  }
  return touching;
}

int PartHolders::move_jaws(const Holder& holder, State& state, bool closing, double h, const Pose& X_WH,
                           ComponentInteraction& interaction) {
  const double travel_m = holder.jaw_speed_m_per_s * h;
  if (!closing) {
    state.radius_m = std::min(state.radius_m + travel_m, 0.5 * holder.max_diameter_m);
    return -1;
  }
  double to_m = std::max(state.radius_m - travel_m, 0.0);
  const Vec3 reach = X_WH.R.cwiseAbs() * Vec3(state.radius_m, state.radius_m, 0.5 * holder.finger_length_m) +
                     Vec3::Constant(kFingerDepth_m);
  interaction.parts_near({X_WH.p - reach, X_WH.p + reach}, near_);
  int stopped_by = -1;
  for (const int part : near_) {
    if (part == holder.on || fingers_on(holder, X_WH, to_m, part, interaction) == 0) continue;
    double free_m = state.radius_m, blocked_m = to_m;
    if (fingers_on(holder, X_WH, free_m, part, interaction) != 0) blocked_m = free_m;
    while (free_m - blocked_m > kTouchResolution_m) {
      const double middle_m = 0.5 * (free_m + blocked_m);
      (fingers_on(holder, X_WH, middle_m, part, interaction) != 0 ? blocked_m : free_m) = middle_m;
    }
    to_m = free_m;
    stopped_by = part;
  }
  state.radius_m = to_m;
  if (stopped_by < 0 || !may_take(holder, stopped_by, interaction)) return -1;
  const double closed_m = std::max(to_m - holder.centering_m, 0.0);
  return fingers_on(holder, X_WH, closed_m, stopped_by, interaction) == 7 ? stopped_by : -1;
}

bool PartHolders::update(double h, const CellMotion& motion, CellPlant& plant,
                         ComponentInteraction& interaction) {
  bool changed = false;
  for (std::size_t i = 0; i < states_.size(); ++i) update_holder(i, h, motion, plant, interaction, changed);
  return changed;
}

void PartHolders::update_holder(std::size_t index, double h, const CellMotion& motion, CellPlant& plant,
                                ComponentInteraction& interaction, bool& changed) {
  const Holder& holder = model_.holders[index];
  State& state = states_[index];
  SignalTable& signals = signal_table(plant, holder.device);
  const bool commanded = signals.value(on_now) != 0.0;
  const Pose X_WH = motion.bodies[static_cast<std::size_t>(holder.on)].X_WB * holder.X_CH;
  if (!commanded) state.spent = false;
  // A request, a sink or another holder may have taken the Part.
  if (state.held >= 0 && interaction.attached_to(state.held) != holder.on) state.held = -1, state.tool = 0;

  int candidate = -1;
  if (state.held < 0 && holder.kind != Kind::three_jaw && commanded && !state.spent)
    candidate = find_part(holder, state, X_WH, interaction, motion);
  if (holder.kind == Kind::vacuum) {
    const bool tight = state.held >= 0 || candidate >= 0;
    const double to_Pa = commanded && tight ? holder.pressure_Pa : 0.0;
    const double time_s = to_Pa > 0.0 ? holder.evacuation_time_s : holder.release_time_s;
    state.pressure_Pa += (to_Pa - state.pressure_Pa) * -std::expm1(-h / time_s);
    // It holds as soon as it can carry the Part, at the latest with its full pressure: then it loses what is too heavy.
    const double share = state.pressure_Pa / holder.pressure_Pa;
    const bool strong = candidate >= 0 && share >= holder.grip_at &&
                        (share >= kFull || lifts(holder, state, X_WH, candidate));
    if (state.held < 0 && (!commanded || !strong)) candidate = -1;
    if (!tight) state.sealed = 0;
  } else if (holder.kind == Kind::three_jaw && plant.motion_allowed()) {
    if (state.held < 0) candidate = move_jaws(holder, state, commanded, h, X_WH, interaction);
    if (state.spent) candidate = -1;
  }

  const double force_N = force_of(holder, state, commanded);
  Vec3 f_H = Vec3::Zero();
  if (state.held >= 0 && !state.fresh) {
    f_H = X_WH.R.transpose() * transmitted(state.held, motion, interaction);
    const bool let_go = !commanded &&
                        (holder.kind != Kind::vacuum || state.pressure_Pa < kReleased * holder.pressure_Pa) &&
                        (holder.kind != Kind::magnet || holder.residual == 0.0);
    if (let_go || !carries(holder, force_N, f_H)) {
      if (commanded) {
        DeviceNotice notice;
        notice.kind = DeviceNotice::Kind::part_lost;
        notice.device = holder.device;
        notice.part = state.held;
        notice.load_N = f_H.norm();
        notice.force_N = force_N;
        notices_.push_back(notice);
      }
      state.spent = commanded;
      interaction.detach(state.held);
      state.held = -1;
      state.tool = 0;
      changed = true;
    }
  } else if (state.held < 0 && candidate >= 0 && interaction.attach(candidate, holder.on).empty()) {
    state.held = candidate;
    changed = true;
  }
  state.fresh = changed && state.held >= 0 && state.held == candidate;
  signals.report(present_now, state.held >= 0 ? 1.0 : 0.0);
  signals.report(part_now, state.held);
  signals.report(force_now, state.held >= 0 ? force_N : 0.0);
  const bool by_pull = holder.kind == Kind::vacuum || holder.kind == Kind::magnet;
  signals.report(load_now, by_pull ? -f_H.z() : f_H.norm());
  signals.report(shear_now, by_pull ? f_H.head<2>().norm() : 0.0);
  if (holder.kind == Kind::vacuum) {
    signals.report(pressure_now, state.pressure_Pa);
    signals.report(cups_now, std::popcount(static_cast<unsigned>(state.sealed)));
  } else if (holder.kind == Kind::three_jaw) {
    signals.report(diameter_now, 2.0 * state.radius_m);
  } else if (holder.kind == Kind::changer) {
    signals.report(tool_now, state.tool);
  }
}

void PartHolders::save(StateWriter& out) const {
  for (const State& state : states_) {
    out.put(state.held), out.put(state.fresh), out.put(state.spent);
    out.put(state.pressure_Pa), out.put(state.radius_m), out.put(state.sealed), out.put(state.tool);
  }
}

void PartHolders::load(StateReader& in) {
  notices_.clear();
  for (std::size_t i = 0; i < states_.size(); ++i) {
    State& state = states_[i];
    state.held = in.integer<int>(-1, model_.parts.empty() ? -1 : model_.parts.back(), "a held Part");
    if (state.held >= 0 &&
        std::find(model_.parts.begin(), model_.parts.end(), state.held) == model_.parts.end())
      in.fail("what a device holds is no Part");
    state.fresh = in.flag("'taken in this step'");
    state.spent = in.flag("'a Part was lost'");
    state.pressure_Pa = in.number(0.0, 1.1e5, "a pressure");
    state.radius_m = in.number(0.0, 1e3, "the radius of jaws");
    state.sealed = in.integer<int>(0, (1 << kMaxCups) - 1, "the cups that seal");
    state.tool = in.integer<int>(0, static_cast<int>(model_.holders[i].tools.size()), "the number of a tool");
  }
}

}  // namespace takt
