#include "server/simulation/solver/rosenbrock_integrator.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "plant_models/state_bytes.h"

namespace takt {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr double kFirstStep_s = 1e-4;
// PI control of the step's size (Gustafsson 1991) for an error estimate of order h^3.
constexpr double kSafety = 0.9, kProportional = 0.4 / 3.0, kIntegral = 0.7 / 3.0;
constexpr double kLeastFactor = 0.2, kMaxFactor = 4.0;
// Steps shortened for other reasons have tiny errors, which must not raise the expected error of the next
// step.
constexpr double kLeastError = 1e-2;
constexpr double kAfterNotFinite = 0.25;
// A change of mode is located to within this time, or after this many attempts.
constexpr double kLocated_s = 1e-5;
constexpr int kMaxLocating = 8;
constexpr int kMaxSwitchesAtOnce = 20;
// A whole communication step by two stages, instead of four, needs an error below one of these shares of the
// tolerance: by the difference from Euler's method, or by its change since the communication step before.
// The latter needs a defect below the third.
constexpr double kCalmError = 0.02, kCalmChange = 0.2, kCalmDefect = 0.2;
constexpr char kCalm = 1, kCalmByChange = 2;
// Communication steps that one matrix serves, that pass with a matrix of their own after a kept one was not enough, and
// by four stages after two were not.
constexpr int kKeptSteps = 20, kFreshSteps = 20, kBusySteps = 6;

// Islands of so many models and more are integrated by parts. The common step of several models is such that this share of
// them expects to need a smaller one.
constexpr std::size_t kFewest = 4;
constexpr double kShareOfSmaller = 0.34;
// Where a trial is accepted of some models alone, their errors are below this share of the tolerance.
constexpr double kApartError = 0.5;
// And the cubic through the trial is at most so many tolerances from the straight line between its ends.
constexpr double kMostBent = 10.0;

/// How many of so many models may need a smaller step than the common one.
std::ptrdiff_t most_smaller(std::size_t models, bool can_refine) {
  if (models < kFewest || !can_refine) return 0;
  return static_cast<std::ptrdiff_t>(kShareOfSmaller * static_cast<double>(models));
}

// Times closer than this are one time (s, relative above 1 s).
double one_time(double t) {
  return 2e-14 * std::max(1.0, std::abs(t));
}

// Two equal steps rather than a large and a tiny one.
double divided(double step, double left) {
  return step >= left ? left : (2.0 * step > left ? 0.5 * left : step);
}

/// Each count of the one that has more.
SolverStatistics most_of(const SolverStatistics& a, const SolverStatistics& b) {
  SolverStatistics most = a;
  for (std::uint64_t SolverStatistics::*const count :
       {&SolverStatistics::steps, &SolverStatistics::rejected_steps, &SolverStatistics::evaluations,
        &SolverStatistics::jacobians, &SolverStatistics::factorisations, &SolverStatistics::newton_failures,
        &SolverStatistics::forced_steps})
    most.*count = std::max(a.*count, b.*count);
  most.largest_step_s = std::max(a.largest_step_s, b.largest_step_s);
  if (a.smallest_step_s == 0.0 || (b.smallest_step_s != 0.0 && b.smallest_step_s < a.smallest_step_s))
    most.smallest_step_s = b.smallest_step_s;
  return most;
}

template <class Visit>
void for_each_active(const OdeSystem& system, const Visit& visit) {
  for (const OdeSystem::Range& range : system.active_states())
    for (std::size_t i = range.begin; i < range.end; ++i) visit(i);
}
}  // namespace

RosenbrockIntegrator::RosenbrockIntegrator(const SolverParameters& parameters, const OdeSystem& system,
                                           CalmSteps calm_steps)
    : trial_(system, parameters.tolerance, statistics_, Linearisation::tangent),
      islands_(system, trial_.units_of_bodies()),
      calm_steps_(calm_steps),
      indicators_(static_cast<std::size_t>(system.indicator_count())),
      new_indicators_(indicators_),
      paces_(system.segments().size()),
      next_paces_(paces_),
      calm_segments_(paces_.size(), 0),
      start_(static_cast<std::size_t>(system.state_count())),
      after_(-kInfinity),
      before_(kInfinity) {
  kept_segments_.reserve(system.segments().size());
  refined_.reserve(system.segments().size()), ranked_.reserve(system.segments().size());
  courses_.spans.resize(system.segments().size());
  for (auto* values : {&courses_.x[0], &courses_.x[1], &courses_.f[0], &courses_.f[1]})
    values->resize(start_.size());
}

