#include "client_lib/gateway/command_sender.h"

#include <chrono>

namespace takt::gateway {
namespace {

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

CommandSender::CommandSender(Client& client) : client_(client), thread_([this] { run(); }) {}

CommandSender::~CommandSender() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  given_.notify_one();
  thread_.join();
}

void CommandSender::move(const std::string& robot, std::vector<double> positions,
                         std::vector<double> velocities) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = filters_.find(robot); found != filters_.end()) {
      ++counters_.given;
      found->second.take(std::move(positions), std::move(velocities), now_s());
      return;
    }
  }
  give(robot, Joints{std::move(positions), std::move(velocities)});
}

void CommandSender::apply_torques(const std::string& robot, std::vector<double> torques) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = filters_.find(robot); found != filters_.end()) found->second.clear();
  }
  give(robot, Torques{std::move(torques)});
}

void CommandSender::stop(const std::string& robot) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = filters_.find(robot); found != filters_.end()) found->second.clear();
  }
  give(robot, Stop{});
}

void CommandSender::filter(const std::string& robot, const SetPointFilterOptions& options) {
  const std::lock_guard lock(mutex_);
  filters_.emplace(robot, SetPointFilter(options));
}

void CommandSender::instant(double cell_time_s) {
  bool any = false;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [robot, filter] : filters_) {
      auto next = filter.next(cell_time_s, now_s());
      if (!next) continue;
      keep(robot, Joints{std::move(next->positions), std::move(next->velocities)});
      any = true;
    }
  }
  if (any) given_.notify_one();
}

void CommandSender::grip(const std::string& gripper, GripperAction action, double width_m,
                         double max_force_N) {
  give(gripper, Grip{action, width_m, max_force_N});
}

void CommandSender::set_signals(const std::string& device, const std::map<std::string, double>& signals) {
  Signals all;
  {
    const std::lock_guard lock(mutex_);
    Signals& standing = standing_[device];
    for (const auto& [name, value] : signals) standing.insert_or_assign(name, value);
    all = standing;
  }
  give(device, std::move(all));
}

void CommandSender::give(const std::string& target, Command command) {
  {
    const std::lock_guard lock(mutex_);
    ++counters_.given;
    keep(target, std::move(command));
  }
  given_.notify_one();
}

void CommandSender::keep(const std::string& target, Command command) {
  const auto [place, fresh] = pending_.try_emplace(target);
  auto* waiting = std::get_if<Signals>(&place->second);
  auto* further = std::get_if<Signals>(&command);
  if (!fresh) ++counters_.replaced;
  if (!fresh && waiting != nullptr && further != nullptr) {
    for (const auto& [name, value] : *further) waiting->insert_or_assign(name, value);
  } else {
    place->second = std::move(command);
  }
}

CommandSender::Counters CommandSender::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

void CommandSender::run() {
  for (;;) {
    std::map<std::string, Command> commands;
    {
      std::unique_lock lock(mutex_);
      given_.wait(lock, [this] { return over_ || !pending_.empty(); });
      if (pending_.empty()) return;  // what was given before the end is sent
      commands.swap(pending_);
    }
    try {
      send(commands);
      const std::lock_guard lock(mutex_);
      counters_.sent += commands.size();
    } catch (const std::exception& error) {  // of the client, or of DDS
      const std::lock_guard lock(mutex_);
      counters_.failed += commands.size();
      counters_.failure = error.what();
    }
  }
}

void CommandSender::send(const std::map<std::string, Command>& commands) {
  // A trajectory has a topic of its own and cannot share the sample.
  for (const auto& [target, command] : commands)
    if (std::holds_alternative<Stop>(command)) client_.send_trajectory(target, {});
  client_.send_together([&] {
    for (const auto& [target, command] : commands) {
      if (const auto* joints = std::get_if<Joints>(&command)) {
        client_.send_joint_command(target, joints->positions, joints->velocities);
      } else if (const auto* torques = std::get_if<Torques>(&command)) {
        client_.send_joint_torques(target, torques->values);
      } else if (const auto* grip = std::get_if<Grip>(&command)) {
        client_.set_gripper(target, grip->action, grip->width_m, grip->max_force_N);
      } else if (const auto* signals = std::get_if<Signals>(&command)) {
        client_.set_signals(target, *signals);
      }
    }
  });
}

}  // namespace takt::gateway
