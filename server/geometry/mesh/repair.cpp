#include "server/geometry/mesh/repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "idl/common/disjoint_sets.h"
#include "idl/common/text.h"
#include "server/geometry/box_tree.h"
#include "server/geometry/mesh/edges.h"
#include "server/geometry/mesh/shells.h"
#include "server/geometry/mesh/welding.h"

namespace takt {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

class Repairer {
 public:
  explicit Repairer(const TriangleMesh& mesh) { result_.mesh = mesh; }

  RepairedMesh run() {
    const std::string bad =
        mesh().triangles.empty() ? "there are no triangles." : find_bad_vertex_or_index(mesh());
    if (!bad.empty()) {
      report(MeshDiagnosticKind::bad_vertex, MeshSeverity::refused, 1, 0.0, Vec3::Zero(), bad,
             step(MeshDiagnosticKind::bad_vertex));
      return finish();
    }
    drop_faces_with_equal_corners();
    weld_open_corners();
    drop_duplicates();
    turn_flat_faces();
    split_open_edges();
    separate_touching();
    report_welded();
    if (mesh().triangles.empty())
      report(MeshDiagnosticKind::encloses_nothing, MeshSeverity::refused, 1, 0.0, mesh().vertices.front(),
             "no triangle is left without doubled faces and faces without area",
             step(MeshDiagnosticKind::encloses_nothing));
    if (edges_are_shared_by_two() && orient()) turn_shells();
    return finish();
  }

 private:
  TriangleMesh& mesh() { return result_.mesh; }
  static std::string step(MeshDiagnosticKind kind) { return std::string(remedy_of(kind)); }

  RepairedMesh finish() {
    result_.problem = check_closed(mesh()).problem;
    return std::move(result_);
  }

  Vec3 centre(const Triangle& t) {
    return (mesh().vertices[t[0]] + mesh().vertices[t[1]] + mesh().vertices[t[2]]) / 3.0;
  }

  void report(MeshDiagnosticKind kind, MeshSeverity severity, std::size_t count, double figure,
              const Vec3& place, const std::string& sentence, const std::string& remedy) {
    result_.findings.push_back({kind, severity, count, figure, place, sentence, remedy});
  }

  void drop_faces_with_equal_corners() {
    auto& triangles = mesh().triangles;
    const auto equal = [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; };
    const auto first = std::find_if(triangles.begin(), triangles.end(), equal);
    if (first == triangles.end()) return;
    if (flat_ == 0) flat_place_ = centre(*first);
    flat_ += static_cast<std::size_t>(std::count_if(triangles.begin(), triangles.end(), equal));
    std::erase_if(triangles, equal);
  }

  std::vector<HalfEdge> open_edges() {
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh());
    std::vector<HalfEdge> open;
    for (std::size_t i = 0, end = 0; i < edges.size(); i = end) {
      end = end_of_edge(edges, i);
      if (end - i == 1) open.push_back(edges[i]);
    }
    return open;
  }

  static std::vector<std::uint32_t> corners_of(const std::vector<HalfEdge>& edges) {
    std::vector<std::uint32_t> corners;
    for (const HalfEdge& e : edges) corners.push_back(e.low), corners.push_back(e.high);
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    return corners;
  }

  double resolution(const std::vector<std::uint32_t>& vertices) {
    double size = 0.0;
    for (const std::uint32_t v : vertices) size = std::max(size, mesh().vertices[v].cwiseAbs().maxCoeff());
    return single_precision_m(size);
  }

  /// Programs write zero as 1e-17, and one point with different last digits.
  void weld_open_corners() {
    const std::vector<std::uint32_t> corners = corners_of(open_edges());
    if (corners.empty()) return;
    welded(weld_vertices(mesh(), corners, resolution(corners)));
  }

  void welded(const ConnectionRepair& done) {
    if (done.count == 0) return;
    if (welded_.count == 0) welded_.place = done.place;
    welded_.count += done.count;
    welded_.furthest_m = std::max(welded_.furthest_m, done.furthest_m);
    drop_faces_with_equal_corners();
  }

