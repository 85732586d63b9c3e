#include "server/simulation/step/signal_image.h"

#include <algorithm>
#include <cmath>

#include "server/simulation/model/signals.h"

namespace takt {

namespace {

constexpr double kJawStands_m_per_s = 1e-3;
constexpr double kInPosition_m = 1e-4;

/// The value that a wire gives to an input whose limits are these.
double wired_value(const SignalWire& wire, double source, const SignalDescription& input) {
  double value = wire.factor * source + wire.offset;
  if (wire.test == SignalWire::Test::above) value = source > wire.threshold ? 1.0 : 0.0;
  if (wire.test == SignalWire::Test::below) value = source < wire.threshold ? 1.0 : 0.0;
  if (wire.invert) value = value != 0.0 ? 0.0 : 1.0;
  return input.lower < input.upper ? std::clamp(value, input.lower, input.upper) : value;
}

}  // namespace

SignalImage::SignalImage(const CellModel& model, CellPlant& plant, Grasping& grasping)
    : model_(model), plant_(plant), grasping_(grasping) {
  plant_.set_machine_signals(this);
  for (const SignalWire& wire : model_.description.wires)
    inputs_.push_back(describe_signal(model_.description, wire.to));
}

void SignalImage::read_gripper(std::size_t gripper, double t, GripperSample& sample) const {
  sample.width_m = std::max(0.0, plant_.width(gripper, t));
  sample.moving = false;
  for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right})
    sample.moving = sample.moving || std::abs(plant_.jaw_speed(gripper, side, t)) > kJawStands_m_per_s;
  sample.in_position =
      !sample.moving && std::abs(sample.width_m - grasping_.commanded_width_m(gripper)) <= kInPosition_m;
  sample.part = grasping_.part_present(gripper);
  sample.force_N =
      sample.part >= 0 && !grasping_.by_contact(gripper) ? grasping_.grip_force_N(gripper, plant_) : 0.0;
  sample.closed = grasping_.closed(gripper);
  put_forced(gripper, sample);
}

void SignalImage::add_drive_force(std::size_t gripper, std::span<const double> effort,
                                  GripperSample& sample) const {
  const auto robot = static_cast<std::size_t>(model_.description.grippers[gripper].robot);
  if (plant_.dynamic(robot) == nullptr) return;
  if (grasping_.part_present(gripper) >= 0 && !grasping_.by_contact(gripper)) return;
  for (const ParallelGripper::Side side : {ParallelGripper::left, ParallelGripper::right})
    sample.force_N += 0.5 * std::abs(effort[plant_.jaw_joint(gripper, side)]);
  put_forced(gripper, sample);
}

void SignalImage::put_forced(std::size_t gripper, GripperSample& sample) const {
  sample.forced = 0;
  const int device = gripper_as_device(model_.description, gripper);
  for (const ForcedSignal& forced : plant_.forced_signals()) {
    if (forced.ref.device != device) continue;
    sample.forced |= 1U << static_cast<unsigned>(forced.ref.signal);
    switch (static_cast<GripperSignal>(forced.ref.signal)) {
      case GripperSignal::closed:
        sample.closed = forced.value != 0.0;
        break;
      case GripperSignal::width:
        sample.width_m = forced.value;
        break;
      case GripperSignal::force:
        sample.force_N = forced.value;
        break;
      case GripperSignal::moving:
        sample.moving = forced.value != 0.0;
        break;
      case GripperSignal::in_position:
        sample.in_position = forced.value != 0.0;
        break;
      case GripperSignal::part_present:
        if (forced.value == 0.0) sample.part = -1;
        break;
      case GripperSignal::part:
        sample.part = static_cast<int>(forced.value);
        break;
      case GripperSignal::close:
      case GripperSignal::set_width:
        break;
    }
  }
}

double SignalImage::gripper_value(std::size_t gripper, GripperSignal signal) const {
  if (signal == GripperSignal::close) return grasping_.commanded_close(gripper) ? 1.0 : 0.0;
  if (signal == GripperSignal::set_width) return grasping_.commanded_width_m(gripper);
  GripperSample sample;
  read_gripper(gripper, plant_.time(), sample);
  const auto robot = static_cast<std::size_t>(model_.description.grippers[gripper].robot);
  if (const DynamicRobot* dynamic = plant_.dynamic(robot);
      signal == GripperSignal::force && dynamic != nullptr) {
    const auto output = dynamic->output(plant_.time(), plant_.segment(robot).data(), plant_.system().motion(),
                                        plant_.system().update_wrenches());
    add_drive_force(gripper, output.torque, sample);
  }
  switch (signal) {
    case GripperSignal::closed:
      return sample.closed ? 1.0 : 0.0;
    case GripperSignal::width:
      return sample.width_m;
    case GripperSignal::force:
      return sample.force_N;
    case GripperSignal::moving:
      return sample.moving ? 1.0 : 0.0;
    case GripperSignal::in_position:
      return sample.in_position ? 1.0 : 0.0;
    case GripperSignal::part_present:
      return sample.part >= 0 ? 1.0 : 0.0;
    default:
      return sample.part;
  }
}

