#pragma once
// Gantries that handle the Parts of a RandomCell: pick, carry, turn, hand over, put down, drop and throw.
#include "tests/support/random_assembly.h"

namespace takt::test {

class RandomHandling {
 public:
  /// Number of starts of each action.
  struct Counts {
    int picks = 0, tilts = 0, handovers = 0, on_tables = 0, on_parts = 0, drops = 0, throws = 0;
  };

  RandomHandling(const RandomCell& cell, unsigned seed)
      : cell_(cell), dice_(seed), arms_(cell.palms.size()), closed_(cell.palms.size(), false) {
    for (std::size_t i = 0; i < arms_.size(); ++i) {
      arms_[i].q = arms_[i].planned = cell.model()->robots[i].q_initial;
    }
  }

  /// Commands for the step that begins at `s`.
  std::vector<Command> commands(const Snapshot& s) {
    std::vector<Command> result;
    for (std::size_t i = 0; i < arms_.size(); ++i) {
      if (arms_[i].items.empty()) plan(i, s);
      run(i, s.step, result);
    }
    return result;
  }
  /// All arms stop at once, with or without a Part in hand.
  void abandon() {
    for (Arm& arm : arms_) arm.items.clear();
  }
  /// Opens every gripper at once.
  std::vector<Command> let_go() {
    std::vector<Command> result;
    for (std::size_t i = 0; i < arms_.size(); ++i) result.push_back(grip(i, GripperAction::open));
    return result;
  }
  bool closed(std::size_t gripper) const { return closed_[gripper]; }
  const Counts& counts() const { return counts_; }

 private:
  static constexpr std::uint64_t kPeriod = 8;  ///< steps between set-points
  struct Item {
    enum Kind { move, open, close } kind = move;
    std::uint64_t begin = 0, end = 0;
    JointArray to{};
  };
  struct Arm {
    std::deque<Item> items;
    JointArray q{};        ///< where the last finished move ended
    JointArray planned{};  ///< where the last planned move will end
    std::uint64_t until = 0;
  };

  static std::uint64_t whole_periods(double seconds) {
    return kPeriod * static_cast<std::uint64_t>(std::ceil(seconds * 1000.0 / static_cast<double>(kPeriod)));
  }
  void move(Arm& arm, const JointArray& to) {
    double distance = 0.0;
    for (std::size_t i = 0; i < 6; ++i) distance = std::max(distance, std::abs(to[i] - arm.planned[i]));
    const std::uint64_t end = arm.until + whole_periods(std::max(0.15, 0.6 * distance));
    arm.items.push_back({Item::move, arm.until, end, to});
    arm.planned = to;
    arm.until = end;
  }
  void wait(Arm& arm, double seconds) { arm.until += whole_periods(seconds); }
  void act(Arm& arm, Item::Kind kind) {
    arm.items.push_back({kind, arm.until, arm.until, {}});
    arm.until += kPeriod;
  }

  void plan(std::size_t index, const Snapshot& s) {
    Arm& arm = arms_[index];
    arm.until = std::max(arm.until, kPeriod * ((s.step + kPeriod - 1) / kPeriod));
    const int part = choose_part(s);
    if (part < 0) {
      arm.until += 10 * kPeriod;
      return;
    }
    ++counts_.picks;
    const OrientedBox box = cell_.box(s, part);
    // The tips just above the Part's bottom, so that Parts below it are not between the jaws.
    const double grip_z = (dice_.chance(80) ? box.lowest() + 0.065 : box.center.z() + 0.03);
    const double yaw = std::clamp(std::atan2(box.R(1, 0), box.R(0, 0)), -1.0, 1.0);
    JointArray q = flange(box.center, grip_z, yaw);
    move(arm, raised(q, 0.1));
    move(arm, q);
    act(arm, Item::close);
    wait(arm, dice_.between(0.05, 0.6));
    q = raised(q, dice_.between(0.1, 0.3));
    move(arm, q);
    finish(index, s, q, grip_z - box.lowest());
  }

  /// Chooses the end of a handling. `hang` is the extent of the held Part below the flange.
  void finish(std::size_t index, const Snapshot& s, JointArray q, double hang) {
    Arm& arm = arms_[index];
    if (dice_.chance(40)) {
      ++counts_.tilts;
      JointArray turned = q;
      for (std::size_t i = 3; i < 6; ++i) turned[i] += dice_.between(-1.2, 1.2);
      move(arm, turned);
      if (dice_.chance(50)) move(arm, q);
    }
    const int what = dice_.below(10);
    for (std::size_t other = 0; what < 5 && other < arms_.size(); ++other) {
      Arm& taker = arms_[other];
      if (other == index || !taker.items.empty()) continue;
      ++counts_.handovers;
      q = flange({dice_.between(0.2, 0.8), dice_.between(-0.3, 0.3), 0.0}, 0.6, dice_.between(-1.0, 1.0));
      move(arm, q);
      JointArray take = q;
      take[5] += dice_.between(-0.3, 0.3);
      take[2] += dice_.between(-0.005, 0.005);
      taker.until = arm.until + kPeriod;
      move(taker, take);
      act(taker, Item::close);
      wait(taker, 0.1);
      arm.until = taker.until;  // the second closes ahead of the first one's opening
      act(arm, Item::open);
      wait(arm, 0.1);
      move(arm, raised(q, 0.3));
      wait(taker, 0.2);
      finish_alone(other, s, take, hang);
      return;
    }
    finish_alone(index, s, q, hang);
  }

