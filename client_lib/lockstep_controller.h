#pragma once
// takt::LockstepController: commands robots, grippers and devices of a cell at pace lockstep. The simulation waits at
// each multiple of the period for the commands. So a test or a program gives the same bits on any machine, however long
// it computes:
//
//   takt::LockstepController controller(cell, {.targets = {"Robot1", "Gripper1"}});
//   while (controller.state().time < 2.0) {
//     controller.move("Robot1", set_point(controller.state()));  // to be there one period from now
//     controller.advance();                                      // sends, and returns at the next boundary
//   }
//
// Set-points that do not depend on the cell need no wait (lookahead): advance_ahead() in place of advance() goes on to the next
// boundary at once, and the cell follows as fast as it computes, with the same bits.
//
// A complete program is examples/scripted_publisher.cpp --lockstep.
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "client_lib/client.h"

namespace takt {

/// What a LockstepController commands, and how often.
struct LockstepOptions {
  std::vector<std::string>
      targets;                      ///< robots, grippers, devices that this controller commands; at least one
  double period_s = 0.008;          ///< of simulated time, at least one step
  std::string name = "controller";  ///< shown in events and in the status; unique in the cell
  /// Wall time. The server waits this long for the commands of one boundary, and advance() waits this long for the
  /// instant at one, also while the cell is paused.
  Seconds timeout{60.0};
  bool start = true;  ///< set the cell to lockstep and playing; false: another client does
};

/// Commands robots, grippers and devices at each boundary of simulated time; the cell waits for the commands.
class LockstepController {
 public:
  /// Registers, and returns at the first boundary from the present instant on. `cell` must outlive this.
  /// Throws ClientError, as every function below: not_found or refused for targets; timeout when the cell
  /// does not come to the boundary.
  LockstepController(Client& cell, LockstepOptions options);
  /// Unregisters. The cell stays at the present boundary when no other controller is registered.
  ~LockstepController();
  /// Unregisters at once. Afterwards only state() may be called.
  void close();
  LockstepController(const LockstepController&) = delete;
  LockstepController& operator=(const LockstepController&) = delete;

  /// The instant at the present boundary; after advance_ahead() an earlier one, the newest known.
  const State& state() const { return state_; }
  /// Simulated time of the present boundary, s.
  double time_s() const { return time_s_; }
  /// Simulated time between two boundaries, s.
  double period_s() const { return options_.period_s; }

  /// Set-point of the robot one period later: positions, velocities (empty: standstill) and efforts (as
  /// Client::send_joint_command). advance() sends it. Without a new set-point the robot stays there with the same
  /// efforts.
  void move(const std::string& robot, const std::vector<double>& positions,
            const std::vector<double>& velocities = {}, const std::vector<double>& efforts = {});
  /// Torques of the robot for the next period, and until another command for it (as Client::send_joint_torques).
  void apply_torques(const std::string& robot, const std::vector<double>& torques);
  /// As Client::set_gripper. The command stands until the next one. Before the first command a gripper keeps its
  /// width.
  void grip(const std::string& gripper, GripperAction action, double width_m = 0.0, double max_force_N = 0.0);
  /// As Client::set_signals. A signal keeps the value it was set to; the other signals are not commanded.
  void set_signals(const std::string& device, const std::map<std::string, double>& signals);
  /// Answers this boundary with one command for each target, and returns the instant at the next one. Throws
  /// ClientError: lost when the cell was reset or has another scenario (the program then needs a new
  /// controller); timeout when the instant does not come within the timeout. The text of the timeout names the
  /// reason from the status: paused, the controllers that have not answered, fault. After a timeout or an
  /// exception of ClientOptions::while_waiting the program may call advance() again. That call waits for the
  /// same instant and sends the commands given since.
  const State& advance();
  /// Answers this boundary as advance() does, and goes on to the next one without a wait for its instant: state() stays as
  /// it is. The commands leave some periods later, at the latest with advance() or send_ahead(). At most kMostLookahead - 1
  /// boundaries may lie between the cell and this controller; there it waits as advance() does, and throws as that does.
  void advance_ahead();
  /// Sends what advance_ahead() has kept back.
  void send_ahead();

 private:
  /// Without positions the efforts are torques.
  struct Joints {
    std::vector<double> positions, velocities, efforts{};
  };
  struct Grip {
    GripperAction action = GripperAction::width;
    double width_m = 0.0, max_force_N = 0.0;
  };
  using Signals = std::map<std::string, double>;  ///< of a device: the values set so far
  using Command = std::variant<Joints, Grip, Signals>;
  Command& standing(const std::string& target);
  /// The commands for a boundary.
  struct Answer {
    double time_s;
    std::map<std::string, Command> commands;
  };
  void answer();
  double time_of(std::uint64_t boundary) const;
  void wait_for_boundary();
  [[noreturn]] void give_up() const;

  Client& cell_;
  const LockstepOptions options_;
  std::map<std::string, Command> commands_;  ///< standing, for the next answer
  std::deque<Answer> answers_;               ///< to boundaries that the cell is not known to have crossed
  std::size_t unsent_ = 0;                   ///< of the last answers
  State state_;
  double time_s_ = 0.0;         ///< of the present boundary
  std::uint64_t boundary_ = 0;  ///< number of the present boundary; during a wait, of the next one
  bool registered_ = false;
  bool answered_ = false;  ///< the boundary ahead of the next one, which advance() waits for
};

}  // namespace takt
