#pragma once
// The control program of ur_rtde, as a client of it sees the controller: the number of a command in an RTDE input register,
// its values in those that follow; results, and how far the program is, in output registers. Functions of URScript run as
// in a program; servoj, speedj, speedl, servoc and jogging go on until they are stopped.
#include <deque>

#include "client_lib/tools/takt_ur/script_run.h"

namespace takt::ur {

class RegisterProgram final : public RunningProgram {
 public:
  RegisterProgram(UrController& controller, const urscript::Program& program);
  bool advance() override;

 private:
  enum class Control : std::uint8_t { none, servo, servo_line, speed, jog };
  struct Approach {  ///< moves until a contact is detected, then back to where it began
    Vector6 speed{}, direction{};
    double acceleration = 0.0;
  };

  double real(int number) const;
  int whole(int number) const;
  Vector6 six(int first) const;
  Pose pose(int first) const;  ///< in the robot's base
  void answer(int first, const Vector6& values);
  void answer(int number);
  /// A function with constant arguments, as the next thing to do.
  void call(const char* function, std::vector<urscript::Value> arguments,
            std::map<std::string, urscript::Value> named = {});
  void begin_move(const char* function, std::vector<urscript::Value> arguments, int options,
                  double blend_m = 0.0);
  void begin(urscript::Code code, bool async);
  void begin_control(Control control);
  void stop(const char* function, double deceleration);
  void execute(int command);
  void force_mode();
  void forward_kinematics(const Vector6& q, const Pose& X_FT);
  void inverse_kinematics(const Vector6& near);
  void advance_control();
  void follow_line();
  void advance_approach();
  /// Cycles for which a force of at least the contact's size has acted against the direction; 0: no contact.
  int contact_cycles(const Vector6& direction);
  Vector6 position_before(int cycles) const;
  void signal_async_end();

  UrController& controller_;
  const urscript::RegisterControl registers_;
  bool executing_ = false;
  std::unique_ptr<ScriptRun> run_, async_run_;
  Control control_ = Control::none;
  Vector6 target_{};
  double lookahead_s_ = 0.1, acceleration_ = 0.0, speed_ = 0.0;
  std::vector<double> force_command_;
  std::optional<Approach> approach_;
  std::deque<Vector6> history_;
  int contact_cycles_ = 0, async_end_ = -2;
  std::uint64_t watchdog_cycles_ = 0;
};

}  // namespace takt::ur
