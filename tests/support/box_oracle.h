#pragma once
// Contacts and holders, computed the slow way: exact distances between oriented boxes, and every sequence of
// the contact graph listed. Shares no code with the collision check or the partner search.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "plant_models/spatial.h"
#include "server/contact/holding/partner_search.h"

namespace takt::test {

struct OrientedBox {
  Vec3 center = Vec3::Zero();  ///< in the world (m)
  Mat3 R = Mat3::Identity();   ///< columns: the box's axes
  Vec3 half = Vec3::Zero();    ///< half extents (m), >= 0

  Vec3 corner(int i) const {
    return center + R * Vec3((i & 1) ? half.x() : -half.x(), (i & 2) ? half.y() : -half.y(),
                             (i & 4) ? half.z() : -half.z());
  }
  double lowest() const { return center.z() - R.row(2).cwiseAbs().dot(half); }
  double highest() const { return center.z() + R.row(2).cwiseAbs().dot(half); }
};

/// Largest gap over the 15 axes of the separating axis theorem: positive exactly if the boxes are apart, and
/// then no larger than their distance.
inline double axis_gap(const OrientedBox& a, const OrientedBox& b) {
  const Vec3 d = b.center - a.center;
  double gap = -std::numeric_limits<double>::infinity();
  const auto test = [&](const Vec3& n) {
    gap = std::max(gap, std::abs(d.dot(n)) - (a.R.transpose() * n).cwiseAbs().dot(a.half) -
                            (b.R.transpose() * n).cwiseAbs().dot(b.half));
  };
  for (int i = 0; i < 3; ++i) test(a.R.col(i)), test(b.R.col(i));
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 n = a.R.col(i).cross(b.R.col(k));
      const double length = n.norm();
      if (length > 1e-6) test(n / length);  // nearly parallel edges: the face normals decide
    }
  }
  return gap;
}

inline double point_distance(const Vec3& p, const OrientedBox& box) {
  const Vec3 local = (box.R.transpose() * (p - box.center)).cwiseAbs() - box.half;
  return local.cwiseMax(0.0).norm();
}

inline double segment_distance(const Vec3& p1, const Vec3& q1, const Vec3& p2, const Vec3& q2) {
  // The closest points of the two lines if both lie inside, else an end of one to the other segment.
  const auto to_segment = [](const Vec3& x, const Vec3& p, const Vec3& q) {
    const Vec3 d = q - p;
    const double l2 = d.squaredNorm();
    const double s = l2 > 0.0 ? std::clamp((x - p).dot(d) / l2, 0.0, 1.0) : 0.0;
    return (x - p - s * d).norm();
  };
  double best = std::min(std::min(to_segment(p1, p2, q2), to_segment(q1, p2, q2)),
                         std::min(to_segment(p2, p1, q1), to_segment(q2, p1, q1)));
  const Vec3 u = q1 - p1, v = q2 - p2, w = p1 - p2;
  const double a = u.squaredNorm(), b = u.dot(v), c = v.squaredNorm(), d = u.dot(w), e = v.dot(w);
  const double det = a * c - b * b;
  if (det > 1e-12 * a * c) {
    const double s = (b * e - c * d) / det, t = (a * e - b * d) / det;
    if (s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) best = std::min(best, (w + s * u - t * v).norm());
  }
  return best;
}

enum class Nearness { apart, unclear, touching };

/// Closer than `margin`? Unclear within `tolerance` of it. Exact: two boxes apart are closest at a corner of
/// one or at two edges.
inline Nearness nearness(const OrientedBox& a, const OrientedBox& b, double margin, double tolerance) {
  const double reach = a.half.norm() + b.half.norm() + margin + tolerance;
  if ((a.center - b.center).squaredNorm() > reach * reach) return Nearness::apart;
  const double gap = axis_gap(a, b);
  if (gap > margin + tolerance) return Nearness::apart;
  if (gap <= 0.0) return Nearness::touching;
  double distance = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    distance = std::min({distance, point_distance(a.corner(i), b), point_distance(b.corner(i), a)});
  }
  if (distance < margin - tolerance) return Nearness::touching;
  for (int i = 0; i < 8; ++i) {
    for (int bit_i = 1; bit_i < 8; bit_i *= 2) {
      if ((i & bit_i) != 0) continue;
      for (int k = 0; k < 8; ++k) {
        for (int bit_k = 1; bit_k < 8; bit_k *= 2) {
          if ((k & bit_k) != 0) continue;
          distance = std::min(
              distance, segment_distance(a.corner(i), a.corner(i | bit_i), b.corner(k), b.corner(k | bit_k)));
        }
      }
    }
  }
  if (distance < margin - tolerance) return Nearness::touching;
  return distance > margin + tolerance ? Nearness::apart : Nearness::unclear;
}

/// Partner from the full list of sequences, by the rules in words: type of the end, length, present partner,
/// id.
inline int partner_by_listing(const ContactGraph& graph, int part, int present) {
  const std::vector<SearchStep> steps = list_sequences(graph, part);
  int best = -1;
  std::tuple<int, std::size_t, bool, int> best_key{};
  for (const std::vector<int>& sequence : steps.back().resulting) {
    const int end = sequence.back();
    const ComponentType type = graph.vertices[static_cast<std::size_t>(end)].type;
    const int preference = type == ComponentType::gripper ? 0 : type == ComponentType::ground ? 1 : 2;
    const std::tuple<int, std::size_t, bool, int> key{preference, sequence.size(), end != present, end};
    if (best == -1 || key < best_key) best = end, best_key = key;
  }
  return best;
}

/// Number of sequences from every Part: the cost of listing them.
inline std::vector<double> count_sequences(const ContactGraph& graph) {
  std::vector<double> count(graph.vertices.size(), -1.0);
  const auto visit = [&](const auto& self, int v) -> double {
    double& n = count[static_cast<std::size_t>(v)];
    if (n >= 0.0) return n;
    double sum = 0.0;
    if (graph.vertices[static_cast<std::size_t>(v)].type == ComponentType::part) {
      for (const int next : graph.neighbours[static_cast<std::size_t>(v)]) {
        if (graph.may_follow(v, next)) sum += self(self, next);
      }
    }
    return n = std::max(sum, 1.0);
  };
  for (std::size_t v = 0; v < count.size(); ++v) visit(visit, static_cast<int>(v));
  return count;
}

}  // namespace takt::test
