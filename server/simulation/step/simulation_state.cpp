// The state as bytes, and changes of the state by the user.
#include <cmath>
#include <string_view>

#include "plant_models/state_bytes.h"
#include "server/simulation/model/model_hash.h"
#include "server/simulation/step/simulation_impl.h"

namespace takt {

namespace {
constexpr std::string_view kMagic = "taktstat";
constexpr std::uint32_t kVersion = 13;
constexpr double kLongest_s = 1e9;
constexpr std::size_t kLongestText = 1U << 20U;
constexpr double kFurthest = 1e9;  // m, m/s, rad/s: largest value that set_component_state() accepts
constexpr double kQuaternionInDoubt = 2e-3;  // of its squared length

void save(const Simulation::Impl::CommandCounter& counter, StateWriter& out) {
  out.put(counter.count), out.put(counter.newest_stamp.ns);
}
void load(StateReader& in, Simulation::Impl::CommandCounter& counter) {
  counter.count = in.get<std::uint64_t>();
  counter.newest_stamp.ns = in.get<std::int64_t>();
}

void save(const CollisionEvent& event, StateWriter& out) {
  out.put(event.kind), out.put(event.time_s), out.put(event.step), out.put(event.a), out.put(event.b);
  out.put(event.limit_m), out.put(event.distance_m), out.put(event.duration_s), out.put(event.p_W);
}
CollisionEvent load_event(StateReader& in, std::size_t bodies) {
  CollisionEvent event;
  event.kind = static_cast<CollisionEvent::Kind>(
      in.integer(0, static_cast<int>(CollisionEvent::Kind::clearance_restored), "a collision event"));
  event.time_s = in.number("a time");
  event.step = in.get<std::uint64_t>();
  event.a = in.integer<int>(0, static_cast<int>(bodies) - 1, "a checked body");
  event.b = in.integer<int>(0, static_cast<int>(bodies) - 1, "a checked body");
  event.limit_m = in.number("a limit");
  event.distance_m = in.number("a distance");
  event.duration_s = in.number("a duration");
  event.p_W = in.vector("a place");
  return event;
}
}  // namespace

void Simulation::Impl::save(std::vector<std::byte>& bytes) {
  if (identity == 0) identity = model_hash(*model);
  bytes.clear();
  StateWriter out(bytes);
  for (const char letter : kMagic) out.put(letter);
  out.put(kVersion), out.put(identity);
  out.section("CELL", [&] {
    out.put(step_index), out.put(epoch), out.put(hash.value()), out.put(parts_hash);
    for (const std::uint64_t part : part_hashes) out.put(part);
    for (const CommandCounter& counter : robot_commands) takt::save(counter, out);
    for (const CommandCounter& counter : gripper_commands) takt::save(counter, out);
    for (const CommandCounter& counter : device_commands) takt::save(counter, out);
    for (const int level : process_levels) out.put(static_cast<std::uint8_t>(level));
    out.put_size(changes.size());
    for (const ConnectionChange& change : changes)
      out.put(change.time_s), out.put(change.step), out.put(change.part), out.put(change.from),
          out.put(change.to);
    out.put_size(collisions.size());
    for (const CollisionEvent& event : collisions) takt::save(event, out);
    out.put(std::string_view(fault));
    watch.save(out);
  });
  out.section("SETP", [&] {
    for (const ReferenceMotion& motion : reference_motions) motion.save(out);
  });
  out.section("HOLD", [&] { interaction.save_attached(out); });
  out.section("PLNT", [&] { plant.save(out); });
  out.section("INTR", [&] { interaction.save(out); });
  out.section("CONT", [&] { contacts.save(out); });
  out.section("GRIP", [&] {
    grasping.save(out);
    grip_loads.save(out);
    alternation.save(out);
  });
  if (!model->pools.empty()) {
    out.section("PARK", [&] {
      for (std::size_t i = 0; i < model->parts.size(); ++i) out.put(exact_sleeping.is_parked(i));
    });
  }
  out.section("SLPE", [&] { exact_sleeping.save(out); });
  out.section("SLPT", [&] { threshold_sleeping.save(out); });
  out.section("HIST", [&] { history.save(out); });
  out.section("CLRN", [&] {
    if (monitor) monitor->save(out);
  });
  if (!mechanisms.empty()) {
    out.section("MECH", [&] {
      out.put(mechanism_let_go);
      for (const auto& mechanism : mechanisms) mechanism->save(out);
    });
  }
}

void Simulation::Impl::load(std::span<const std::byte> bytes) {
  StateReader all(bytes);
  for (const char letter : kMagic)
    if (all.get<char>() != letter) all.fail("these bytes are no saved state of a simulation");
  if (const auto version = all.get<std::uint32_t>(); version != kVersion)
    all.fail("it has format " + std::to_string(version) + ", this program reads format " +
             std::to_string(kVersion));
  identity = model_hash(*model);
  if (all.get<std::uint64_t>() != identity)
    all.fail("it is of another model than that of the scenario '" + model->description.scenario +
             "' as it is loaded: shapes, masses, constants and solver must be the same");
  all.section("CELL", [&](StateReader& in) {
    step_index = in.get<std::uint64_t>();
    if (!(time() <= kLongest_s)) in.fail("its time is beyond " + std::to_string(kLongest_s) + " s");
    epoch = in.get<std::uint32_t>();
    hash.resume(in.get<std::uint64_t>());
    parts_hash = in.get<std::uint64_t>();
    for (std::uint64_t& part : part_hashes) part = in.get<std::uint64_t>();
    for (CommandCounter& counter : robot_commands) takt::load(in, counter);
    for (CommandCounter& counter : gripper_commands) takt::load(in, counter);
    for (CommandCounter& counter : device_commands) takt::load(in, counter);
    for (int& level : process_levels) {
      level = in.integer(1, 3, "a process' level of detail");
      if (level == 3 && !model->contact.enabled) in.fail("a process is at level 3, which was not prepared");
    }
    const std::size_t n = model->components.size();
    changes.clear();
    for (std::size_t i = in.size(n * n, "changes of partners"); i > 0; --i) {
      ConnectionChange change;
      change.time_s = in.number("a time");
      change.step = in.get<std::uint64_t>();
      change.part = in.integer<int>(0, static_cast<int>(n) - 1, "a Part");
      change.from = in.index(n, "a partner");
      change.to = in.index(n, "a partner");
      changes.push_back(change);
    }
    const std::size_t bodies = model->clearance.bodies.size();
    collisions.clear();
    for (std::size_t i = in.size(4 * model->clearance.pairs.size(), "collision events"); i > 0; --i)
      collisions.push_back(load_event(in, bodies));
    fault = in.text(kLongestText, "letters of the fault");
    watch.load(in);
  });
  all.section("SETP", [&](StateReader& in) {
    for (ReferenceMotion& motion : reference_motions) motion.load(in);
    motion_notices.clear(), device_notices.clear(), device_messages.clear();
  });
  all.section("HOLD", [&](StateReader& in) { interaction.load_attached(in); });
  choose_forces();
  all.section("PLNT", [&](StateReader& in) { plant.load(in); });
  note_yielding();
  all.section("INTR", [&](StateReader& in) { interaction.load(in); });
  all.section("CONT", [&](StateReader& in) { contacts.load(in); });
  all.section("GRIP", [&](StateReader& in) {
    grasping.load(in);
    grip_loads.load(in);
    alternation.load(in);
  });
  if (!model->pools.empty()) {
    all.section("PARK", [&](StateReader& in) {
      for (std::size_t i = 0; i < model->parts.size(); ++i) exact_sleeping.set_parked(i, in.flag("'parked'"));
    });
  }
  all.section("SLPE", [&](StateReader& in) { exact_sleeping.load(in, interaction); });
  all.section("SLPT", [&](StateReader& in) { threshold_sleeping.load(in); });
  all.section("HIST", [&](StateReader& in) { history.load(in); });
  all.section("CLRN", [&](StateReader& in) {
    if (monitor) monitor->load(in);
  });
  if (!mechanisms.empty()) {
    all.section("MECH", [&](StateReader& in) {
      mechanism_let_go = in.flag("'a mechanism let go'");
      for (const auto& mechanism : mechanisms) mechanism->load(in), mechanism->loaded(plant);
    });
  }
  all.expect_end();
  statistics = {};
  plant.set_time(time());
  motion_is_current = false;
  refresh_motion();  // of all models, including those that will sleep
  if (exact_sleeping.awake().size() < model->parts.size()) system().set_awake(exact_sleeping.awake());
}

std::unique_ptr<Simulation::Impl> Simulation::Impl::loaded(const std::shared_ptr<const CellModel>& model,
                                                           std::span<const std::byte> bytes) {
  auto fresh = std::make_unique<Impl>(model);
  fresh->load(bytes);
  // Models that cannot be evaluated in this state throw here.
  fresh->system().update_wrenches();
  return fresh;
}

bool Simulation::Impl::in_doubt() const {
  for (const double x : plant.state())
    if (!(std::abs(x) <= kFurthest)) return true;
  for (std::size_t part = 0; part < model->parts.size(); ++part) {
    double length = 0.0;
    for (std::size_t i = 3; i < 7; ++i) {
      const double q = plant.state()[plant.part_begin(part) + i];
      length += q * q;
    }
    if (!(std::abs(length - 1.0) <= kQuaternionInDoubt)) return true;
  }
  return false;
}

std::string Simulation::save_state(std::vector<std::byte>& out) {
  std::string refusal;
  try {
    impl_->save(out);
    if (impl_->in_doubt()) static_cast<void>(Impl::loaded(impl_->model, out));
  } catch (const std::exception& error) {
    refusal = error.what();
    out.clear();
  }
  return refusal;
}

std::string Simulation::restore_state(std::span<const std::byte> bytes) {
  std::unique_ptr<Impl> fresh;
  try {
    fresh = Impl::loaded(impl_->model, bytes);
  } catch (const std::exception& error) {
    return error.what();
  }
  fresh->epoch = std::max(fresh->epoch, impl_->epoch) + 1;
  fresh->watch_deadlines = impl_->watch_deadlines;
  std::swap(impl_, fresh);
  set_stage_clock(fresh->clock);
  set_executor(fresh->executor, fresh->least_calls);
  return {};
}

std::string Simulation::Impl::not_a_part(int component, const char* wanted) const {
  const auto n = static_cast<int>(model->components.size());
  if (component < 0 || component >= n)
    return "there is no component " + std::to_string(component) + "; the cell has 0 to " +
           std::to_string(n - 1);
  const Component& c = model->components[static_cast<std::size_t>(component)];
  if (c.type == ComponentType::part && is_parked(component))
    return c.name +
           " is parked, outside of the cell, until a source brings it in; only a Part in the cell can be " +
           wanted;
  if (c.type == ComponentType::part) return {};
  return c.name + " is a component of type " + std::string(to_string(c.type)) + "; only a Part can be " +
         wanted;
}

namespace {
std::string failed(const std::string& fault) {
  return "the simulation has failed and must be reset first: " + fault;
}
}  // namespace

std::string Simulation::attach(int part, int component) {
  Impl& s = *impl_;
  if (!s.fault.empty()) return failed(s.fault);
  if (std::string why = s.not_a_part(part, "attached"); !why.empty()) return why;
  const auto n = static_cast<int>(s.model->components.size());
  if (component < 0 || component >= n)
    return "there is no component " + std::to_string(component) + " to attach to; the cell has 0 to " +
           std::to_string(n - 1);
  const Component& to = s.model->components[static_cast<std::size_t>(component)];
  if (s.is_parked(component)) return to.name + " is parked, outside of the cell, until a source brings it in";
  if (to.role == GripperRole::left_jaw || to.role == GripperRole::right_jaw)
    return to.name + " is a jaw; a Part is attached to the Gripper, which is component " +
           std::to_string(s.model->grippers[static_cast<std::size_t>(to.gripper)].parameters.palm);
  if (std::string why = s.interaction.attach(part, component); !why.empty()) return why;
  return s.changed_holds();
}

std::string Simulation::detach(int part) {
  Impl& s = *impl_;
  if (!s.fault.empty()) return failed(s.fault);
  if (std::string why = s.not_a_part(part, "detached"); !why.empty()) return why;
  if (s.interaction.attached_to(part) == -1)
    return s.model->components[static_cast<std::size_t>(part)].name +
           " is not attached to anything; what holds it by the rules ends by the rules";
  s.interaction.detach(part);
  return s.changed_holds();
}

std::string Simulation::force_signal(SignalRef ref, double value) {
  Impl& s = *impl_;
  if (!s.fault.empty()) return failed(s.fault);
  if (const auto other = s.signals.other_forced_input(ref))
    return signal_name(s.model->description, *other) + " is forced; release it first: both move the jaws";
  s.plant.set_time(s.time());
  s.guard([&] {
    s.refresh_motion();
    if (s.signals.force(ref, value, s.time())) s.input_changed();
  });
  return s.fault;
}

std::string Simulation::release_signal(SignalRef ref) {
  Impl& s = *impl_;
  if (!s.fault.empty()) return failed(s.fault);
  if (s.plant.forced(ref) == nullptr) return signal_name(s.model->description, ref) + " is not forced";
  s.plant.set_time(s.time());
  s.guard([&] {
    s.refresh_motion();
    if (s.signals.release(ref, s.time())) s.input_changed();
  });
  return s.fault;
}

std::string Simulation::set_inputs(std::span<const InputValue> values) {
  Impl& s = *impl_;
  if (!s.fault.empty()) return failed(s.fault);
  const CellDescription& cell = s.model->description;
  for (const InputValue& one : values)
    if (!s.plant.motion_allowed() && signal_owner(cell, one.ref.device).kind == SignalOwnerKind::gripper)
      return "a safety device stops the cell, and " + std::string(signal_owner_name(cell, one.ref.device)) +
             " stays as it is";
  s.plant.set_time(s.time());
  s.guard([&] {
    s.refresh_motion();
    bool jumps = false;
    for (const InputValue& one : values) jumps |= s.signals.write(one.ref, one.value, s.time());
    if (jumps) s.input_changed();
  });
  return s.fault;
}

std::span<const ForcedSignal> Simulation::forced_signals() const {
  return impl_->plant.forced_signals();
}

double Simulation::signal(SignalRef ref) const {
  double value = 0.0;
  impl_->guard([&] {
    impl_->plant.set_time(impl_->time());
    impl_->refresh_motion();
    value = impl_->plant.signal_value(ref);
  });
  return value;
}

std::string Simulation::Impl::changed_holds() {
  guard([this] {
    if (std::find(process_levels.begin(), process_levels.end(), 3) == process_levels.end()) {
      wake_all();
      return;
    }
    std::vector<int> levels;
    for (std::size_t r = 0; r < model->robots.size(); ++r) levels.push_back(plant.level(r));
    regroup(levels);
  });
  motion_is_current = false;
  return fault;
}

std::string Simulation::set_component_state(int component, const Pose& X_WB, const Twist& V_WB) {
  Impl& s = *impl_;
  if (!s.fault.empty()) return failed(s.fault);
  if (std::string why = s.not_a_part(component, "put elsewhere"); !why.empty()) return why;
  const std::string& name = s.model->components[static_cast<std::size_t>(component)].name;
  const auto within = [](const Vec3& v) { return v.allFinite() && v.cwiseAbs().maxCoeff() <= kFurthest; };
  if (!within(X_WB.p) || !within(V_WB.v) || !within(V_WB.w))
    return "position, velocity and angular velocity of " + name +
           " must be finite numbers, not larger than 1e9 in m, m/s and rad/s";
  if (!X_WB.R.allFinite() ||
      !((X_WB.R.transpose() * X_WB.R - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
        X_WB.R.determinant() > 0.0))
    return "the orientation of " + name + " is no rotation (a quaternion must have length 1)";
  const auto is_it = [component](const RigidBodyParameters& part) { return part.body == component; };
  const auto part = static_cast<std::size_t>(
      std::find_if(s.model->parts.begin(), s.model->parts.end(), is_it) - s.model->parts.begin());
  const Vec3 p_WBcm = X_WB * s.model->parts[part].p_BBcm;
  if (const std::string where = s.watch.outside(p_WBcm); !where.empty()) return name + " would be " + where;
  s.guard([&] { s.moved(part, X_WB, V_WB); });
  return s.fault;
}

}  // namespace takt