void RosenbrockIntegrator::restart() {
  restarted_ = true;
  std::fill(paces_.begin(), paces_.end(), Pace{});
  forget();
}

void RosenbrockIntegrator::reset() {
  Integrator::reset();
  after_ = -kInfinity;
}

// The kept matrix is not saved: forget().
void RosenbrockIntegrator::save(StateWriter& out) const {
  out.put_size(paces_.size());
  for (const Pace& pace : paces_) out.put(pace.step), out.put(pace.last_error);
  out.put(after_), out.put(before_), out.put(restarted_);
  out.put_size(indicators_.size());
  out.put(std::span<const double>(indicators_));
}

void RosenbrockIntegrator::load(StateReader& in) {
  in.expect_size(paces_.size(), "the solver's steps");
  for (Pace& pace : paces_) {
    pace.step = in.number(0.0, 1e6, "the solver's step");
    if (pace.step != 0.0 && pace.step < kSmallestStep_s) in.fail("the solver's step is below its smallest");
    pace.last_error = in.number(kLeastError, 1e30, "the solver's last error");
  }
  after_ = in.number(-kInfinity, kInfinity, "a corner's time");
  before_ = in.number(-kInfinity, kInfinity, "a corner's time");
  if (!(after_ <= before_)) in.fail("the corners' times are not in order");
  restarted_ = in.flag("'restarted'");
  in.expect_size(indicators_.size(), "the solver's indicators");
  for (double& indicator : indicators_) indicator = in.number(-kInfinity, kInfinity, "an indicator");
}

void RosenbrockIntegrator::next_size(double h, bool cut_short) {
  const double error = std::max(trial_.error(), 1e-9);
  const double factor = kSafety * std::pow(error, -kIntegral) * std::pow(last_error_, kProportional);
  const double proposed = h * std::clamp(factor, kLeastFactor, rejected_ ? 1.0 : kMaxFactor);
  // A step that ended for another reason does not lower the proposed size.
  step_ = std::max(cut_short ? std::max(step_, proposed) : proposed, kSmallestStep_s);
  last_error_ = std::max(trial_.error(), kLeastError);
}

void RosenbrockIntegrator::note_step(double h) {
  ++statistics_.steps;
  statistics_.largest_step_s = std::max(statistics_.largest_step_s, h);
  if (statistics_.smallest_step_s == 0.0 || h < statistics_.smallest_step_s) statistics_.smallest_step_s = h;
}

void RosenbrockIntegrator::switch_modes(OdeSystem& system, double t, std::span<double> x) {
  if (indicators_.empty()) return;
  trial_.limit_times(after_, before_);
  for (int i = 0; i < kMaxSwitchesAtOnce && system.switch_modes(trial_.clamped(t), x); ++i)
    ++statistics_.mode_switches;
  system.indicators(trial_.clamped(t), x, indicators_);
}

double RosenbrockIntegrator::mode_ends_at(OdeSystem& system, double t_end) {
  if (indicators_.empty()) return kInfinity;
  system.indicators(trial_.clamped(t_end), trial_.new_x(), new_indicators_);
  double first = kInfinity;
  for (std::size_t i = 0; i < indicators_.size(); ++i) {
    if (new_indicators_[i] >= 0.0) continue;
    // A negative initial value has no crossing: the mode was wrong from the beginning.
    first =
        std::min(first, indicators_[i] > 0.0 ? indicators_[i] / (indicators_[i] - new_indicators_[i]) : 1.0);
  }
  return first;
}

bool RosenbrockIntegrator::begin(OdeSystem& system, double t, double h, bool keeps_matrix,
                                 std::span<const double> x) {
  const bool evaluates_once = calm_steps_ == CalmSteps::two_stages && !keeps_matrix;
  if (evaluates_once ? trial_.begin_linearised(system, t, h, x) : trial_.begin(system, t, h, x)) {
    if (!evaluates_once && !keeps_matrix) trial_.linearise(system, t, x);
    return true;
  }
  failure_ = "the derivatives are not finite at t = " + std::to_string(t) + " s";
  return false;
}

