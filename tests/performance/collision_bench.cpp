// Time of one collision query of two convex hulls, side by side in one run: takt with its memory, takt
// without, libccd's MPR and GJK as they come, and FCL. Coherent poses: body b moves by up to 1 mm and 1 mrad
// per query, as at 1 m/s and 1 rad/s in steps of 1 ms. Exit code 1 when two of them disagree on a verdict.
#include <ccd/ccd.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "server/geometry/convex/query.h"

namespace takt {
namespace {

constexpr int kPoses = 4096;
constexpr int kRounds = 15;
constexpr double kMargin = 2e-4;
constexpr double kRadius = 0.05;

/// A drum of rings of vertices on a sphere; the caps and all sides are flat polygons.
struct Hull {
  std::vector<Vec3> vertices;
  std::vector<int> faces;  // number of corners, corners, and so on
  int face_count = 0;
};

Hull drum(int rings, int segments) {
  Hull hull;
  for (int r = 0; r < rings; ++r) {
    const double latitude = (-0.5 + (r + 0.5) / rings) * 0.93 * std::numbers::pi;
    for (int s = 0; s < segments; ++s) {
      const double longitude = 2.0 * std::numbers::pi * (s + 0.1) / segments;
      hull.vertices.emplace_back(kRadius * std::cos(latitude) * std::cos(longitude),
                                 kRadius * std::cos(latitude) * std::sin(longitude),
                                 kRadius * std::sin(latitude) * (r == 0 ? 1.01 : 1.0));
    }
  }
  const auto face = [&hull](const std::vector<int>& corners) {
    hull.faces.push_back(static_cast<int>(corners.size()));
    hull.faces.insert(hull.faces.end(), corners.begin(), corners.end());
    ++hull.face_count;
  };
  std::vector<int> bottom, top;
  for (int s = 0; s < segments; ++s) {
    bottom.push_back(segments - 1 - s);
    top.push_back((rings - 1) * segments + s);
  }
  face(bottom);
  face(top);
  for (int r = 0; r + 1 < rings; ++r)
    for (int s = 0; s < segments; ++s) {
      const int next = (s + 1) % segments;
      face({r * segments + s, r * segments + next, (r + 1) * segments + next, (r + 1) * segments + s});
    }
  return hull;
}

// libccd as its documentation shows it: one support function, all vertices, world coordinates.
struct CcdBody {
  const std::vector<Vec3>* vertices;
  Pose X_WB;
};

void ccd_support(const void* object, const ccd_vec3_t* dir, ccd_vec3_t* out) {
  const CcdBody& body = *static_cast<const CcdBody*>(object);
  const Vec3 d = body.X_WB.R.transpose() * Vec3(dir->v[0], dir->v[1], dir->v[2]);
  const Vec3* best = body.vertices->data();
  double highest = best->dot(d);
  for (const Vec3& v : *body.vertices) {
    const double h = v.dot(d);
    if (h > highest) {
      highest = h;
      best = &v;
    }
  }
  const Vec3 p = body.X_WB * *best;
  ccdVec3Set(out, p.x(), p.y(), p.z());
}

void ccd_center(const void* object, ccd_vec3_t* out) {
  const CcdBody& body = *static_cast<const CcdBody*>(object);
  ccdVec3Set(out, body.X_WB.p.x(), body.X_WB.p.y(), body.X_WB.p.z());
}

ccd_t ccd_settings() {
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = ccd.support2 = ccd_support;
  ccd.center1 = ccd.center2 = ccd_center;
  ccd.max_iterations = 100;
  return ccd;
}

/// b beside a, the centres `distance` apart, wandering on a small closed path.
std::vector<Pose> path(double distance) {
  std::vector<Pose> poses;
  for (int i = 0; i < kPoses; ++i) {
    const double s = 2.0 * std::numbers::pi * i / kPoses;
    Pose pose;
    pose.R = rotation_from_rpy({0.3 * std::sin(2.0 * s), 0.2 * std::cos(3.0 * s), s});
    // Around a at constant distance, 1 mm or less per step.
    const Vec3 direction = Vec3(std::cos(4.0 * s), std::sin(4.0 * s), 0.4 * std::sin(9.0 * s)).normalized();
    pose.p = distance * direction;
    poses.push_back(pose);
  }
  return poses;
}

struct Measured {
  double ns = 0.0;
  std::vector<char> verdicts;
};

Measured measure(const std::vector<Pose>& poses, const std::function<void(std::vector<char>&)>& run) {
  Measured result;
  result.verdicts.resize(poses.size());
  std::vector<double> times;
  for (int round = 0; round < kRounds; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    run(result.verdicts);
    const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
    times.push_back(spent.count() / static_cast<double>(poses.size()));
  }
  std::sort(times.begin(), times.end());
  result.ns = times[times.size() / 2];
  return result;
}

int compare(int rings, int segments, double distance, bool apart, bool shuffled, double goal_ns) {
  const Hull hull = drum(rings, segments);
  const ConvexShape shape = ConvexShape::from_points(hull.vertices);
  std::vector<Pose> poses = path(distance);
  if (shuffled) std::shuffle(poses.begin(), poses.end(), std::mt19937_64(1));
  const Pose X_WA{rotation_from_rpy({0.1, 0.2, 0.3}), Vec3::Zero()};

  ConvexHint hint;
  QueryCounts counts;
  const Measured ours = measure(poses, [&](std::vector<char>& verdicts) {
    for (std::size_t i = 0; i < poses.size(); ++i)
      verdicts[i] = convex_overlap(shape, X_WA, shape, poses[i], kMargin, hint, counts) ? 1 : 0;
  });
  const Measured fresh = measure(poses, [&](std::vector<char>& verdicts) {
    QueryCounts unused;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      ConvexHint none;
      verdicts[i] = convex_overlap(shape, X_WA, shape, poses[i], kMargin, none, unused) ? 1 : 0;
    }
  });
  const ccd_t ccd = ccd_settings();
  const auto with_ccd = [&](int (*query)(const void*, const void*, const ccd_t*)) {
    return measure(poses, [&, query](std::vector<char>& verdicts) {
      const CcdBody a{&hull.vertices, X_WA};
      CcdBody b{&hull.vertices, {}};
      for (std::size_t i = 0; i < poses.size(); ++i) {
        b.X_WB = poses[i];
        verdicts[i] = query(&a, &b, &ccd) != 0 ? 1 : 0;
      }
    });
  };
  const Measured mpr = with_ccd(ccdMPRIntersect);
  const Measured gjk = with_ccd(ccdGJKIntersect);
  const fcl::Convex<double> convex(
      std::make_shared<const std::vector<fcl::Vector3d>>(hull.vertices.begin(), hull.vertices.end()),
      hull.face_count, std::make_shared<const std::vector<int>>(hull.faces));
  const auto transform = [](const Pose& X) {
    fcl::Transform3d T = fcl::Transform3d::Identity();
    T.linear() = X.R;
    T.translation() = X.p;
    return T;
  };
  std::vector<fcl::Transform3d> transforms;
  for (const Pose& X : poses) transforms.push_back(transform(X));
  const fcl::Transform3d T_WA = transform(X_WA);
  const Measured fcl_time = measure(poses, [&](std::vector<char>& verdicts) {
    const fcl::CollisionRequest<double> request;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      fcl::CollisionResult<double> result;
      verdicts[i] = fcl::collide(&convex, T_WA, &convex, transforms[i], request, result) > 0 ? 1 : 0;
    }
  });

