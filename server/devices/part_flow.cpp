#include "server/devices/part_flow.h"

#include <algorithm>

#include "plant_models/state_bytes.h"
#include "server/contact/holding/component_interaction.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {
constexpr double kRounding_s = 1e-9;
constexpr KindSignal kSourceSignals[] = {
    commanded_flag("release", "1 lets parts enter: one each `period_s`, or one for each change from 0 to 1"),
    reported_count("released", "parts that have entered"),
    reported_count("available", "parts of the pool that wait outside of the cell"),
    reported_flag("blocked", "a part is due, but its place is not free or the pool is empty"),
    reported_count("part", "index of the last part that has entered among the components, or -1")};
constexpr KindSignal kSinkSignals[] = {
    commanded_flag("enabled", "1 takes parts out, 0 leaves them"),
    reported_count("removed", "parts that have been taken out"),
    reported_count("part", "index of the last part that has been taken out among the components, or -1")};

/// The mechanism of the cell with its pools.
PartFlow::Model& flow_of(DeviceBuilder& b) {
  PartFlow::Model& model = b.mechanism<PartFlow>();
  model.pools = b.cell.pools;
  model.jaws.clear();
  for (const GripperDescription& gripper : b.cell.description.grippers)
    for (const int jaw : {gripper.left_jaw, gripper.right_jaw}) model.jaws.push_back(jaw);
  model.is_gripper.clear();
  for (const Component& component : b.cell.components)
    model.is_gripper.push_back(component.type == ComponentType::gripper ? 1 : 0);
  return model;
}

std::size_t pool_of(const DeviceBuilder& b, const std::string& name) {
  const auto is_it = [&name](const PartPool& pool) { return pool.name == name; };
  return static_cast<std::size_t>(std::find_if(b.cell.pools.begin(), b.cell.pools.end(), is_it) -
                                  b.cell.pools.begin());
}
}  // namespace

void describe(Fields& f, ScenarioSource& s) {
  f.field("pool", s.pool, f.name_of({"pools"}, "a pool"), "Pool of the parts.", kRequired);
  f.pose("pose", s.X_WB, "Where a part enters the cell.");
  f.section("twist", "Velocity of a part that enters, of its origin, in axes of the world.", [&] {
    f.field("velocity_m_per_s", s.V_WB.v, vector3("m/s"), "Linear velocity.");
    f.field("angular_velocity_rad_per_s", s.V_WB.w, vector3("rad/s"), "Angular velocity.");
  });
  f.field("period_s", s.period_s, not_negative("s"),
          "While `release` is 1 a part enters each period, the first at once; 0: one for each change of "
          "`release` "
          "from 0 to 1.");
  f.field("release", s.released_at_start, Flag{}, "Value of the signal `release` at the start.");
}

void build(const ScenarioSource& s, DeviceBuilder& b) {
  PartFlow::Source source;
  source.pool = pool_of(b, s.pool);
  source.X_WB = s.X_WB;
  source.V_WB = s.V_WB;
  source.period_s = s.period_s;
  source.released_at_start = s.released_at_start;
  const auto count = static_cast<double>(b.cell.pools[source.pool].parts.size());
  source.device = b.add_signal_table(source, described(kSourceSignals),
                                     {s.released_at_start ? 1.0 : 0.0, 0.0, count, 0.0, -1.0});
  flow_of(b).sources.push_back(source);
}

DeviceType source_type() {
  return device_type<ScenarioSource>(DeviceType::Owner::cell, "sources", "Sources of parts.",
                                     "A place where parts of a pool enter the cell.", false, kSourceSignals);
}

void describe(Fields& f, ScenarioSink& s) {
  f.field("pools", s.pools, ListOf<NameOf>{f.name_of({"pools"}, "a pool"), "a list of pools"},
          "Pools whose parts it takes; without it: all.");
  f.field("at", s.ground, f.name_of({"grounds"}, "a ground"), "It takes parts that this ground holds.");
  f.section("region", "It takes parts whose centre of mass is in this box.", s.region,
            [&](ScenarioSinkRegion& region) {
              f.pose("center", region.X_WV, "Pose of the centre.");
              f.field("size_m", region.size_m, Vector3{positive("m")}, "Lengths along the axes of `center`.",
                      kRequired);
            });
  f.alternatives({"at", "region"}, 1, 2, "", "neither 'at' nor 'region'", "'at', 'region', or both");
  f.field(
      "held", s.held, Flag{},
      "It also takes parts that a gripper, or an attachment, holds; false: it waits until they are let go.");
}