bool RosenbrockIntegrator::same_models(const OdeSystem& system, double h) const {
  const auto awake = system.active_segments();
  return h == kept_h_ && std::equal(awake.begin(), awake.end(), kept_segments_.begin(), kept_segments_.end());
}

bool RosenbrockIntegrator::step_calmly(OdeSystem& system, double t, double h, bool kept,
                                       std::span<const double> x) {
  const Outcome outcome =
      kept ? trial_.two_stages_again(system, t, h, x) : trial_.two_stages(system, t, h, x);
  const bool finite = outcome != Outcome::not_finite;
  const bool follows = finite && remembers_ && same_models(system, h);
  std::fill(calm_segments_.begin(), calm_segments_.end(), 0);
  calm_ = finite && find_calm(system, t, h, follows, x) && mode_ends_at(system, t + h) > 1.0;
  if (calm_ || !kept) {
    remembers_ = finite;
    if (finite) trial_.remember();
    const auto awake = system.active_segments();
    kept_segments_.assign(awake.begin(), awake.end());
    kept_h_ = h;
  }
  if (calm_) {
    kept_steps_ = kept ? kept_steps_ - 1 : kKeptSteps;
    return true;
  }
  ++statistics_.rejected_steps;
  kept_steps_ = 0;
  if (kept)
    fresh_steps_ = kFreshSteps;
  else if (follows || !finite)  // the next step has this one to compare with, if it had none
    busy_steps_ = kBusySteps;
  return false;
}

/// Of the last trial by two stages. True: all segments are calm; else calm_segments_ has those that are.
bool RosenbrockIntegrator::find_calm(OdeSystem& system, double t, double h, bool follows,
                                     std::span<const double> x) {
  if (trial_.error() <= kCalmError) return true;
  if (follows) trial_.find_change(system);
  bool all = true, by_change = false;
  for (const std::size_t segment : system.active_segments()) {
    if (system.segments()[segment].count == 0) continue;
    char& calm = calm_segments_[segment];
    calm = trial_.error_of(system, segment, x) <= kCalmError                ? kCalm
           : follows && trial_.change_of(system, segment, x) <= kCalmChange ? kCalmByChange
                                                                            : 0;
    all = all && calm != 0, by_change = by_change || calm == kCalmByChange;
  }
  if (!by_change) return all;
  trial_.find_defect(system, t, h);
  for (const std::size_t segment : system.active_segments())
    if (calm_segments_[segment] == kCalmByChange && !(trial_.defect_of(system, segment, x) <= kCalmDefect))
      calm_segments_[segment] = 0, all = false;
  return all;
}

bool RosenbrockIntegrator::try_whole(OdeSystem& system, double t, double whole_s, double h, bool& begun,
                                     std::span<const double> x) {
  if (calm_steps_ == CalmSteps::two_stages && busy_steps_ == 0) {
    const bool kept = kept_steps_ > 0 && fresh_steps_ == 0 && same_models(system, whole_s);
    if (fresh_steps_ > 0) --fresh_steps_;
    if (!begin(system, t, h, kept, x)) return false;
    if (step_calmly(system, t, whole_s, kept, x)) return true;
    if (kept) {
      if (!begin(system, t, h, false, x)) return false;
      if (step_calmly(system, t, whole_s, false, x)) return true;
    }
    begun = true;
  }
  if (busy_steps_ > 0) --busy_steps_;
  return true;
}

/// The smallest step, whatever its error: it must not drive.
bool RosenbrockIntegrator::force_step(OdeSystem& system, double t, double h, Outcome outcome,
                                      std::span<const double> x) {
  if (outcome == Outcome::too_large) {
    ++statistics_.forced_steps;
    trial_.set_linearisation(Linearisation::secant);
    const bool stepped =
        begin(system, t, h, false, x) && trial_.four_stages(system, t, h, x) != Outcome::not_finite;
    trial_.set_linearisation(Linearisation::tangent);
    if (stepped) return true;
  }
  failure_ = "no step succeeded, however small, at t = " + std::to_string(t) +
             " s: derivatives are not finite, or the matrix has no inverse";
  return false;
}

