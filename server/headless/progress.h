#pragma once
// Progress and remaining time of a long run: one line that renews itself, on a terminal only.
#include <chrono>
#include <string>

namespace takt {

/// "[=======>            ]  37 %  15.4 of 42.0 s, 12 s left". `wall_s`: elapsed time.
std::string progress_line(double time_s, double end_s, double wall_s);
/// "[=======>            ]  37 %  15 of 42 runs, 12 s left": `before` of them were finished at the start of
/// the wall time.
std::string progress_line(int done, int all, int before, const std::string& what, double wall_s);

/// "Convex parts of Housing [=======>            ]  37 %, 12 s left"; empty for a short import. `wall_s`:
/// elapsed time of this component.
std::string import_line(const std::string& component, double part, double wall_s);

/// A line that renews itself and is taken away at the end; on a terminal only.
class Progress {
 public:
  /// Without output if the error output is no terminal, or if `quiet`. `end_s` is for at(time_s).
  explicit Progress(bool quiet, double end_s = 0.0);
  /// Erases the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  bool shows() const { return shows_; }
  void at(double time_s);
  /// For counted work: `done` of `all`.
  void at(int done, int all, int before, const std::string& what);
  /// Instead: how much of a component's import is done.
  void at_import(const std::string& component, double part);

 private:
  double wall_s() const;
  /// Whether the line is due to be drawn again.
  bool due();
  void draw(const std::string& line);

  const double end_s_;
  const bool shows_;
  const std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point due_;
  bool drawn_ = false;
  std::string importing_;
  std::chrono::steady_clock::time_point import_begin_{};
};

}  // namespace takt