void build(const ScenarioSink& s, DeviceBuilder& b) {
  PartFlow::Sink sink;
  for (const std::string& pool : s.pools) sink.pools.push_back(pool_of(b, pool));
  for (std::size_t pool = 0; s.pools.empty() && pool < b.cell.pools.size(); ++pool)
    sink.pools.push_back(pool);
  sink.ground = s.ground.empty() ? -1 : b.cell.description.find_component(s.ground);
  if (s.region) {
    sink.bounded = true;
    sink.X_WV = s.region->X_WV;
    sink.half_m = 0.5 * s.region->size_m;
  }
  sink.held = s.held;
  sink.device = b.add_signal_table(sink, described(kSinkSignals), {1.0, 0.0, -1.0});
  flow_of(b).sinks.push_back(sink);
}

DeviceType sink_type() {
  return device_type<ScenarioSink>(DeviceType::Owner::cell, "sinks", "Sinks of parts.",
                                   "A place where parts of pools leave the cell.", false, kSinkSignals);
}

void PartFlow::Flow::park(int part) {
  parked[(first + count) % parked.size()] = part;
  ++count;
}

int PartFlow::Flow::take() {
  const int part = parked[first];
  first = (first + 1) % parked.size();
  --count;
  return part;
}

PartFlow::PartFlow(const Model& model)
    : model_(model), flows_(model.pools.size()), orders_(model.sources.size()) {
  std::size_t parts = 0;
  for (std::size_t i = 0; i < flows_.size(); ++i) {
    flows_[i].parked.resize(model.pools[i].parts.size());
    flows_[i].present.reserve(model.pools[i].parts.size());
    parts += model.pools[i].parts.size();
  }
  notices_.reserve(2 * parts);
}

void PartFlow::start(ComponentInteraction&) {
  for (std::size_t i = 0; i < flows_.size(); ++i) {
    Flow& flow = flows_[i];
    flow.first = flow.count = 0;
    flow.present.clear();
    for (const int part : model_.pools[i].parts) flow.park(part);
  }
  orders_.assign(orders_.size(), {});
  notices_.clear();
}

void PartFlow::begin_step(StepControl& control) {
  notices_.clear();
  for (const Sink& sink : model_.sinks) take_out(sink, control);
  for (std::size_t i = 0; i < model_.sources.size(); ++i) bring_in(i, control);
  for (const Source& source : model_.sources)
    signal_table(control.plant(), source.device)
        .report(available, static_cast<double>(flows_[source.pool].count));
}

bool PartFlow::leaves(const Sink& sink, int part, StepControl& control) const {
  if (sink.bounded) {
    const Vec3 p_V = sink.X_WV.inverse() * control.motion().bodies[static_cast<std::size_t>(part)].p_WBcm;
    if (!(p_V.cwiseAbs().array() <= sink.half_m.array()).all()) return false;
  }
  const ComponentInteraction& interaction = control.interaction();
  const int holder = interaction.partner(part);
  if (sink.ground >= 0 && holder != sink.ground) return false;
  if (sink.held) return true;
  return interaction.attached_to(part) == -1 &&
         (holder < 0 || model_.is_gripper[static_cast<std::size_t>(holder)] == 0);
}

