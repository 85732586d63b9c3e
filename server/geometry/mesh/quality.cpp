#include "server/geometry/mesh/quality.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>

#include "idl/common/disjoint_sets.h"
#include "idl/common/text.h"
#include "server/geometry/mesh/edges.h"

namespace takt {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

std::string component_key(std::string_view component) {
  return "contact.components." + std::string(component) + ".";
}

class MeshQualityCheck {
 public:
  MeshQualityCheck(const TriangleMesh& mesh, const MeshQualityOptions& options)
      : mesh_(mesh), options_(options), edges_(sorted_half_edges(mesh)) {
    for (const auto& t : mesh_.triangles) {
      const Vec3 &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
      const Vec3 n = (b - a).cross(c - a);
      areas_.push_back(0.5 * n.norm());
      normals_.push_back(n.normalized());
      longest_.push_back(std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}));
      centres_.emplace_back((a + b + c) / 3.0);
    }
  }

  std::vector<MeshDiagnostic> run() {
    find_sharp_edges();
    if (options_.carries_elements) {
      find_needles();
      find_coarse_faces();
    }
    find_distance();
    return std::move(findings_);
  }

 private:
  std::string key() const { return component_key(options_.component) + "element_edge_m"; }

  /// Longest edge after division.
  double element_edge(std::size_t triangle) const {
    return options_.element_edge_m > 0.0 ? std::min(longest_[triangle], options_.element_edge_m)
                                         : longest_[triangle];
  }

  /// Division by halves does not remove needles: the pieces are as slender.
  void find_needles() {
    std::size_t count = 0, worst = 0;
    double ratio = 0.0;
    for (std::size_t i = 0; i < areas_.size(); ++i) {
      const double r = 0.5 * longest_[i] * longest_[i] / areas_[i];
      if (r > options_.needle_ratio) ++count;
      if (r > ratio) ratio = r, worst = i;
    }
    if (count == 0) return;
    findings_.push_back({MeshDiagnosticKind::needles, MeshSeverity::warning, count, ratio, centres_[worst],
                         counted(count, "triangle is a needle", "triangles are needles") + " (longer than " +
                             number_text(options_.needle_ratio, 4) + " heights), the worst " +
                             number_text(ratio, 3) + " heights at " + place_text(centres_[worst]) +
                             ": unless resampled, one line in its middle stands for all of it",
                         "set " + component_key(options_.component) + "resample to always, or " +
                             std::string(remedy_of(MeshDiagnosticKind::needles))});
  }

  /// Two digits, downwards.
  static std::string rounded_down(double value) {
    const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
    return number_text(std::floor(value / unit) * unit, 2);
  }

  template <typename Visit>
  void for_each_edge(const Visit& visit) const {
    for (std::size_t i = 0; i + 1 < edges_.size(); i += 2) {
      const HalfEdge &e = edges_[i], &f = edges_[i + 1];
      const Vec3 &n = normals_[e.triangle], &m = normals_[f.triangle];
      visit(e, f, std::atan2(n.cross(m).norm(), n.dot(m)));
    }
  }

  void find_sharp_edges() {
    std::size_t count = 0;
    double length = 0.0, knife_length = 0.0, largest = 0.0;
    Vec3 place = Vec3::Zero();
    for_each_edge([&](const HalfEdge& e, const HalfEdge& f, double angle) {
      if (!(angle > options_.sharp_angle_rad)) return;
      const Vec3 &p = mesh_.vertices[e.low], &q = mesh_.vertices[e.high];
      // Convex where the other triangle lies below this one.
      const Vec3 across = centres_[f.triangle] - p;
      if (!(normals_[e.triangle].dot(across) < 0.0)) return;
      ++count;
      length += (q - p).norm();
      if (angle > options_.warning_angle_rad) knife_length += (q - p).norm();
      if (angle > largest * (1.0 + 1e-9)) largest = angle, place = 0.5 * (p + q);
    });
    if (!(length > options_.sharp_length_m)) return;
    const bool knife = knife_length > options_.sharp_length_m;
    findings_.push_back({MeshDiagnosticKind::sharp_edges, knife ? MeshSeverity::warning : MeshSeverity::info,
                         count, largest / kDegree, place,
                         counted(count, "edge is", "edges are") + " sharp, " + number_text(1e3 * length, 4) +
                             " mm in all, the sharpest turning by " + number_text(largest / kDegree, 3) +
                             " degrees at " + place_text(place) + ": forces near them depend on the mesh",
                         std::string(remedy_of(MeshDiagnosticKind::sharp_edges))});
  }

  /// Faces of the body: triangles that meet smoothly. Small ones (chamfers, fillets) are ignored.
  void find_coarse_faces() {
    DisjointSets faces(areas_.size());
    for_each_edge([&](const HalfEdge& e, const HalfEdge& f, double angle) {
      if (angle <= options_.smooth_angle_rad) faces.join(e.triangle, f.triangle);
    });
    std::vector<double> size(areas_.size(), 0.0), elements(areas_.size(), 0.0), edge(areas_.size(), 0.0);
    std::vector<Vec3> moment(areas_.size(), Vec3::Zero());
    for (std::uint32_t i = 0; i < areas_.size(); ++i) {
      const std::uint32_t r = faces.root(i);
      const double e = element_edge(i);
      size[r] += areas_[i];
      moment[r] += areas_[i] * centres_[i];
      // Division gives right-angled halves of squares at best, of area e^2 / 4.
      elements[r] += e < longest_[i] ? std::max(1.0, areas_[i] / (0.25 * e * e)) : 1.0;
      edge[r] = std::max(edge[r], e);
    }
    const double least = options_.contact_face_share * std::accumulate(areas_.begin(), areas_.end(), 0.0);
    std::size_t count = 0, worst = 0;
    double fewest = std::numeric_limits<double>::infinity(), wanted = fewest;
    for (std::size_t r = 0; r < areas_.size(); ++r) {
      if (size[r] < least) continue;
      const double across = std::sqrt(0.5 * elements[r]);
      if (!(across < options_.elements_across)) continue;
      ++count;
      wanted = std::min(wanted, std::sqrt(2.0 * size[r]) / options_.elements_across);
      if (across < fewest) fewest = across, worst = r;
    }
    if (count == 0) return;
    const Vec3 place = moment[worst] / size[worst];
    findings_.push_back({MeshDiagnosticKind::coarse, MeshSeverity::warning, count, fewest, place,
                         counted(count, "face has", "faces have") + " fewer than " +
                             number_text(options_.elements_across, 4) +
                             " contact elements across, the coarsest " + number_text(fewest, 2) + " on " +
                             number_text(1e6 * size[worst], 3) + " mm^2 around " + place_text(place) +
                             " (longest edge " + number_text(1e3 * edge[worst], 3) +
                             " mm): where only a part of it is in contact, forces jump",
                         "set " + key() + " to " + rounded_down(wanted) + ", or " +
                             std::string(remedy_of(MeshDiagnosticKind::coarse))});
  }

  void find_distance() {
    if (mesh_.vertices.empty()) return;
    const auto [lower, upper] = bounds_of(mesh_);
    const Vec3 centre = 0.5 * (lower + upper);
    const double size = (upper - lower).norm();
    // Half a unit in the last place of single precision.
    const double resolution = std::ldexp(lower.cwiseAbs().cwiseMax(upper.cwiseAbs()).maxCoeff(), -24);
    if (!(resolution > options_.resolution_m) || !(centre.norm() > options_.far_ratio * size)) return;
    findings_.push_back({MeshDiagnosticKind::far_from_origin, MeshSeverity::warning, 1, resolution, centre,
                         "its middle is " + number_text(centre.norm(), 4) +
                             " m from the origin of its frame, " + number_text(centre.norm() / size, 3) +
                             " times its size: the file holds it to " + number_text(1e6 * resolution, 2) +
                             " um only",
                         std::string(remedy_of(MeshDiagnosticKind::far_from_origin))});
  }

  const TriangleMesh& mesh_;
  const MeshQualityOptions& options_;
  const std::vector<HalfEdge> edges_;
  std::vector<double> areas_, longest_;
  std::vector<Vec3> normals_, centres_;
  std::vector<MeshDiagnostic> findings_;
};

}  // namespace

std::vector<MeshDiagnostic> check_mesh_quality(const TriangleMesh& mesh, const MeshQualityOptions& options) {
  return MeshQualityCheck(mesh, options).run();
}

std::string remedy_for(const std::string& component, const MeshDiagnostic& finding) {
  std::string remedy = finding.remedy;
  const std::string any = component_key(kAnyComponent);
  if (const std::size_t place = remedy.find(any); place != remedy.npos)
    remedy.replace(place, any.size(), component_key(component));
  return remedy;
}

}  // namespace takt