bool RosenbrockIntegrator::find_step(OdeSystem& system, double t, double& h, bool begun, bool& mode_ends,
                                     std::span<const double> x) {
  kept_steps_ = 0;
  if (!begun && !begin(system, t, h, false, x)) return false;
  int locating = 0;
  rejected_ = false;
  while (true) {
    const Outcome outcome = trial_.four_stages(system, t, h, x);
    const bool smallest = h <= kSmallestStep_s;
    if (outcome == Outcome::not_finite) {
      if (smallest) return force_step(system, t, h, outcome, x);
      ++statistics_.rejected_steps;
      rejected_ = true;
      islands_.reject();
      step_ = h = std::max(kAfterNotFinite * h, kSmallestStep_s);
      continue;
    }
    if (outcome == Outcome::too_large && !smallest) {
      ++statistics_.rejected_steps;
      rejected_ = true;
      islands_.reject();
      const double factor = kSafety * std::pow(trial_.error(), -1.0 / 3.0);
      step_ = h = std::max(h * std::clamp(factor, kLeastFactor, 0.9), kSmallestStep_s);
      continue;
    }
    if (outcome == Outcome::too_large && !force_step(system, t, h, outcome, x)) return false;
    const double share = mode_ends_at(system, t + h);
    mode_ends = share <= 1.0;
    const double late = (1.0 - share) * h;
    if (!mode_ends || late <= kLocated_s || smallest || ++locating > kMaxLocating) return true;
    h = std::max(share * h + 0.5 * kLocated_s, kSmallestStep_s);
  }
}

void RosenbrockIntegrator::read_paces(const OdeSystem& system, std::span<const std::size_t> segments) {
  step_ = kInfinity, last_error_ = kLeastError;
  for (const std::size_t segment : segments) {
    if (system.segments()[segment].count == 0) continue;
    step_ = std::min(step_, paces_[segment].step);
    last_error_ = std::max(last_error_, paces_[segment].last_error);
  }
}

bool RosenbrockIntegrator::take_pieces(OdeSystem& system, double t, double end, std::span<double> x) {
  for (double now = t; end - now > one_time(end);) {
    const double left = end - now;
    double size = divided(step_, left);
    bool mode_ends = false;
    if (!begin(system, now, size, false, x)) return false;
    islands_.accept();
    if (!find_step(system, now, size, true, mode_ends, x)) return false;
    islands_.accept();
    for_each_active(system, [&](std::size_t i) { x[i] = trial_.new_x()[i]; });
    note_step(size);
    next_size(size, size < step_);
    now = size == left ? end : now + size;
  }
  return true;
}

double RosenbrockIntegrator::common_step() {
  const auto segments = islands_.attended();
  ranked_.clear();
  for (const std::size_t i : segments) ranked_.push_back(next_paces_[i].step);
  const auto place = ranked_.begin() + most_smaller(segments.size(), islands_.can_refine());
  std::nth_element(ranked_.begin(), place, ranked_.end());
  return *place;
}

/// False: too many models need a smaller step. Then their errors are in ranked_.
bool RosenbrockIntegrator::find_refined(OdeSystem& system, double h, std::span<const double> x) {
  const auto segments = islands_.attended();
  refined_.clear(), ranked_.clear();
  for (const std::size_t i : segments) {
    const double error = trial_.error_of(system, i, x);
    ranked_.push_back(error);
    if (!(error <= kApartError)) refined_.push_back(i);
  }
  if (segments.size() < kFewest || !islands_.can_refine() || h <= kSmallestStep_s) return false;
  if (2 * refined_.size() > segments.size()) return false;
  std::size_t straight = 0;
  for (std::size_t k = 0; k < segments.size(); ++k) {
    if (!(ranked_[k] <= kApartError)) continue;
    if (trial_.bend_of(system, segments[k], h, x) <= kMostBent)
      ++straight;
    else
      refined_.push_back(segments[k]);
  }
  if (2 * straight < segments.size()) return false;
  islands_.add_connected(system, refined_);
  return 2 * refined_.size() <= segments.size();
}

