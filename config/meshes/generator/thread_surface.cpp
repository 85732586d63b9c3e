#include "config/meshes/generator/thread_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace takt::meshes {
namespace {

constexpr double kPi = std::numbers::pi;

/// One line of vertices for each angle. The keys are `along`.
std::vector<Row> thread_lines(MeshMaker& maker, const ThreadSurface& s,
                              const std::function<double(double, double)>& radius) {
  std::vector<Row> lines(static_cast<std::size_t>(s.columns));
  const double least = 0.02 * s.pitch;  // nearer to an end, a row would make needles
  for (int i = 0; i < s.columns; ++i) {
    Row& line = lines[static_cast<std::size_t>(i)];
    const double angle = 2.0 * kPi * i / s.columns, rise = s.pitch * i / s.columns;
    const auto add = [&](double z) {
      line.vertex.push_back(maker.vertex(cylindrical(radius(z - rise, z), angle, s.from + z)));
      line.key.push_back(z - rise);
    };
    add(0.0);
    const int turns = static_cast<int>(std::ceil(s.height / s.pitch)) + 1;
    for (int turn = -2; turn <= turns; ++turn)
      for (const double row : s.rows) {
        const double z = (turn + row) * s.pitch + rise;
        if (z > least && z < s.height - least) add(z);
      }
    add(s.height);
  }
  return lines;
}

void join_lines(MeshMaker& maker, const ThreadSurface& s, std::vector<Row> lines) {
  const std::size_t count = lines.size();
  for (std::size_t i = 0; i < count; ++i) {
    Row next = lines[(i + 1) % count];
    if (i + 1 == count)
      for (double& key : next.key) key -= s.pitch;
    // Keys of the same row differ by rounding.
    for (Row* line : {&lines[i], &next})
      for (double& key : line->key) key = std::round(key * 1e12) * 1e-12;
    if (s.outwards) {
      maker.strip(lines[i], next);
    } else {
      maker.strip(next, lines[i]);
    }
    if (i + 1 < count) lines[i + 1] = next;
  }
}

/// Cuts the part of a pitch between two places into equal pieces, the first of which begin there.
void add_rows(std::vector<double>& at, double from, double to, int pieces) {
  for (int i = 0; i < pieces; ++i) at.push_back(from + (to - from) * i / pieces);
}

/// Distance in pitches from the nearest crest, 0 to 1/2.
double from_crest(double along, double pitch) {
  const double u = along / pitch;
  return std::abs(u - std::round(u));
}

}  // namespace

BasicProfile::BasicProfile(double diameter, double pitch, double inwards)
    : pitch_(pitch),
      crest_radius_(0.5 * diameter - inwards),
      root_radius_(crest_radius_ - 0.625 * std::sqrt(0.75) * pitch) {}

double BasicProfile::radius(double along) const {
  const double u = from_crest(along, pitch_);
  if (u <= 1.0 / 16.0) return crest_radius_;
  if (u >= 6.0 / 16.0) return root_radius_;
  return crest_radius_ + (u - 1.0 / 16.0) * 16.0 / 5.0 * (root_radius_ - crest_radius_);
}

std::vector<double> BasicProfile::rows(double edge) const {
  std::vector<double> at;
  const double flank = std::hypot(5.0 / 16.0 * pitch_, crest_radius_ - root_radius_);
  const int pieces = std::max(1, static_cast<int>(std::ceil(flank / edge - 1e-9)));
  add_rows(at, 1.0 / 16.0, 6.0 / 16.0, pieces);
  add_rows(at, 6.0 / 16.0, 10.0 / 16.0,
           std::max(1, static_cast<int>(std::ceil(0.25 * pitch_ / edge - 1e-9))));
  add_rows(at, 10.0 / 16.0, 15.0 / 16.0, pieces);
  add_rows(at, 15.0 / 16.0, 17.0 / 16.0, 1);
  return at;
}

KnuckleProfile::KnuckleProfile(double crest_radius, double root_radius, double pitch)
    : crest_radius_(crest_radius), root_radius_(root_radius), pitch_(pitch) {
  // Their centres are half a pitch apart along the axis, and two radii apart.
  const double depth = crest_radius - root_radius;
  arc_radius_ = (0.25 * pitch * pitch + depth * depth) / (4.0 * depth);
}

double KnuckleProfile::radius(double along) const {
  const double u = from_crest(along, pitch_);
  const double beside = std::min(u, 0.5 - u) * pitch_;  // of the middle of the arc
  const double sagitta = arc_radius_ - std::sqrt(arc_radius_ * arc_radius_ - beside * beside);
  return u <= 0.25 ? crest_radius_ - sagitta : root_radius_ + sagitta;
}

std::vector<double> KnuckleProfile::rows(double edge) const {
  std::vector<double> at;
  const double half_angle = std::asin(0.25 * pitch_ / arc_radius_);  // of an arc
  const int pieces = std::max(2, static_cast<int>(std::ceil(arc_radius_ * half_angle / edge - 1e-9)));
  const auto place = [&](double middle, int i) {
    return middle + arc_radius_ * std::sin(half_angle * i / pieces) / pitch_;
  };
  for (int i = 0; i < pieces; ++i) at.push_back(place(0.0, i));
  for (int i = -pieces; i < pieces; ++i) at.push_back(place(0.5, i));
  for (int i = -pieces; i < 0; ++i) at.push_back(place(1.0, i));
  return at;
}

ThreadEnds add_thread(MeshMaker& maker, const ThreadSurface& surface,
                      const std::function<double(double along, double z)>& radius) {
  const std::vector<Row> lines = thread_lines(maker, surface, radius);
  ThreadEnds ends;
  for (const Row& line : lines) {
    ends.lower.push_back(line.vertex.front());
    ends.upper.push_back(line.vertex.back());
  }
  join_lines(maker, surface, lines);
  return ends;
}

Ring add_bolt_thread(MeshMaker& maker, const BasicProfile& profile, double length, int columns, double edge) {
  const double pitch = profile.pitch(), end_radius = profile.root_radius() - 0.1 * pitch;
  const ThreadEnds thread = add_thread(
      maker, {pitch, 0.0, length, columns, profile.rows(edge), true},
      [&](double along, double z) { return std::min(profile.radius(along), end_radius + length - z); });
  maker.fan(thread.upper, {0.0, 0.0, length});
  return thread.lower;
}

}  // namespace takt::meshes
