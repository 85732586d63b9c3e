#pragma once
// The Rosenbrock W-method ROS34PW2 (rosenbrock_tableau.h) with error control, on the linear system at
// velocity level (velocity_system.h). For contact: large steps in smooth motion, small ones through an
// impact, no iteration, and an order that holds although the Jacobian is incomplete. It contains the tangent of
// friction, which error control makes safe.
//
// A step has one Jacobian, four evaluations, four solutions; after a rejection only the matrix is factorised
// again. Steps end with the communication step, at corners of f that models announce, and at changes of
// modes, which cost some more attempts. The size of the next step is carried over from one communication step
// to the next.
//
// CalmSteps::two_stages: where the error of ROS2 (rosenbrock_step.h) is a small share of the tolerance, that
// method takes whole communication steps: two evaluations, two solutions, and one matrix for up to kKeptSteps
// of them, as long as the same models are awake. Matrix and memory of earlier trials are discarded at
// discontinuities and whenever the state is saved. Where a kept matrix fails, one of the step itself is tried; after
// two failures in a row four stages serve for kBusySteps communication steps.
//
// Where a communication step is not calm, its islands (islands.h) are integrated one after another, each with steps of its
// own, so that an impact shortens only the steps of what it can reach; islands whose part of the trial by two
// stages was calm keep that. In an island of four models and more a trial whose errors are too large for few of them is
// accepted of the others, which then follow the cubic through it while those few repeat it in steps of their own
// (Savcenco, Hundsdorfer, Verwer, A multirate time stepping strategy for stiff ordinary differential equations, BIT 47,
// 2007). A step without islands has the steps of the worst model. The size of the next step is
// kept by model: that of an island is the least of its models. Each count of the statistics is that of the island that
// has most, so that it compares with that of a cell that is one island.
//
// The cost of a communication step is bounded: below the smallest step a step is accepted with any error
// (SolverStatistics::forced_steps), with the secant of friction, which never drives. Only derivatives that are not
// finite are a failure.
#include <vector>

#include "server/simulation/solver/integrator.h"
#include "server/simulation/solver/islands.h"
#include "server/simulation/solver/rosenbrock_step.h"

namespace takt {

class RosenbrockIntegrator final : public Integrator {
 public:
  static constexpr double kSmallestStep_s = 1e-6;

  enum class CalmSteps : std::uint8_t { four_stages, two_stages };

  RosenbrockIntegrator(const SolverParameters& parameters, const OdeSystem& system,
                       CalmSteps calm_steps = CalmSteps::four_stages);
  void restart() override;
  void reset() override;
  void forget() override { kept_steps_ = busy_steps_ = fresh_steps_ = 0, remembers_ = false; }
  void save(StateWriter& out) const override;
  void load(StateReader& in) override;
  bool fixed_step() const override { return false; }
  bool one_step() const override { return true; }

 protected:
  bool take_step(OdeSystem& system, double t, double h, std::span<double> x) override;

 private:
  using Outcome = RosenbrockStep::Outcome;
  void next_size(double h, bool cut_short);
  void note_step(double h);
  void switch_modes(OdeSystem& system, double t, std::span<double> x);
  /// Share of the trial step at which the first initial mode ends; above 1: all modes last.
  double mode_ends_at(OdeSystem& system, double t_end);
  /// Tries the whole communication step by two stages, unless it is expected to fail: calm_. Otherwise the trial is
  /// begun for four stages of h, if it was tried: `begun`. False: failure_.
  bool try_whole(OdeSystem& system, double t, double whole_s, double h, bool& begun,
                 std::span<const double> x);
  /// An accepted trial of up to h by four stages.
  bool find_step(OdeSystem& system, double t, double& h, bool begun, bool& mode_ends,
                 std::span<const double> x);
  bool force_step(OdeSystem& system, double t, double h, Outcome outcome, std::span<const double> x);
  /// Steps by four stages, of models without modes and corners.
  bool take_pieces(OdeSystem& system, double t, double end, std::span<double> x);
  /// The communication step by the islands that were found. `tried`: the trial by two stages is of this step.
  bool take_islands(OdeSystem& system, double t, double h, bool tried, std::span<double> x);
  /// The attended segments of an island, each with its pace in next_paces_. A trial is accepted of those whose errors permit;
  /// the others, if they are few, repeat it in smaller steps while the accepted ones follow their courses.
  bool take_apart(OdeSystem& system, double t, double end, std::span<double> x);
  /// An accepted trial of up to `h`, perhaps but for the segments refined_.
  bool find_apart(OdeSystem& system, double t, double& h, std::span<const double> x);
  bool find_refined(OdeSystem& system, double h, std::span<const double> x);
  void keep_course(const OdeSystem& system, double t, double h, std::span<double> x);
  double common_step();
  bool take_island(OdeSystem& system, double t, double h, std::size_t island, std::span<double> x);
  void read_paces(const OdeSystem& system, std::span<const std::size_t> segments);
  bool find_calm(OdeSystem& system, double t, double h, bool follows, std::span<const double> x);
  /// The derivatives at (t, x), and a new matrix unless it is kept.
  bool begin(OdeSystem& system, double t, double h, bool keeps_matrix, std::span<const double> x);
  /// As in the last trial by two stages.
  bool same_models(const OdeSystem& system, double h) const;
  /// Trial of the whole communication step by two stages. False: the motion is not calm.
  bool step_calmly(OdeSystem& system, double t, double h, bool kept, std::span<const double> x);

  /// Of a segment, from one step to the next.
  struct Pace {
    double step = 0.0;        ///< proposal for the next step; 0: undefined
    double last_error = 1.0;  ///< of the last accepted step
  };

  RosenbrockStep trial_;
  Islands islands_;
  CalmSteps calm_steps_;
  std::vector<double> indicators_, new_indicators_;
  std::vector<Pace> paces_, next_paces_;  ///< by segment; at the end of a step by islands
  std::vector<char> calm_segments_;       ///< in the last trial by two stages
  OdeSystem::Courses courses_;
  std::vector<std::size_t> refined_;  ///< segments of which the last trial is not accepted
  std::vector<double> ranked_;
  std::vector<double> start_;             ///< state at the beginning of a step by islands
  double step_ = 0.0, last_error_ = 1.0;  ///< of the models that are integrated at present
  bool rejected_ = false;                 ///< the present step was tried with a larger size
  bool restarted_ = true;
  bool calm_ = false;       ///< the present step was taken by two stages
  bool remembers_ = false;  ///< the last trial by two stages was one communication step earlier
  int busy_steps_ = 0;      ///< communication steps until two stages are tried again
  int fresh_steps_ = 0;     ///< communication steps until a matrix is kept again
  int kept_steps_ = 0;      ///< that the matrix of two stages may still serve
  double kept_h_ = 0.0;     ///< of the last trial by two stages
  std::vector<std::size_t> kept_segments_;  ///< awake segments at that time
  double after_, before_;                   ///< f has corners there; it is evaluated between
};

}  // namespace takt
