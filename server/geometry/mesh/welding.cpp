#include "server/geometry/mesh/welding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "idl/common/disjoint_sets.h"
#include "server/geometry/box_tree.h"
#include "server/geometry/mesh/edges.h"

namespace takt {
namespace {

ConnectionRepair renumber(TriangleMesh& mesh, DisjointSets& sets,
                          const std::vector<std::uint32_t>& vertices) {
  ConnectionRepair done;
  for (const std::uint32_t v : vertices) {
    const std::uint32_t root = sets.root(v);
    if (root == v) continue;
    if (done.count++ == 0) done.place = mesh.vertices[root];
    done.furthest_m = std::max(done.furthest_m, (mesh.vertices[v] - mesh.vertices[root]).norm());
  }
  if (done.count > 0)
    for (auto& t : mesh.triangles)
      for (std::uint32_t& v : t) v = sets.root(v);
  return done;
}

/// Two faces that are neighbours at an edge of several bodies.
struct Joint {
  std::uint32_t low, high;
  std::array<std::uint32_t, 2> face;
};

class Separator {
 public:
  explicit Separator(TriangleMesh& mesh) : mesh_(mesh) {}

  ConnectionRepair run() {
    constexpr int kPasses = 8;  // a face divided in one pass may have another such edge
    find_joints(true);
    if (done_.count == 0) return done_;
    copy_vertices();
    for (int pass = 0; pass < kPasses; ++pass) {
      find_joints(false);
      if (!divide_edges()) break;
    }
    return done_;
  }

 private:
  struct Around {
    double angle;
    std::uint32_t face;
    bool opens;  ///< the solid begins here, in the direction of larger angles
  };

  /// The corner of the face that is not on the edge.
  std::uint32_t apex(const HalfEdge& e) const {
    const auto& t = mesh_.triangles[e.triangle];
    return *std::find_if(t.begin(), t.end(), [&](std::uint32_t v) { return v != e.low && v != e.high; });
  }

  /// The faces around an edge in pairs that bound a solid; empty if they do not.
  std::vector<Joint> joints_of(const HalfEdge* edge, std::size_t count) const {
    constexpr double kLeastAngle = 1e-6;
    const Vec3& p = mesh_.vertices[edge->low];
    const Vec3 u = (mesh_.vertices[edge->high] - p).normalized();
    const auto across = [&](const HalfEdge& e) {
      const Vec3 w = mesh_.vertices[apex(e)] - p;
      return Vec3(w - u.dot(w) * u);
    };
    const Vec3 x = across(*edge).normalized(), y = u.cross(x);
    std::vector<Around> around;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 w = across(edge[i]);
      around.push_back({std::atan2(y.dot(w), x.dot(w)), edge[i].triangle, !edge[i].upward});
    }
    std::sort(around.begin(), around.end(), [](const Around& a, const Around& b) {
      return a.angle != b.angle ? a.angle < b.angle : a.face < b.face;
    });
    std::vector<Joint> joints;
    for (std::size_t i = 0; i < count; ++i) {
      const Around &here = around[i], &next = around[(i + 1) % count];
      const double turn = next.angle - here.angle + (i + 1 == count ? 2.0 * std::numbers::pi : 0.0);
      if (here.opens == next.opens || !(turn > kLeastAngle)) return {};
      if (here.opens) joints.push_back({edge->low, edge->high, {here.face, next.face}});
    }
    return joints;
  }

  void find_joints(bool count_them) {
    joints_.clear();
    edges_ = sorted_half_edges(mesh_);
    for (std::size_t i = 0, end = 0; i < edges_.size(); i = end) {
      end = end_of_edge(edges_, i);
      if (end - i < 4 || (end - i) % 2 != 0) continue;
      const std::vector<Joint> found = joints_of(&edges_[i], end - i);
      joints_.insert(joints_.end(), found.begin(), found.end());
      if (found.empty() || !count_them) continue;
      if (done_.count++ == 0)
        done_.place = 0.5 * (mesh_.vertices[edges_[i].low] + mesh_.vertices[edges_[i].high]);
    }
  }

  std::size_t corner(std::uint32_t face, std::uint32_t vertex) const {
    const auto& t = mesh_.triangles[face];
    return 3 * face + static_cast<std::size_t>(std::find(t.begin(), t.end(), vertex) - t.begin());
  }