  void report_welded() {
    if (welded_.count == 0) return;
    report(MeshDiagnosticKind::near_vertices, MeshSeverity::repaired, welded_.count, welded_.furthest_m,
           welded_.place,
           counted(welded_.count, "vertex lies", "vertices lie") + " up to " +
               number_text(1e6 * welded_.furthest_m, 3) + " um beside another one, the first at " +
               place_text(welded_.place),
           "joined; " + step(MeshDiagnosticKind::near_vertices));
  }

  void separate_touching() {
    const ConnectionRepair done = separate_touching_edges(mesh());
    if (done.count == 0) return;
    report(MeshDiagnosticKind::touching_edges, MeshSeverity::repaired, done.count, 0.0, done.place,
           counted(done.count, "edge belongs", "edges belong") +
               " to bodies that touch there, or to one that touches itself, the first at " +
               place_text(done.place),
           "separated there, and nothing is moved; " + step(MeshDiagnosticKind::touching_edges));
  }

  /// Faces with the same corners: one stays, or all are removed if they form an inner wall. A wall shows at
  /// the rim of the patch that they form together: there the other faces meet without it.
  void drop_duplicates() {
    auto& triangles = mesh().triangles;
    std::vector<std::pair<Triangle, std::uint32_t>> order;
    for (std::uint32_t i = 0; i < triangles.size(); ++i) order.emplace_back(sorted(triangles[i]), i);
    std::sort(order.begin(), order.end());
    TriangleMesh distinct{mesh().vertices, {}};
    std::vector<std::uint32_t> copies;
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i > 0 && order[i].first == order[i - 1].first) {
        ++copies.back();
      } else {
        distinct.triangles.push_back(order[i].first);
        copies.push_back(1);
      }
    }
    if (distinct.triangles.size() == triangles.size()) return;
    const std::vector<std::uint8_t> wall = find_walls(distinct, copies);
    std::vector<std::uint8_t> extra(triangles.size(), 0);
    std::size_t count = 0, next = 0;
    Vec3 place = Vec3::Zero();
    for (std::size_t k = 0; k < copies.size(); ++k)
      for (std::uint32_t i = 0; i < copies[k]; ++i, ++next) {
        if (i == 0 && wall[k] == 0) continue;
        extra[order[next].second] = 1;
        if (count++ == 0) place = centre(order[next].first);
      }
    drop(extra);
    report(
        MeshDiagnosticKind::duplicate_faces, MeshSeverity::repaired, count, 0.0, place,
        counted(count, "face is", "faces are") + " there more than once, the first at " + place_text(place),
        "removed; " + step(MeshDiagnosticKind::duplicate_faces));
  }

  static std::vector<std::uint8_t> find_walls(const TriangleMesh& distinct,
                                              const std::vector<std::uint32_t>& copies) {
    const std::vector<HalfEdge> edges = sorted_half_edges(distinct);
    DisjointSets patches(copies.size());
    for (std::size_t i = 1; i < edges.size(); ++i)
      if (edges[i].low == edges[i - 1].low && edges[i].high == edges[i - 1].high &&
          copies[edges[i].triangle] > 1 && copies[edges[i - 1].triangle] > 1)
        patches.join(edges[i].triangle, edges[i - 1].triangle);
    std::vector<std::uint8_t> needed(copies.size(), 0), needless(copies.size(), 0);
    for (std::size_t i = 0, end = 0; i < edges.size(); i = end) {
      end = end_of_edge(edges, i);
      std::size_t doubled = 0;
      std::uint32_t one = 0;
      for (std::size_t k = i; k < end; ++k)
        if (copies[edges[k].triangle] > 1) ++doubled, one = edges[k].triangle;
      if (doubled != 1) continue;
      ((end - i - 1) % 2 == 0 ? needless : needed)[patches.root(one)] = 1;
    }
    std::vector<std::uint8_t> wall(copies.size(), 0);
    for (std::uint32_t k = 0; k < copies.size(); ++k)
      wall[k] = copies[k] > 1 && needless[patches.root(k)] != 0 && needed[patches.root(k)] == 0;
    return wall;
  }

  void drop(const std::vector<std::uint8_t>& which) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < which.size(); ++i)
      if (which[i] == 0) mesh().triangles[kept++] = mesh().triangles[i];
    mesh().triangles.resize(kept);
  }

  /// A face a b c with c on the line from a to b, and its neighbour b a d: together they are c a d and b c d.
  void turn_flat_faces() {
    constexpr int kPasses = 64;  // a row of flat faces side by side is unwound from its end
    std::vector<std::uint32_t> flat = flat_faces();
    if (!flat.empty() && flat_ == 0) flat_place_ = centre(mesh().triangles[flat.front()]);
    const std::size_t found = flat.size();
    for (int pass = 0; pass < kPasses && !flat.empty(); ++pass) {
      if (!weld_short_edges(flat) && !turn(flat)) break;
      flat = flat_faces();
    }
    if (flat_ + found > flat.size()) {
      const std::size_t count = flat_ + found - flat.size();
      report(MeshDiagnosticKind::zero_area_faces, MeshSeverity::repaired, count, 0.0, flat_place_,
             counted(count, "face has", "faces have") + " no area, the first at " + place_text(flat_place_),
             "removed; " + step(MeshDiagnosticKind::zero_area_faces));
    }
    if (flat.empty()) return;
    const Vec3 place = centre(mesh().triangles[flat.front()]);
    report(MeshDiagnosticKind::zero_area_faces, MeshSeverity::refused, flat.size(), 0.0, place,
           counted(flat.size(), "face has", "faces have") +
               " no area and cannot be removed without a hole, the first at " + place_text(place),
           step(MeshDiagnosticKind::zero_area_faces));
  }

  /// Of faces without area whose corners are one within single precision.
  bool weld_short_edges(const std::vector<std::uint32_t>& flat) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const std::uint32_t i : flat) {
      const Triangle& t = mesh().triangles[i];
      const double near = resolution({t.begin(), t.end()});
      for (std::size_t k = 0; k < 3; ++k)
        if ((mesh().vertices[t[k]] - mesh().vertices[t[(k + 1) % 3]]).norm() <= near)
          edges.emplace_back(t[k], t[(k + 1) % 3]);
    }
    if (edges.empty()) return false;
    const std::size_t before = flat_;
    welded(weld_edges(mesh(), edges));
    flat_ = before;  // counted as faces without area already
    return true;
  }

  std::vector<std::uint32_t> flat_faces() {
    std::vector<std::uint32_t> flat;
    for (std::uint32_t i = 0; i < mesh().triangles.size(); ++i)
      if (!has_area(mesh(), mesh().triangles[i])) flat.push_back(i);
    return flat;
  }

  bool turn(const std::vector<std::uint32_t>& flat) {
    auto& triangles = mesh().triangles;
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh());
    const auto begin_of = [&](std::uint32_t a, std::uint32_t b) {
      const auto at =
          std::lower_bound(edges.begin(), edges.end(), HalfEdge{std::min(a, b), std::max(a, b), 0, false},
                           [](const HalfEdge& l, const HalfEdge& r) {
                             return l.low != r.low ? l.low < r.low : l.high < r.high;
                           });
      const bool found = at != edges.end() && at->low == std::min(a, b) && at->high == std::max(a, b);
      return found ? static_cast<std::size_t>(at - edges.begin()) : edges.size();
    };
    std::vector<std::uint8_t> changed(triangles.size(), 0);
    bool any = false;
    for (const std::uint32_t i : flat) {
      Triangle t = triangles[i];
      const auto length = [&](const Triangle& s) {
        return (mesh().vertices[s[1]] - mesh().vertices[s[0]]).squaredNorm();
      };
      for (const Triangle& s : {Triangle{t[1], t[2], t[0]}, Triangle{t[2], t[0], t[1]}})
        if (length(s) > length(t)) t = s;
      const auto [a, b, c] = t;
      const std::size_t begin = begin_of(a, b);
      if (begin == edges.size() || end_of_edge(edges, begin) - begin != 2) continue;
      const std::uint32_t k = edges[begin].triangle == i ? edges[begin + 1].triangle : edges[begin].triangle;
      if (changed[i] != 0 || changed[k] != 0) continue;
      Triangle n = triangles[k];
      while (n[2] == a || n[2] == b) n = {n[1], n[2], n[0]};
      const std::uint32_t d = n[2];
      // Turned against each other, already joined, or c at an end of the edge: a turn would not help.
      if (n[0] != b || d == c || begin_of(c, d) != edges.size()) continue;
      const Vec3 &pa = mesh().vertices[a], &pb = mesh().vertices[b], &pc = mesh().vertices[c];
      if ((pc - pa).dot(pb - pa) <= 0.0 || (pc - pb).dot(pa - pb) <= 0.0) continue;
      triangles[i] = {c, a, d};
      triangles[k] = {b, c, d};
      changed[i] = changed[k] = 1;
      any = true;
    }
    return any;
  }

  /// T-junctions: a face a b c with vertices on its open edge from a to b becomes a fan around c.
  void split_open_edges() {
    constexpr int kPasses = 8;  // an edge of a fan may have vertices on it too
    std::size_t count = 0;
    double furthest = 0.0;
    Vec3 place = Vec3::Zero();
    for (int pass = 0; pass < kPasses; ++pass) {
      const std::size_t before = count;
      split_open_edges_once(count, furthest, place);
      if (count == before) break;
    }
    if (count > 0)
      report(MeshDiagnosticKind::split_edges, MeshSeverity::repaired, count, furthest, place,
             counted(count, "vertex lies", "vertices lie") +
                 " on edges of faces that do not have them, up to " + number_text(1e6 * furthest, 3) +
                 " um beside, the first at " + place_text(place),
             "the edges are divided there; " + step(MeshDiagnosticKind::split_edges));
  }

  void split_open_edges_once(std::size_t& count, double& furthest, Vec3& place) {
    const std::vector<HalfEdge> open = open_edges();
    if (open.empty()) return;
    const std::vector<std::uint32_t> corners = corners_of(open);
    std::vector<Aabb> boxes;
    for (const std::uint32_t v : corners) boxes.push_back({mesh().vertices[v], mesh().vertices[v]});
    const BoxTree tree(boxes);
    const double near = resolution(corners);
    auto& triangles = mesh().triangles;
    std::vector<std::uint8_t> changed(triangles.size(), 0);
    std::vector<std::pair<double, std::uint32_t>> on;
    for (const HalfEdge& e : open) {
      if (changed[e.triangle] != 0) continue;  // its other edges are next
      Triangle t = triangles[e.triangle];
      while (std::min(t[0], t[1]) != e.low || std::max(t[0], t[1]) != e.high) t = {t[1], t[2], t[0]};
      const Vec3 a = mesh().vertices[t[0]], ab = mesh().vertices[t[1]] - a;
      const double length = ab.norm();
      on.clear();
      double beside = 0.0;
      tree.visit_segment(a, mesh().vertices[t[1]], near, [&](std::int32_t index) {
        const std::uint32_t v = corners[static_cast<std::size_t>(index)];
        if (v == t[0] || v == t[1] || v == t[2]) return;
        const double along = (mesh().vertices[v] - a).dot(ab) / length;
        const double distance = (mesh().vertices[v] - a - along / length * ab).norm();
        if (!(along > near && along < length - near && distance <= near)) return;
        on.emplace_back(along, v);
        beside = std::max(beside, distance);
      });
      if (on.empty()) continue;
      std::sort(on.begin(), on.end());
      changed[e.triangle] = 1;
      if (count == 0) place = mesh().vertices[on.front().second];
      count += on.size();
      furthest = std::max(furthest, beside);
      std::uint32_t from = t[0];
      for (const auto& [along, v] : on) {
        triangles.push_back({t[2], from, v});
        from = v;
      }
      triangles[e.triangle] = {t[2], from, t[1]};
    }
  }

  bool edges_are_shared_by_two() {
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh());
    std::size_t open = 0, crowded = 0, most = 0;
    double length = 0.0;
    Vec3 open_place = Vec3::Zero(), crowded_place = Vec3::Zero();
    for (std::size_t i = 0, end = 0; i < edges.size(); i = end) {
      end = end_of_edge(edges, i);
      const Vec3 &p = mesh().vertices[edges[i].low], &q = mesh().vertices[edges[i].high];
      if (end - i == 1) {
        if (open++ == 0) open_place = 0.5 * (p + q);
        length += (q - p).norm();
      } else if (end - i > 2) {
        if (crowded++ == 0) crowded_place = 0.5 * (p + q);
        most = std::max(most, end - i);
      }
    }
    if (open > 0)
      report(MeshDiagnosticKind::open_edges, MeshSeverity::refused, open, length, open_place,
             counted(open, "edge belongs", "edges belong") + " to one face only, " +
                 number_text(1e3 * length, 4) + " mm in all: the surface has a hole, the first at " +
                 place_text(open_place),
             step(MeshDiagnosticKind::open_edges));
    if (crowded > 0)
      report(MeshDiagnosticKind::crowded_edges, MeshSeverity::refused, crowded, static_cast<double>(most),
             crowded_place,
             counted(crowded, "edge belongs", "edges belong") + " to more than two faces (up to " +
                 std::to_string(most) + "), the first at " + place_text(crowded_place),
             step(MeshDiagnosticKind::crowded_edges));
    return open == 0 && crowded == 0 && !mesh().triangles.empty();
  }

  /// Neighbours run through their common edge in opposite directions.
  bool orient() {
    auto& triangles = mesh().triangles;
    const std::vector<HalfEdge> edges = sorted_half_edges(mesh());
    struct Neighbour {
      std::uint32_t triangle;
      bool turned;
    };
    std::vector<std::array<Neighbour, 3>> neighbours(triangles.size());
    std::vector<std::uint8_t> filled(triangles.size(), 0);
    for (std::size_t i = 0; i < edges.size(); i += 2) {
      const HalfEdge &e = edges[i], &f = edges[i + 1];
      const bool turned = e.upward == f.upward;
      neighbours[e.triangle][filled[e.triangle]++] = {f.triangle, turned};
      neighbours[f.triangle][filled[f.triangle]++] = {e.triangle, turned};
    }
    enum : std::uint8_t { kUnseen, kKeep, kTurn };
    std::vector<std::uint8_t> state(triangles.size(), kUnseen);
    std::size_t count = 0;
    Vec3 place = Vec3::Zero();
    for (std::uint32_t seed = 0; seed < triangles.size(); ++seed) {
      if (state[seed] != kUnseen) continue;
      state[seed] = kKeep;
      std::vector<std::uint32_t> shell{seed};
      for (std::size_t i = 0; i < shell.size(); ++i)
        for (const Neighbour& n : neighbours[shell[i]]) {
          const std::uint8_t wanted = (state[shell[i]] == kTurn) != n.turned ? kTurn : kKeep;
          if (state[n.triangle] == kUnseen) {
            state[n.triangle] = wanted;
            shell.push_back(n.triangle);
          } else if (state[n.triangle] != wanted) {
            const Vec3 where = centre(triangles[n.triangle]);
            report(MeshDiagnosticKind::not_orientable, MeshSeverity::refused, 1, 0.0, where,
                   "the surface has one side only (like a Klein bottle), which shows at " + place_text(where),
                   step(MeshDiagnosticKind::not_orientable));
            return false;
          }
        }
      const auto turned = static_cast<std::size_t>(
          std::count_if(shell.begin(), shell.end(), [&](std::uint32_t i) { return state[i] == kTurn; }));
      const std::uint8_t fewer = 2 * turned <= shell.size() ? kTurn : kKeep;
      std::sort(shell.begin(), shell.end());
      for (const std::uint32_t i : shell)
        if (state[i] == fewer) {
          if (count++ == 0) place = centre(triangles[i]);
          std::swap(triangles[i][1], triangles[i][2]);
        }
    }
    if (count > 0)
      report(MeshDiagnosticKind::mixed_orientation, MeshSeverity::repaired, count, 0.0, place,
             counted(count, "face is", "faces are") + " turned against the neighbours, the first at " +
                 place_text(place),
             "turned; " + step(MeshDiagnosticKind::mixed_orientation));
    return true;
  }

  void turn_shells() {
    std::vector<Shell> shells = find_shells(mesh());
    Group inside_out, nothing, cavities, solids;
    // An outermost shell is turned together with the shells inside it.
    std::vector<std::uint8_t> turn(shells.size(), 0), flat(shells.size(), 0);
    for (std::size_t i = 0; i < shells.size(); ++i) {
      const Shell& s = shells[i];
      const double size = (s.box.upper - s.box.lower).norm();
      if (!(std::abs(s.volume_m3) > 1e-12 * size * size * size))
        nothing.add(*this, s), flat[i] = 1;
      else if (s.around.empty() && s.volume_m3 < 0.0)
        turn[i] = 1;
    }
    for (std::size_t i = 0; i < shells.size(); ++i) {
      Shell& s = shells[i];
      for (const std::size_t outer : s.around)
        if (shells[outer].around.empty() && turn[outer] != 0) turn[i] = 1;
      if (turn[i] == 0) continue;
      if (s.around.empty()) inside_out.add(*this, s);
      for (const std::uint32_t k : s.triangles) std::swap(mesh().triangles[k][1], mesh().triangles[k][2]);
      s.volume_m3 = -s.volume_m3;
    }
    // A solid inside a cavity counts as a solid of its own.
    for (std::size_t i = 0; i < shells.size(); ++i) {
      const Shell& s = shells[i];
      if (s.around.empty() || flat[i] != 0) continue;
      if (s.volume_m3 < 0.0)
        cavities.add(*this, s);
      else if (s.around.size() % 2 == 1)
        solids.add(*this, s);
    }

    if (inside_out.count > 0)
      report(MeshDiagnosticKind::inside_out, MeshSeverity::repaired, inside_out.count, inside_out.largest,
             inside_out.place,
             counted(inside_out.count, "closed shell is", "closed shells are") +
                 " inside out, the largest of " + number_text(1e6 * inside_out.largest, 4) + " cm^3 at " +
                 place_text(inside_out.place),
             "turned; " + step(MeshDiagnosticKind::inside_out));
    if (nothing.count > 0) {
      const bool all = nothing.count == shells.size();
      if (!all) drop_shells(shells, flat);
      report(MeshDiagnosticKind::encloses_nothing, all ? MeshSeverity::refused : MeshSeverity::repaired,
             nothing.count, nothing.largest, nothing.place,
             counted(nothing.count, "closed shell encloses", "closed shells enclose") +
                 " nothing, the first at " + place_text(nothing.place),
             (all ? "" : "removed; ") + step(MeshDiagnosticKind::encloses_nothing));
    }
    if (cavities.count > 0)
      report(MeshDiagnosticKind::cavities, MeshSeverity::info, cavities.count, cavities.sum, cavities.place,
             counted(cavities.count, "cavity", "cavities") + " of " + number_text(1e6 * cavities.sum, 4) +
                 " cm^3 in all, the largest at " + place_text(cavities.place),
             step(MeshDiagnosticKind::cavities));
    if (solids.count > 0)
      report(MeshDiagnosticKind::nested_solids, MeshSeverity::warning, solids.count, solids.sum, solids.place,
             counted(solids.count, "closed shell lies", "closed shells lie") +
                 " inside another and faces outwards: its volume of " + number_text(1e6 * solids.sum, 4) +
                 " cm^3 counts twice, the largest at " + place_text(solids.place),
             step(MeshDiagnosticKind::nested_solids));
  }

  void drop_shells(const std::vector<Shell>& shells, const std::vector<std::uint8_t>& which) {
    std::vector<std::uint8_t> dropped(mesh().triangles.size(), 0);
    for (std::size_t i = 0; i < shells.size(); ++i)
      if (which[i] != 0)
        for (const std::uint32_t k : shells[i].triangles) dropped[k] = 1;
    drop(dropped);
  }

  struct Group {
    std::size_t count = 0;
    double largest = 0.0, sum = 0.0;
    Vec3 place = Vec3::Zero();

    void add(Repairer& repairer, const Shell& shell) {
      const double volume = std::abs(shell.volume_m3);
      if (count++ == 0 || volume > largest) {
        largest = volume;
        place = repairer.centre(repairer.mesh().triangles[shell.triangles.front()]);
      }
      sum += volume;
    }
  };

  RepairedMesh result_;
  ConnectionRepair welded_;
  std::size_t flat_ = 0;  ///< removed because they name a vertex twice
  Vec3 flat_place_ = Vec3::Zero();
};

}  // namespace

RepairedMesh repair_mesh(const TriangleMesh& mesh) {
  return Repairer(mesh).run();
}

}  // namespace takt