bool RosenbrockIntegrator::find_apart(OdeSystem& system, double t, double& h, std::span<const double> x) {
  rejected_ = false;
  while (true) {
    const Outcome outcome = trial_.four_stages(system, t, h, x);
    refined_.clear();
    if (outcome == Outcome::good) return true;
    const bool smallest = h <= kSmallestStep_s;
    if (outcome == Outcome::too_large && find_refined(system, h, x)) return true;
    refined_.clear();
    if (smallest) return force_step(system, t, h, outcome, x);
    ++statistics_.rejected_steps;
    rejected_ = true;
    islands_.reject();
    double factor = kAfterNotFinite;
    if (outcome == Outcome::too_large) {
      const auto place = ranked_.begin() + most_smaller(ranked_.size(), islands_.can_refine());
      std::nth_element(ranked_.begin(), place, ranked_.end(), std::greater<>());
      factor = std::clamp(kSafety * std::pow(*place, -1.0 / 3.0), kLeastFactor, 0.9);
    }
    h = std::max(factor * h, kSmallestStep_s);
  }
}

/// Accepts the trial of the attended segments but for those refined.
void RosenbrockIntegrator::keep_course(const OdeSystem& system, double t, double h, std::span<double> x) {
  auto refined = refined_.begin();
  for (const std::size_t i : islands_.attended()) {
    Pace& pace = next_paces_[i];
    if (refined != refined_.end() && *refined == i) {
      ++refined;
      const double factor = kSafety * std::pow(std::max(trial_.error_of(system, i, x), 1e-9), -1.0 / 3.0);
      pace.step = std::max(h * std::clamp(factor, kLeastFactor, 0.9), kSmallestStep_s);
      continue;
    }
    const double error = trial_.error_of(system, i, x);
    const double factor =
        kSafety * std::pow(std::max(error, 1e-9), -kIntegral) * std::pow(pace.last_error, kProportional);
    const double proposed = h * std::clamp(factor, kLeastFactor, rejected_ ? 1.0 : kMaxFactor);
    pace.step = std::max(h < pace.step ? std::max(pace.step, proposed) : proposed, kSmallestStep_s);
    pace.last_error = std::max(error, kLeastError);
    courses_.spans[i] = {t, h};
    const OdeSystem::Segment& segment = system.segments()[i];
    for (std::size_t k = segment.begin; k < segment.begin + segment.count; ++k) {
      courses_.x[0][k] = x[k], courses_.x[1][k] = x[k] = trial_.new_x()[k];
      courses_.f[0][k] = trial_.start_rates()[k], courses_.f[1][k] = trial_.end_rates()[k];
    }
  }
}

bool RosenbrockIntegrator::take_apart(OdeSystem& system, double t, double end, std::span<double> x) {
  for (double now = t; end - now > one_time(end);) {
    const double left = end - now;
    double size = divided(common_step(), left);
    if (!begin(system, now, size, false, x)) return false;
    islands_.accept();
    if (!find_apart(system, now, size, x)) return false;
    const double next = size == left ? end : now + size;
    keep_course(system, now, size, x);
    note_step(size);
    if (refined_.empty()) {
      islands_.accept();
    } else {
      islands_.refine(system, refined_, courses_);
      const bool taken = take_apart(system, now, next, x);
      islands_.resume(system);
      if (!taken) return false;
    }
    now = next;
  }
  return true;
}

bool RosenbrockIntegrator::take_island(OdeSystem& system, double t, double h, std::size_t island,
                                       std::span<double> x) {
  const auto segments = islands_.segments(island);
  const Islands::Attention attention(islands_, system, island);
  if (std::all_of(segments.begin(), segments.end(),
                  [this](std::size_t i) { return calm_segments_[i] != 0; })) {
    // Forces were taken at the beginning and at the second stage.
    system.update_motion(trial_.clamped(t), start_);
    system.update_motion(trial_.clamped(t + h), trial_.stage_x());
    islands_.accept();
    for_each_active(system, [&](std::size_t i) { x[i] = trial_.new_x()[i]; });
    return true;
  }
  for_each_active(system, [&](std::size_t i) { x[i] = start_[i]; });
  if (segments.size() >= kFewest) {
    for (const std::size_t i : segments) {
      next_paces_[i] = paces_[i], calm_segments_[i] = 0;
      if (paces_[i].step <= 0.0) next_paces_[i].step = std::min(kFirstStep_s, h);
    }
    return take_apart(system, t, t + h, x);
  }
  read_paces(system, segments);
  if (step_ <= 0.0) step_ = std::min(kFirstStep_s, h);
  if (!take_pieces(system, t, t + h, x)) return false;
  for (const std::size_t i : segments) next_paces_[i] = {step_, last_error_}, calm_segments_[i] = 0;
  return true;
}

