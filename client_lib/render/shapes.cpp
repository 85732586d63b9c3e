#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "client_lib/render/scene.h"

namespace takt::render {
namespace {

constexpr int kSegments = 40;  // around a circle; a multiple of 4
constexpr double kPi = std::numbers::pi;

/// A pose at `origin` whose z axis points along `z`.
Pose pose_along(const Vec3& origin, const Vec3& z) {
  Pose pose;
  pose.p = origin;
  pose.R = Quat::FromTwoVectors(Vec3::UnitZ(), z).toRotationMatrix();
  return pose;
}

/// Surface of revolution about z from (radius, height, normal_r, normal_z) of its outline.
struct OutlinePoint {
  double r, z, normal_r, normal_z;
};

void revolve(Mesh& mesh, const std::vector<OutlinePoint>& outline) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto ring = static_cast<std::uint32_t>(kSegments);
  for (const OutlinePoint& point : outline) {
    for (int k = 0; k < kSegments; ++k) {
      const double angle = 2.0 * kPi * k / kSegments;
      const double c = std::cos(angle), s = std::sin(angle);
      mesh.vertices.emplace_back(point.r * c, point.r * s, point.z);
      mesh.normals.emplace_back(point.normal_r * c, point.normal_r * s, point.normal_z);
    }
  }
  for (std::uint32_t row = 0; row + 1 < outline.size(); ++row) {
    for (std::uint32_t k = 0; k < ring; ++k) {
      const std::uint32_t next = (k + 1) % ring;
      const std::uint32_t a = first + row * ring + k, b = first + row * ring + next;
      mesh.triangles.push_back({a, b, b + ring});
      mesh.triangles.push_back({a, b + ring, a + ring});
    }
  }
}

Mesh round_shape(const Vec3& from_W, const Vec3& to_W, double radius, const Color& color, bool round_ends) {
  const Vec3 along = to_W - from_W;
  const double length = along.norm();
  Mesh mesh;
  mesh.color = color;
  mesh.X_WB = pose_along(from_W, length > 0.0 ? Vec3(along / length) : Vec3::UnitZ());
  if (round_ends) {
    std::vector<OutlinePoint> outline;
    const int steps = kSegments / 4;
    for (int k = 0; k <= steps; ++k) {
      const double a = 0.5 * kPi * k / steps;
      outline.push_back({radius * std::sin(a), -radius * std::cos(a), std::sin(a), -std::cos(a)});
    }
    for (int k = 0; k <= steps; ++k) {
      const double a = 0.5 * kPi * k / steps;
      outline.push_back({radius * std::cos(a), length + radius * std::sin(a), std::cos(a), std::sin(a)});
    }
    revolve(mesh, outline);
  } else {
    const double bevel = std::min(0.12 * radius, 0.25 * length);
    const double slope = std::sqrt(0.5);
    revolve(mesh, {{0.0, 0.0, 0.0, -1.0}, {radius - bevel, 0.0, 0.0, -1.0}});
    revolve(mesh, {{radius - bevel, 0.0, slope, -slope}, {radius, bevel, slope, -slope}});
    revolve(mesh, {{radius, bevel, 1.0, 0.0}, {radius, length - bevel, 1.0, 0.0}});
    revolve(mesh, {{radius, length - bevel, slope, slope}, {radius - bevel, length, slope, slope}});
    revolve(mesh, {{radius - bevel, length, 0.0, 1.0}, {0.0, length, 0.0, 1.0}});
  }
  return mesh;
}

}  // namespace

