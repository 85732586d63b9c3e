#pragma once
// The steps that a robot program has begun, in the order of their beginnings.
#include <cstddef>
#include <cstdint>
#include <deque>
#include <stdexcept>
#include <string>
#include <utility>

namespace takt::controller {

/// Begin and end of one step of a routine: a section that the program names by r:step("NAME"), or one call
/// that moves or waits.
struct ProgramStep {
  int robot = -1;
  std::string name;    ///< given by the program, or the call: "move_line"
  int line = 0;        ///< of the program
  bool named = false;  ///< by the program
  double begin_s = 0.0;
  double end_s = -1.0;  ///< negative: it goes on
};

/// All steps, for the report of a run; or the newest, for viewers of a program that runs for weeks.
class StepLog {
 public:
  static constexpr std::size_t kMost = 1'000'000;

  /// `newest`: how many are kept; 0: all, and more than kMost are an error.
  explicit StepLog(std::size_t newest = 0) : newest_(newest) {}

  /// Returns the step's number, counted from 0. Throws std::runtime_error.
  std::int64_t begin(ProgramStep step) {
    if (newest_ == 0 && steps_.size() >= kMost)
      throw std::runtime_error("more than a million steps are reported");
    steps_.push_back(std::move(step));
    if (newest_ != 0 && steps_.size() > newest_) {
      steps_.pop_front();
      ++first_;
    }
    ++changes_;
    return first_ + static_cast<std::int64_t>(steps_.size()) - 1;
  }
  void end(std::int64_t number, double time_s) {
    if (number < first_) return;
    steps_[static_cast<std::size_t>(number - first_)].end_s = time_s;
    ++changes_;
  }
  void clear() {
    steps_.clear();
    first_ = 0;
    ++changes_;
  }

  const std::deque<ProgramStep>& steps() const { return steps_; }
  std::int64_t first() const { return first_; }       ///< number of the first of steps()
  std::uint64_t changes() const { return changes_; }  ///< grows with each change

 private:
  std::size_t newest_;
  std::deque<ProgramStep> steps_;
  std::int64_t first_ = 0;
  std::uint64_t changes_ = 0;
};

}  // namespace takt::controller