bool RosenbrockIntegrator::take_islands(OdeSystem& system, double t, double h, bool tried,
                                        std::span<double> x) {
  kept_steps_ = 0;
  if (!tried) std::fill(calm_segments_.begin(), calm_segments_.end(), 0);
  for_each_active(system, [&](std::size_t i) { start_[i] = x[i]; });
  next_paces_ = paces_;
  do {
    const SolverStatistics before = statistics_;
    const std::uint64_t evaluations_before = system.evaluations();
    SolverStatistics most = before;
    std::uint64_t most_evaluations = evaluations_before;
    for (std::size_t island = 0; island < islands_.count(); ++island) {
      if (!islands_.is_new(island)) continue;
      statistics_ = before, system.set_evaluations(evaluations_before);
      if (!take_island(system, t, h, island, x)) return false;
      most = most_of(most, statistics_), most_evaluations = std::max(most_evaluations, system.evaluations());
    }
    statistics_ = most, system.set_evaluations(most_evaluations);
  } while (islands_.join_met());
  paces_ = next_paces_;
  // The trial by two stages was worth its cost.
  const auto awake = system.active_segments();
  const auto calm =
      std::count_if(awake.begin(), awake.end(), [this](std::size_t i) { return calm_segments_[i] != 0; });
  if (2 * static_cast<std::size_t>(calm) >= system.awake_count()) busy_steps_ = 0;
  return true;
}

bool RosenbrockIntegrator::take_step(OdeSystem& system, double t, double h, std::span<double> x) {
  if (system.active_states().empty()) return true;
  const double end = t + h;
  read_paces(system, system.active_segments());
  if (step_ <= 0.0) step_ = std::min(kFirstStep_s, h);
  double now = t;
  bool by_islands = false;
  if (after_ > t + one_time(t)) after_ = -kInfinity;  // the time was set back
  if (restarted_) {
    ++statistics_.restarts;
    switch_modes(system, now, x);
    last_error_ = 1.0;
    restarted_ = false;
  }
  while (true) {
    const double event = system.next_time_event(now + one_time(now));
    if (!(event > now)) {
      failure_ =
          "a plant model announced a next corner that is not after the present, t = " + std::to_string(now) +
          " s";
      return false;
    }
    before_ = std::nextafter(event, -kInfinity);
    const bool event_within = event <= end + one_time(end);
    const double stop = event_within ? std::min(event, end) : end;
    const double left = stop - now;
    if (left > one_time(stop)) {
      double size = divided(step_, left);
      bool mode_ends = false, begun = false;
      const bool whole = now == t && stop == end;
      if (now == t && (!whole || busy_steps_ > 0)) remembers_ = false;
      trial_.limit_times(after_, before_);
      calm_ = false;
      if (whole) {
        if (!try_whole(system, now, h, size, begun, x)) return false;
        by_islands = !calm_ && (islands_.find(system, trial_.clamped(now), h, x) > 1 ||
                                (islands_.count() == 1 && islands_.segments(0).size() >= kFewest));
      }
      if (by_islands) {
        if (!take_islands(system, now, h, begun, x)) return false;
        now = stop;
      } else {
        if (!calm_ && !find_step(system, now, size, begun, mode_ends, x)) return false;
        if (calm_) size = left;
        for_each_active(system, [&](std::size_t i) { x[i] = trial_.new_x()[i]; });
        note_step(size);
        if (!calm_) next_size(size, size < step_);
        now = size == left ? stop : now + size;
        if (mode_ends)
          switch_modes(system, now, x);
        else
          std::swap(indicators_, new_indicators_);
        if (stop - now > one_time(stop)) continue;
      }
    }
    if (event_within) {
      after_ = event;
      before_ = kInfinity;
      ++statistics_.restarts;
      switch_modes(system, now, x);
      last_error_ = 1.0;
      for (Pace& pace : paces_) pace.last_error = 1.0;
    }
    if (end - now <= one_time(end)) {
      if (!by_islands && !calm_)
        for (const std::size_t i : system.active_segments()) paces_[i] = {step_, last_error_};
      return true;
    }
    now = stop;
  }
}

}  // namespace takt
