#include "server/headless/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace takt {

namespace {
constexpr std::chrono::milliseconds kFirst{500}, kPeriod{100};
constexpr int kWidth = 30;

std::string bar_of(double part) {
  const int full = static_cast<int>(std::floor(part * kWidth));
  std::string bar(static_cast<std::size_t>(full), '=');
  if (full < kWidth) bar += '>';
  bar.resize(static_cast<std::size_t>(kWidth), ' ');
  return "[" + bar + "]";
}

/// ", 12 s left"; empty at the start.
std::string left_of(double part, double wall_s) {
  if (!(part > 0.0)) return "";
  const double left_s = wall_s * (1.0 - part) / part;
  char text[48];
  if (left_s < 100.0)
    std::snprintf(text, sizeof text, ", %.0f s left", std::ceil(left_s));
  else
    std::snprintf(text, sizeof text, ", %.0f min left", std::ceil(left_s / 60.0));
  return text;
}

/// `part`: finished share; `part_here`: of the work at the start of the wall time.
std::string line_of(double part, const std::string& what, double part_here, double wall_s) {
  char text[32];
  std::snprintf(text, sizeof text, " %3.0f %%  ", std::floor(100.0 * part));
  return bar_of(part) + text + what + left_of(part_here, wall_s);
}

}  // namespace

std::string progress_line(double time_s, double end_s, double wall_s) {
  const double part = end_s > 0.0 ? std::clamp(time_s / end_s, 0.0, 1.0) : 1.0;
  char what[64];
  std::snprintf(what, sizeof what, "%.1f of %.1f s", time_s, end_s);
  return line_of(part, what, part, wall_s);
}

std::string progress_line(int done, int all, int before, const std::string& what, double wall_s) {
  const auto part = [](int of, int whole) {
    return whole > 0 ? std::clamp(static_cast<double>(of) / whole, 0.0, 1.0) : 1.0;
  };
  return line_of(part(done, all), std::to_string(done) + " of " + std::to_string(all) + " " + what,
                 part(done - before, all - before), wall_s);
}

std::string import_line(const std::string& component, double part, double wall_s) {
  const double done = std::clamp(part, 0.0, 1.0);
  char text[16];
  std::snprintf(text, sizeof text, " %3.0f %%", std::floor(100.0 * done));
  return "Convex parts of " + component + " " + bar_of(done) + text + left_of(done, wall_s);
}

Progress::Progress(bool quiet, double end_s)
    : end_s_(end_s),
      shows_(!quiet && isatty(STDERR_FILENO) != 0),
      begin_(std::chrono::steady_clock::now()),
      due_(begin_ + kFirst) {}

Progress::~Progress() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

double Progress::wall_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

bool Progress::due() {
  const auto now = std::chrono::steady_clock::now();
  if (!shows_ || now < due_) return false;
  due_ = now + kPeriod;
  return true;
}

void Progress::at(int done, int all, int before, const std::string& what) {
  if (shows_) draw(progress_line(done, all, before, what, wall_s()));
}

void Progress::draw(const std::string& line) {
  drawn_ = true;
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
}

void Progress::at(double time_s) {
  if (due()) draw(progress_line(time_s, end_s_, wall_s()));
}

void Progress::at_import(const std::string& component, double part) {
  if (component != importing_) {
    importing_ = component;
    import_begin_ = std::chrono::steady_clock::now();
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - import_begin_;
  if (due()) draw(import_line(component, part, took.count()));
}

}  // namespace takt
