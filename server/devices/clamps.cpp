#include "server/devices/clamps.h"

#include <algorithm>

#include "plant_models/state_bytes.h"
#include "server/contact/holding/component_interaction.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {
constexpr KindSignal kSignals[] = {
    commanded_flag("close", "1 closes the jaws, 0 opens them"),
    reported_flag("closed", "the jaws are at the end of their way"),
    reported_flag("opened", "the jaws are fully open"),
    reported_flag("part_present", "the centre of mass of a part is in the volume"),
    reported_flag("holding", "a part is fixed to the ground")};
}  // namespace

void describe(Fields& f, ScenarioClamp& s) {
  f.field("ground", s.ground, f.name_of({"grounds"}, "a ground"), "Ground that it fixes parts to.",
          kRequired);
  f.field("center_m", s.center_G, vector3("m"),
          "Centre of the volume in which it clamps, in the frame of the ground.");
  f.field("size_m", s.size_m, Vector3{positive("m")},
          "Size of this volume: a part whose centre of mass is inside is clamped.", kRequired);
  f.field("closing_time_s", s.closing_time_s, not_negative("s"), "Time in which the jaws close, and open.");
  f.field("closed", s.closed, Flag{}, "It is closed at the start.");
}

void build(const ScenarioClamp& s, DeviceBuilder& b) {
  Clamps::Clamp clamp;
  clamp.ground = b.cell.description.find_component(s.ground);
  clamp.center_G = s.center_G;
  clamp.size_m = s.size_m;
  clamp.closing_time_s = s.closing_time_s;
  clamp.closed = s.closed;
  const double at_start = s.closed ? 1.0 : 0.0;
  clamp.device =
      b.add_signal_table(clamp, described(kSignals), {at_start, at_start, 1.0 - at_start, 0.0, 0.0});
  b.mechanism<Clamps>().clamps.push_back(clamp);
}

DeviceType clamp_type() {
  return device_type<ScenarioClamp>(DeviceType::Owner::cell, "clamps", "Clamps and fixtures.",
                                    "Jaws that fix parts to a ground while they are closed.", false,
                                    kSignals);
}

void Clamps::start(ComponentInteraction& interaction) {
  const ContactGraph& graph = interaction.graph();
  parts_.clear();
  for (std::size_t c = 0; c < graph.vertices.size(); ++c)
    if (graph.vertices[c].type == ComponentType::part) parts_.push_back(static_cast<int>(c));
  for (std::size_t i = 0; i < states_.size(); ++i) {
    states_[i].share = model_.clamps[i].closed ? 1.0 : 0.0;
    states_[i].held.clear();
    states_[i].held.reserve(parts_.size());
  }
}

bool Clamps::is_inside(const Clamp& clamp, int part, const CellMotion& motion) {
  const Pose& X_WG = motion.bodies[static_cast<std::size_t>(clamp.ground)].X_WB;
  const Vec3 p_G = X_WG.R.transpose() * (motion.bodies[static_cast<std::size_t>(part)].p_WBcm - X_WG.p);
  return ((p_G - clamp.center_G).cwiseAbs().array() <= 0.5 * clamp.size_m.array()).all();
}

bool Clamps::update(double h, const CellMotion& motion, CellPlant& plant, ComponentInteraction& interaction) {
  bool changed = false;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const Clamp& clamp = model_.clamps[i];
    State& state = states_[i];
    SignalTable& signals = signal_table(plant, clamp.device);
    const bool closes = signals.value(close) != 0.0;
    std::erase_if(state.held, [&](int part) { return interaction.attached_to(part) != clamp.ground; });
    bool present = false;
    for (const int part : parts_) {
      if (!is_inside(clamp, part, motion)) continue;
      present = true;
      if (!closes || state.share < 1.0 || interaction.attached_to(part) != -1) continue;
      if (!interaction.attach(part, clamp.ground).empty()) continue;
      state.held.insert(std::lower_bound(state.held.begin(), state.held.end(), part), part);
      changed = true;
    }
    if (!closes) {
      for (const int part : state.held) {
        interaction.detach(part);
        changed = true;
      }
      state.held.clear();
    }
    signals.report(closed, state.share == 1.0 ? 1.0 : 0.0);
    signals.report(opened, state.share == 0.0 ? 1.0 : 0.0);
    signals.report(part_present, present ? 1.0 : 0.0);
    signals.report(holding, state.held.empty() ? 0.0 : 1.0);
    // What holds at the begin of the next step.
    const double way = clamp.closing_time_s > h ? h / clamp.closing_time_s : 1.0;
    state.share = std::clamp(state.share + (closes ? way : -way), 0.0, 1.0);
    if (state.share > 1.0 - 1e-9) state.share = 1.0;
    if (state.share < 1e-9) state.share = 0.0;
  }
  return changed;
}

void Clamps::save(StateWriter& out) const {
  for (const State& state : states_) {
    out.put(state.share);
    out.put_size(state.held.size());
    for (const int part : state.held) out.put(part);
  }
}

void Clamps::load(StateReader& in) {
  for (State& state : states_) {
    state.share = in.number(0.0, 1.0, "the jaws of a clamp");
    state.held.clear();
    int last = -1;
    for (std::size_t i = in.size(parts_.size(), "clamped Parts"); i > 0; --i) {
      const int part = in.integer<int>(last + 1, parts_.empty() ? 0 : parts_.back(), "a clamped Part");
      if (!std::binary_search(parts_.begin(), parts_.end(), part)) in.fail("what a clamp holds is no Part");
      state.held.push_back(part);
      last = part;
    }
  }
}

}  // namespace takt