Mesh make_box(const Pose& X_WB, const Vec3& size, const Color& color) {
  Mesh mesh;
  mesh.X_WB = X_WB;
  mesh.color = color;
  for (int k = 0; k < 8; ++k) {
    mesh.vertices.emplace_back(0.5 * size.x() * ((k & 1) != 0 ? 1.0 : -1.0),
                               0.5 * size.y() * ((k & 2) != 0 ? 1.0 : -1.0),
                               0.5 * size.z() * ((k & 4) != 0 ? 1.0 : -1.0));
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

Mesh make_cylinder(const Vec3& from_W, const Vec3& to_W, double radius, const Color& color) {
  return round_shape(from_W, to_W, radius, color, false);
}

Mesh make_capsule(const Vec3& from_W, const Vec3& to_W, double radius, const Color& color) {
  return round_shape(from_W, to_W, radius, color, true);
}

void add_floor(Scene& scene, const Vec3& center_W, double size, double spacing) {
  Mesh floor;
  floor.color = {0.86, 0.87, 0.88};
  const double half = 0.5 * size;
  floor.X_WB.p = center_W;
  floor.vertices = {{-half, -half, 0.0}, {half, -half, 0.0}, {half, half, 0.0}, {-half, half, 0.0}};
  floor.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes.push_back(std::move(floor));
  const Color grey{0.74, 0.76, 0.78};
  const int count = static_cast<int>(std::floor(half / spacing));
  for (int k = -count; k <= count; ++k) {
    const double offset = k * spacing;
    scene.lines.push_back(
        {center_W + Vec3(offset, -half, 0.0), center_W + Vec3(offset, half, 0.0), grey, 1.0});
    scene.lines.push_back(
        {center_W + Vec3(-half, offset, 0.0), center_W + Vec3(half, offset, 0.0), grey, 1.0});
  }
}

void add_edges(Scene& scene, const Mesh& mesh, double angle_rad, const Color& color, double width_px) {
  // Mesh files may repeat a vertex for each face, so edges are matched by position.
  using Point = std::tuple<double, double, double>;
  const auto key = [&](std::uint32_t index) {
    const Vec3& p = mesh.vertices.at(index);
    return Point{p.x(), p.y(), p.z()};
  };
  struct Faces {
    std::vector<Vec3> normals;
  };
  std::map<std::pair<Point, Point>, Faces> edges;
  for (const auto& triangle : mesh.triangles) {
    const Vec3 a = mesh.vertices.at(triangle[0]), b = mesh.vertices.at(triangle[1]),
               c = mesh.vertices.at(triangle[2]);
    const Vec3 normal = (b - a).cross(c - a);
    if (normal.norm() <= 0.0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      Point from = key(triangle[k]), to = key(triangle[(k + 1) % 3]);
      if (to < from) std::swap(from, to);
      edges[{from, to}].normals.push_back(normal.normalized());
    }
  }
  const auto to_world = [&](const Point& p) {
    return mesh.X_WB * Vec3(std::get<0>(p), std::get<1>(p), std::get<2>(p));
  };
  for (const auto& [ends, faces] : edges) {
    const bool border = faces.normals.size() != 2;
    if (border || faces.normals[0].dot(faces.normals[1]) < std::cos(angle_rad)) {
      scene.lines.push_back({to_world(ends.first), to_world(ends.second), color, width_px});
    }
  }
}

void smooth(Mesh& mesh, double angle_rad) {
  using Point = std::array<double, 3>;
  struct Corner {
    Point at;
    std::size_t face;
  };
  std::vector<Vec3> face_areas;  // of the faces, along their normals
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vec3 &a = mesh.vertices.at(t[0]), &b = mesh.vertices.at(t[1]), &c = mesh.vertices.at(t[2]);
    face_areas.push_back((b - a).cross(c - a));
    for (const Vec3& p : {a, b, c}) corners.push_back({{p.x(), p.y(), p.z()}, i});
  }
  std::vector<std::size_t> order(corners.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return corners[a].at != corners[b].at ? corners[a].at < corners[b].at : a < b;
  });
  Mesh result;
  result.X_WB = mesh.X_WB, result.color = mesh.color, result.lit = mesh.lit;
  result.vertices.resize(corners.size()), result.normals.resize(corners.size());
  const double least = std::cos(angle_rad);
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && corners[order[end]].at == corners[order[begin]].at) ++end;
    for (std::size_t k = begin; k < end; ++k) {
      const Corner& corner = corners[order[k]];
      const Vec3 own = face_areas[corner.face].normalized();
      Vec3 sum = Vec3::Zero();
      for (std::size_t other = begin; other < end; ++other) {
        const Vec3& area = face_areas[corners[order[other]].face];
        if (area.dot(own) >= least * area.norm()) sum += area;
      }
      result.vertices[order[k]] = Vec3(corner.at[0], corner.at[1], corner.at[2]);
      result.normals[order[k]] = sum.norm() > 0.0 ? Vec3(sum.normalized()) : Vec3(Vec3::UnitZ());
    }
  }
  for (std::uint32_t i = 0; i < corners.size(); i += 3) result.triangles.push_back({i, i + 1, i + 2});
  mesh = std::move(result);
}

void add_arm(Scene& scene, const ArmModel& arm, const double* q, const Pose& X_WR, const Color& links,
             const Color& joints) {
  const int count = arm.joint_count();
  if (count == 0) return;
  ArmPoses poses;
  forward_kinematics(arm, q, poses);

  // Arms are built stout at the base and slender at the wrist.
  const auto radius = [count](int joint) { return 0.075 - 0.035 * joint / std::max(1, count - 1); };
  Vec3 previous = X_WR.p;
  scene.meshes.push_back(make_cylinder(X_WR.p, X_WR * Vec3(0.0, 0.0, 0.04), 0.095, joints));
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const Pose X_WJ = X_WR * poses.link[index];
    const JointModel& joint = arm.joints[index];
    const Vec3 axis = X_WJ.R * joint.axis;
    if (i > 0) {
      // The part of the offset along the previous joint's axis is that joint's housing, the rest is the link.
      const Pose X_WP = X_WR * poses.link[index - 1];
      const Vec3 previous_axis = X_WP.R * arm.joints[index - 1].axis;
      const Vec3 offset = X_WJ.p - previous;
      const Vec3 corner = previous + previous_axis * offset.dot(previous_axis);
      if ((corner - previous).norm() > 1e-3) {
        scene.meshes.push_back(make_capsule(previous, corner, radius(i - 1) * 0.95, links));
      }
      if ((X_WJ.p - corner).norm() > 1e-3) {
        scene.meshes.push_back(make_capsule(corner, X_WJ.p, radius(i) * 0.85, links));
      }
    } else if ((X_WJ.p - previous).norm() > 1e-3) {
      scene.meshes.push_back(make_cylinder(previous, X_WJ.p, radius(0), links));
    }
    if (joint.type == JointType::revolute) {
      const double half = 1.25 * radius(i);
      scene.meshes.push_back(
          make_cylinder(X_WJ.p - half * axis, X_WJ.p + half * axis, 1.08 * radius(i), joints));
    }
    previous = X_WJ.p;
  }
  const Pose X_WF = X_WR * poses.X_RF;
  if ((X_WF.p - previous).norm() > 1e-3) {
    scene.meshes.push_back(make_cylinder(previous, X_WF.p, radius(count - 1), links));
  }
  scene.meshes.push_back(make_cylinder(X_WF.p - X_WF.R.col(2) * 0.03, X_WF.p, 0.04, joints));
}

}  // namespace takt::render