  void finish_alone(std::size_t index, const Snapshot& s, JointArray q, double hang) {
    Arm& arm = arms_[index];
    const int what = dice_.below(10);
    const double yaw = dice_.between(-0.5, 0.5);
    if (what < 3) {  // on a table
      ++counts_.on_tables;
      const Vec3 spot = cell_.spot(dice_.below(cell_.spot_count())) + Vec3(0.15, 0.15, 0.0) * dice_.below(2);
      q = flange(spot, hang + dice_.between(0.0, 1e-4), yaw);
      move(arm, raised(q, 0.15));
      move(arm, q);
    } else if (what < 6) {  // on another Part
      ++counts_.on_parts;
      const OrientedBox under = cell_.box(
          s, cell_.parts[static_cast<std::size_t>(dice_.below(static_cast<int>(cell_.parts.size())))]);
      q = flange(under.center, under.highest() + hang + dice_.between(0.0, 1e-4), yaw);
      move(arm, raised(q, 0.15));
      move(arm, q);
    } else if (what < 8) {  // dropped from rest
      ++counts_.drops;
      q = flange(cell_.spot(dice_.below(cell_.spot_count())), hang + dice_.between(0.05, 0.5), yaw);
      move(arm, q);
      wait(arm, 0.1);
    } else {  // thrown: opened in the middle of a move
      ++counts_.throws;
      for (std::size_t i = 3; i < 6; ++i) q[i] = dice_.between(-0.8, 0.8);
      q[0] += dice_.between(-0.5, 0.5), q[1] += dice_.between(-0.3, 0.3), q[2] = dice_.between(-0.8, -0.2);
      move(arm, q);
      const Item flight = arm.items.back();
      const std::uint64_t middle = (flight.begin + flight.end) / 2;
      arm.items.push_back({Item::open, middle, middle, {}});
      wait(arm, 0.1);
      return;
    }
    act(arm, Item::open);
    wait(arm, 0.1);
    move(arm, raised(q, 0.15));
  }

  int choose_part(const Snapshot& s) {
    for (int attempt = 0; attempt < 20; ++attempt) {
      const int part =
          cell_.parts[static_cast<std::size_t>(dice_.below(static_cast<int>(cell_.parts.size())))];
      const ComponentSample& c = s.components[static_cast<std::size_t>(part)];
      const bool in_hand = std::find(cell_.palms.begin(), cell_.palms.end(), c.partner) != cell_.palms.end();
      const bool in_reach = c.p_WB.cwiseAbs().maxCoeff() < 2.5;
      if (!in_hand && in_reach && c.V_WB.v.norm() < 0.01) return part;
    }
    return -1;
  }
  JointArray flange(const Vec3& over, double z, double yaw) const {
    JointArray q{};
    q[0] = over.x(), q[1] = over.y(), q[2] = z - RandomCell::kBase_m, q[5] = yaw;
    return q;
  }
  JointArray raised(JointArray q, double by) const {
    q[2] += by;
    return q;
  }

  GripperCommand grip(std::size_t index, GripperAction action) {
    closed_[index] = action == GripperAction::close;
    GripperCommand command;
    command.gripper = static_cast<int>(index);
    command.action = action;
    return command;
  }

  void run(std::size_t index, std::uint64_t step, std::vector<Command>& result) {
    Arm& arm = arms_[index];
    // A throw opens during its motion: tests all items that are due.
    for (std::size_t i = 0; i < arm.items.size();) {
      const Item item = arm.items[i];
      if (item.begin > step) break;
      if (item.kind != Item::move) {
        result.push_back(grip(index, item.kind == Item::open ? GripperAction::open : GripperAction::close));
        arm.items.erase(arm.items.begin() + static_cast<std::ptrdiff_t>(i));
        continue;
      }
      if (step >= item.end) {
        arm.q = item.to;
        arm.items.erase(arm.items.begin() + static_cast<std::ptrdiff_t>(i));
        continue;
      }
      if (step % kPeriod == 0) result.push_back(set_point(index, item, step + kPeriod));
      ++i;
    }
  }

  /// Quintic from rest to rest, one period ahead.
  JointCommand set_point(std::size_t index, const Item& item, std::uint64_t step) const {
    const double duration = 0.001 * static_cast<double>(item.end - item.begin);
    const double u = std::min(1.0, 0.001 * static_cast<double>(step - item.begin) / duration);
    JointCommand command;
    command.robot = static_cast<int>(index);
    command.has_velocity = true;
    for (std::size_t i = 0; i < 6; ++i) {
      const double d = item.to[i] - arms_[index].q[i];
      command.position[i] = arms_[index].q[i] + d * u * u * u * (10.0 + u * (-15.0 + 6.0 * u));
      command.velocity[i] = d / duration * 30.0 * u * u * (1.0 - u) * (1.0 - u);
    }
    return command;
  }

  const RandomCell& cell_;
  Dice dice_;
  std::vector<Arm> arms_;
  std::vector<bool> closed_;
  Counts counts_;
};

}  // namespace takt::test