  /// Corners at one vertex are one if faces lead from one to the other.
  void copy_vertices() {
    DisjointSets corners(3 * mesh_.triangles.size());
    const auto join = [&](std::uint32_t low, std::uint32_t high, std::uint32_t a, std::uint32_t b) {
      corners.join(corner(a, low), corner(b, low));
      corners.join(corner(a, high), corner(b, high));
    };
    std::vector<std::uint8_t> shared(mesh_.vertices.size(), 0);
    for (const Joint& j : joints_) {
      join(j.low, j.high, j.face[0], j.face[1]);
      shared[j.low] = shared[j.high] = 1;
    }
    std::size_t joint = 0;
    for (std::size_t i = 0, end = 0; i < edges_.size(); i = end) {
      end = end_of_edge(edges_, i);
      const HalfEdge& e = edges_[i];
      if (joint < joints_.size() && joints_[joint].low == e.low && joints_[joint].high == e.high) {
        joint += (end - i) / 2;
        continue;
      }
      for (std::size_t k = i + 1; k < end; ++k) join(e.low, e.high, e.triangle, edges_[k].triangle);
    }
    std::map<std::size_t, std::uint32_t> number;  // by set of corners
    std::vector<std::uint8_t> kept(mesh_.vertices.size(), 0);
    for (std::size_t f = 0; f < mesh_.triangles.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t& v = mesh_.triangles[f][k];
        if (v >= shared.size() || shared[v] == 0) continue;
        const auto [entry, is_new] = number.try_emplace(corners.root(3 * f + k), v);
        if (is_new && kept[v] != 0) {
          entry->second = static_cast<std::uint32_t>(mesh_.vertices.size());
          mesh_.vertices.push_back(Vec3(mesh_.vertices[v]));
        }
        kept[v] = 1;
        v = entry->second;
      }
  }

  /// All solids but the first at an edge get a vertex of their own in its middle.
  bool divide_edges() {
    std::vector<std::uint8_t> changed(mesh_.triangles.size(), 0);
    bool any = false;
    for (std::size_t i = 1; i < joints_.size(); ++i) {
      const Joint &j = joints_[i], &before = joints_[i - 1];
      if (j.low != before.low || j.high != before.high) continue;
      if (changed[j.face[0]] != 0 || changed[j.face[1]] != 0) continue;  // in the next pass
      const auto middle = static_cast<std::uint32_t>(mesh_.vertices.size());
      mesh_.vertices.push_back(Vec3(0.5 * (mesh_.vertices[j.low] + mesh_.vertices[j.high])));
      for (const std::uint32_t f : j.face) {
        auto half = mesh_.triangles[f];
        std::replace(half.begin(), half.end(), j.low, middle);
        std::replace(mesh_.triangles[f].begin(), mesh_.triangles[f].end(), j.high, middle);
        mesh_.triangles.push_back(half);
        changed[f] = 1;
      }
      any = true;
    }
    return any;
  }

  TriangleMesh& mesh_;
  std::vector<HalfEdge> edges_;
  std::vector<Joint> joints_;  ///< by edge
  ConnectionRepair done_;
};

}  // namespace

double single_precision_m(double size) {
  return 4.0 * static_cast<double>(std::numeric_limits<float>::epsilon()) * size;
}

ConnectionRepair weld_vertices(TriangleMesh& mesh, const std::vector<std::uint32_t>& vertices,
                               double near_m) {
  std::vector<Aabb> boxes;
  for (const std::uint32_t v : vertices) boxes.push_back({mesh.vertices[v], mesh.vertices[v]});
  const BoxTree tree(boxes);
  DisjointSets sets(mesh.vertices.size());
  const double limit2 = near_m * near_m;
  for (const std::uint32_t v : vertices)
    tree.visit_near(mesh.vertices[v], limit2, [&](std::int32_t index) {
      const std::uint32_t other = vertices[static_cast<std::size_t>(index)];
      if ((mesh.vertices[other] - mesh.vertices[v]).squaredNorm() <= limit2) sets.join(v, other);
    });
  return renumber(mesh, sets, vertices);
}

ConnectionRepair weld_edges(TriangleMesh& mesh,
                            const std::vector<std::pair<std::uint32_t, std::uint32_t>>& edges) {
  DisjointSets sets(mesh.vertices.size());
  std::vector<std::uint32_t> vertices;
  for (const auto& [a, b] : edges) {
    sets.join(a, b);
    vertices.push_back(a), vertices.push_back(b);
  }
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return renumber(mesh, sets, vertices);
}

ConnectionRepair separate_touching_edges(TriangleMesh& mesh) {
  return Separator(mesh).run();
}

}  // namespace takt