void PartFlow::take_out(const Sink& sink, StepControl& control) {
  SignalTable& signals = signal_table(control.plant(), sink.device);
  if (signals.value(enabled) == 0.0) return;
  for (const std::size_t pool : sink.pools) {
    Flow& flow = flows_[pool];
    for (std::size_t i = 0; i < flow.present.size();) {
      const int part = flow.present[i];
      if (!leaves(sink, part, control)) {
        ++i;
        continue;
      }
      const int holder = control.interaction().partner(part);
      const bool gripped = holder >= 0 && model_.is_gripper[static_cast<std::size_t>(holder)] != 0;
      const bool from = gripped || control.interaction().attached_to(part) != -1;
      DeviceNotice notice;
      notice.kind = from ? DeviceNotice::Kind::part_taken_off : DeviceNotice::Kind::part_removed;
      notice.device = sink.device;
      notice.part = part;
      notice.other = from ? holder : -1;
      notices_.push_back(notice);
      control.park(part);
      flow.present.erase(flow.present.begin() + static_cast<std::ptrdiff_t>(i));
      flow.park(part);
      signals.report(removed, signals.value(removed) + 1.0);
      signals.report(taken, part);
    }
  }
}

bool PartFlow::place_is_free(const Source& source, int part, StepControl& control) const {
  ComponentInteraction& interaction = control.interaction();
  CollisionWorld& world = interaction.collision_world();
  const auto meets = [&](int other) {
    return other != part && world.overlaps_at(part, source.X_WB, other, interaction.counts());
  };
  const std::span<const int> near = interaction.parts_near_sweep(part, source.X_WB, source.X_WB);
  return std::none_of(near.begin(), near.end(), meets) &&
         std::none_of(model_.jaws.begin(), model_.jaws.end(), meets);
}

void PartFlow::bring_in(std::size_t index, StepControl& control) {
  const Source& source = model_.sources[index];
  Order& order = orders_[index];
  SignalTable& signals = signal_table(control.plant(), source.device);
  const bool wanted = signals.value(release) != 0.0;
  const double t = control.time_s();
  if (source.period_s > 0.0) {
    if (wanted && !order.commanded) order.next_s = t;
    order.due = wanted && t >= order.next_s - kRounding_s;
  } else if (wanted && !order.commanded) {
    order.due = true;
  }
  order.commanded = wanted;
  Flow& flow = flows_[source.pool];
  const bool free = !order.due || (flow.count > 0 && place_is_free(source, flow.parked[flow.first], control));
  signals.report(blocked, free ? 0.0 : 1.0);
  if (!order.due || !free) return;
  order.due = false;
  // A period without delay is a multiple of the first instant; a delay moves all that follow.
  order.next_s = t > order.next_s + control.step_s() ? t + source.period_s : order.next_s + source.period_s;
  const int part = flow.take();
  flow.present.push_back(part);
  control.bring_in(part, source.X_WB, source.V_WB);
  DeviceNotice notice;
  notice.kind = DeviceNotice::Kind::part_entered;
  notice.device = source.device;
  notice.part = part;
  notices_.push_back(notice);
  signals.report(released, signals.value(released) + 1.0);
  signals.report(entered, part);
}

void PartFlow::save(StateWriter& out) const {
  for (const Flow& flow : flows_) {
    out.put_size(flow.count);
    for (std::size_t i = 0; i < flow.count; ++i) out.put(flow.parked[(flow.first + i) % flow.parked.size()]);
    for (const int part : flow.present) out.put(part);
  }
  for (const Order& order : orders_) out.put(order.commanded), out.put(order.due), out.put(order.next_s);
}

void PartFlow::load(StateReader& in) {
  notices_.clear();
  for (std::size_t i = 0; i < flows_.size(); ++i) {
    Flow& flow = flows_[i];
    const std::vector<int>& parts = model_.pools[i].parts;
    const std::size_t count = in.size(parts.size(), "parked Parts");
    flow.first = flow.count = 0;
    flow.present.clear();
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const int part = in.integer<int>(parts.front(), parts.back(), "a Part of a pool");
      const bool again =
          std::find(flow.present.begin(), flow.present.end(), part) != flow.present.end() ||
          std::find(flow.parked.begin(), flow.parked.begin() + static_cast<std::ptrdiff_t>(flow.count),
                    part) != flow.parked.begin() + static_cast<std::ptrdiff_t>(flow.count);
      if (again) in.fail("a Part of a pool is there twice");
      if (k < count)
        flow.park(part);
      else
        flow.present.push_back(part);
    }
  }
  for (Order& order : orders_) {
    order.commanded = in.flag("'a source is commanded'");
    order.due = in.flag("'a Part is due'");
    order.next_s = in.number("the time of a Part");
  }
}

}  // namespace takt