  const double goal = apart ? goal_ns : 0.5 * mpr.ns;
  const double queries = static_cast<double>(counts.by_hint + counts.by_search + counts.by_mpr);
  std::printf(
      "%5zu  %-11s  %7.1f  %7.1f  %-6s  %9.1f  %8.1f  %8.1f  %8.1f  %5.2f   %5.1f %% %5.1f %% %5.1f %%\n",
      hull.vertices.size(), apart ? "apart" : "overlapping", ours.ns, goal,
      ours.ns <= goal ? "met" : "MISSED", fresh.ns, mpr.ns, gjk.ns, fcl_time.ns,
      ours.ns / std::min({mpr.ns, gjk.ns, fcl_time.ns}),
      100.0 * static_cast<double>(counts.by_hint) / queries,
      100.0 * static_cast<double>(counts.by_search) / queries,
      100.0 * static_cast<double>(counts.by_mpr) / queries);
  int wrong = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const char expected = apart ? 0 : 1;
    for (const Measured* m : {&ours, &fresh, &mpr, &gjk, &fcl_time})
      wrong += m->verdicts[i] != expected ? 1 : 0;
  }
  if (wrong > 0) std::printf("       %d wrong verdicts\n", wrong);
  return wrong;
}

}  // namespace
}  // namespace takt

int main() {
  std::printf("Nanoseconds per query of two equal hulls of radius 50 mm, margin 0.2 mm\n");
  int wrong = 0;
  for (const bool shuffled : {false, true}) {
    std::printf(
        "\n%s\n"
        "verts  case            takt     goal          takt first   libccd    libccd       FCL   takt/  "
        "answered by\n"
        "                                               query      MPR       GJK             best   memory  "
        "search "
        "MPR\n",
        shuffled ? "The same poses in a random order" : "Coherent poses");
    for (const bool apart : {true, false}) {
      const double distance = apart ? 0.12 : 0.055;
      wrong += takt::compare(2, 4, distance, apart, shuffled, 20.0);
      wrong += takt::compare(8, 8, distance, apart, shuffled, 25.0);
      wrong += takt::compare(20, 25, distance, apart, shuffled, 35.0);
    }
  }
  return wrong == 0 ? 0 : 1;
}