double SignalImage::value(SignalRef ref) const {
  const auto [kind, index] = signal_owner(model_.description, ref.device);
  if (kind == SignalOwnerKind::gripper) return gripper_value(index, static_cast<GripperSignal>(ref.signal));
  return plant_.system().motion().arms[index].q[static_cast<std::size_t>(ref.signal)];
}

bool SignalImage::set(SignalRef ref, double value, double t) {
  if (plant_.signal_value(ref) == value) return false;
  const auto [kind, index] = signal_owner(model_.description, ref.device);
  if (kind == SignalOwnerKind::device) {
    plant_.device(index).set_signal(t, ref.signal, value);
    return true;
  }
  GripperCommand command;
  command.gripper = static_cast<int>(index);
  const bool closes = static_cast<GripperSignal>(ref.signal) == GripperSignal::close;
  command.action = !closes ? GripperAction::width : value != 0.0 ? GripperAction::close : GripperAction::open;
  command.width_m = closes ? 0.0 : value;
  grasping_.apply(command, t, plant_);
  return false;
}

bool SignalImage::write(SignalRef ref, double value, double t) {
  ForcedSignal* forced = plant_.forced(ref);
  if (forced == nullptr && signal_owner(model_.description, ref.device).kind == SignalOwnerKind::gripper)
    forced = forced_gripper(signal_owner(model_.description, ref.device).index);
  if (forced == nullptr) return set(ref, value, t);
  forced->underneath = value;
  if (signal_owner(model_.description, ref.device).kind == SignalOwnerKind::gripper) {
    const bool closes = static_cast<GripperSignal>(ref.signal) == GripperSignal::close;
    if (closes) forced->underneath = 0.0;
    forced->action = !closes        ? GripperAction::width
                     : value != 0.0 ? GripperAction::close
                                    : GripperAction::open;
  }
  return false;
}

ForcedSignal* SignalImage::forced_gripper(std::size_t gripper) {
  const int device = gripper_as_device(model_.description, gripper);
  for (const GripperSignal input : {GripperSignal::close, GripperSignal::set_width})
    if (ForcedSignal* forced = plant_.forced({device, static_cast<int>(input)})) return forced;
  return nullptr;
}

void SignalImage::apply(const GripperCommand& command, double t) {
  ForcedSignal* forced =
      plant_.forced_signals().empty() ? nullptr : forced_gripper(static_cast<std::size_t>(command.gripper));
  if (forced == nullptr) return grasping_.apply(command, t, plant_);
  forced->action = command.action;
  forced->underneath = command.width_m;
  forced->max_force_N = command.max_force_N;
}

bool SignalImage::follow_wires(double t) {
  const std::vector<SignalWire>& wires = model_.description.wires;
  bool jumps = false;
  for (std::size_t i = 0; i < wires.size(); ++i)
    jumps |= write(wires[i].to, wired_value(wires[i], plant_.signal_value(wires[i].from), inputs_[i]), t);
  return jumps;
}

bool SignalImage::force(SignalRef ref, double value, double t) {
  const SignalDescription signal = describe_signal(model_.description, ref);
  ForcedSignal entry{ref, value};
  if (const ForcedSignal* before = plant_.forced(ref)) {
    entry = *before;
    entry.value = value;
  } else {
    entry.underneath = plant_.signal_value(ref);
    const auto [kind, index] = signal_owner(model_.description, ref.device);
    if (kind == SignalOwnerKind::gripper) {
      entry.action = grasping_.commanded_close(index) ? GripperAction::close : GripperAction::width;
      entry.underneath = grasping_.commanded_width_m(index);
      entry.max_force_N = plant_.grippers()[index].force_limit_N();
    }
  }
  plant_.release(ref);
  const bool jumps = signal.commanded && set(ref, value, t);
  plant_.force(entry);
  return jumps;
}

std::optional<SignalRef> SignalImage::other_forced_input(SignalRef ref) const {
  if (signal_owner(model_.description, ref.device).kind != SignalOwnerKind::gripper) return std::nullopt;
  const SignalRef close{ref.device, static_cast<int>(GripperSignal::close)};
  const SignalRef width{ref.device, static_cast<int>(GripperSignal::set_width)};
  if (ref != close && ref != width) return std::nullopt;
  const SignalRef other = ref == close ? width : close;
  return plant_.forced(other) != nullptr ? std::optional(other) : std::nullopt;
}

bool SignalImage::release(SignalRef ref, double t) {
  const ForcedSignal entry = *plant_.forced(ref);
  plant_.release(ref);
  if (!describe_signal(model_.description, ref).commanded) return false;
  const auto [kind, index] = signal_owner(model_.description, ref.device);
  if (kind == SignalOwnerKind::device) return set(ref, entry.underneath, t);
  GripperCommand command;
  command.gripper = static_cast<int>(index);
  command.action = entry.action;
  command.width_m = entry.underneath;
  command.max_force_N = entry.max_force_N;
  grasping_.apply(command, t, plant_);
  return false;
}

}  // namespace takt
