#include "server/geometry/surface/contact_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "idl/common/text.h"
#include "server/geometry/surface/clusters.h"
#include "server/geometry/surface/contact_surface_data.h"
#include "server/geometry/surface/face_octree_cache.h"
#include "server/geometry/surface/surface_elements.h"

namespace takt {
namespace {

using Data = ContactSurface::Data;

struct Side {
  std::uint32_t low, high;
  std::int32_t face;
  int edge;
};

void connect_faces(Data& data) {
  std::vector<Side> sides;
  sides.reserve(3 * data.faces.size());
  for (std::size_t i = 0; i < data.faces.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = data.faces[i].vertex[static_cast<std::size_t>(k)];
      const std::uint32_t to = data.faces[i].vertex[static_cast<std::size_t>((k + 1) % 3)];
      sides.push_back({std::min(from, to), std::max(from, to), static_cast<std::int32_t>(i), k});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    if (a.low != b.low) return a.low < b.low;
    return a.high != b.high ? a.high < b.high : a.face < b.face;
  });
  // The mesh is closed: sides come in pairs.
  for (std::size_t i = 0; i + 1 < sides.size(); i += 2) {
    const Side &a = sides[i], &b = sides[i + 1];
    data.faces[static_cast<std::size_t>(a.face)].neighbour[static_cast<std::size_t>(a.edge)] = b.face;
    data.faces[static_cast<std::size_t>(b.face)].neighbour[static_cast<std::size_t>(b.edge)] = a.face;
  }
}

/// Grows planes from the largest triangles, whose normals are most exact.
void find_patches(Data& data, const std::vector<Vec3>& normals, const std::vector<double>& areas) {
  const double flatness_m = 1e-8 * data.radius_m;
  std::vector<std::int32_t> order(data.faces.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    return areas[static_cast<std::size_t>(a)] > areas[static_cast<std::size_t>(b)];
  });
  std::vector<std::int32_t> open;
  for (const std::int32_t seed : order) {
    ContactFace& first = data.faces[static_cast<std::size_t>(seed)];
    if (first.patch >= 0) continue;
    const auto number = static_cast<std::int32_t>(data.patches.size());
    ContactPatch patch;
    patch.normal = normals[static_cast<std::size_t>(seed)];
    patch.offset_m = patch.normal.dot(data.vertices[first.vertex[0]]);
    first.patch = number;
    open.assign(1, seed);
    while (!open.empty()) {
      const std::int32_t face = open.back();
      open.pop_back();
      for (const std::int32_t next : data.faces[static_cast<std::size_t>(face)].neighbour) {
        ContactFace& other = data.faces[static_cast<std::size_t>(next)];
        if (other.patch >= 0 || normals[static_cast<std::size_t>(next)].dot(patch.normal) < 0.999) continue;
        const bool flat = std::all_of(other.vertex.begin(), other.vertex.end(), [&](std::uint32_t v) {
          return std::abs(patch.normal.dot(data.vertices[v]) - patch.offset_m) <= flatness_m;
        });
        if (!flat) continue;
        other.patch = number;
        open.push_back(next);
      }
    }
    data.patches.push_back(patch);
  }
}

void find_vertex_normals(Data& data) {
  constexpr std::int32_t kNone = -2;
  data.vertex_normal.assign(data.vertices.size(), Vec3::Zero());
  data.vertex_patch.assign(data.vertices.size(), kNone);
  for (const ContactFace& face : data.faces) {
    const auto corner = data.corners(face);
    const Vec3& normal = data.patches[static_cast<std::size_t>(face.patch)].normal;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = corner[(k + 1) % 3] - corner[k], b = corner[(k + 2) % 3] - corner[k];
      data.vertex_normal[face.vertex[k]] += std::atan2(a.cross(b).norm(), a.dot(b)) * normal;
      std::int32_t& patch = data.vertex_patch[face.vertex[k]];
      patch = patch == kNone || patch == face.patch ? face.patch : -1;
    }
  }
}

/// Facets of a round surface are less inclined to each other.
constexpr double kSharp_rad = 0.35;

void find_sharp_edges(Data& data) {
  const double least_cos = std::cos(kSharp_rad);
  for (ContactFace& face : data.faces) {
    const Vec3& normal = data.patches[static_cast<std::size_t>(face.patch)].normal;
    for (std::size_t k = 0; k < 3; ++k) {
      const ContactFace& beyond = data.faces[static_cast<std::size_t>(face.neighbour[k])];
      const Vec3& other = data.patches[static_cast<std::size_t>(beyond.patch)].normal;
      if (normal.dot(other) < least_cos && other.dot(face.inward[k]) > 0.0)
        face.sharp_inwards = static_cast<std::uint8_t>(face.sharp_inwards | 1U << k);
    }
  }
  for (ContactFace& face : data.faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const ContactFace& beyond = data.faces[static_cast<std::size_t>(face.neighbour[k])];
      if (beyond.patch == face.patch && (beyond.sharp_inwards & 7U) != 0)
        face.sharp_inwards = static_cast<std::uint8_t>(face.sharp_inwards | 8U << k);
    }
}

void make_faces(const TriangleMesh& mesh, const FaceOctreeCache& octrees, Data& data) {
  data.vertices = mesh.vertices;
  data.faces.resize(mesh.triangles.size());
  std::vector<Vec3> normals(mesh.triangles.size());
  std::vector<double> areas(mesh.triangles.size());
  std::vector<Aabb> boxes(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    ContactFace& face = data.faces[i];
    face.vertex = mesh.triangles[i];
    const auto corner = data.corners(face);
    const Vec3 twice = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    normals[i] = twice.normalized();
    areas[i] = 0.5 * twice.norm();
    data.surface_area_m2 += areas[i];
    for (std::size_t k = 0; k < 3; ++k) {
      face.inward[k] = normals[i].cross(corner[(k + 1) % 3] - corner[k]).normalized();
      face.shift_m[k] = -face.inward[k].dot(corner[k]);
    }
    boxes[i] = {corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]),
                corner[0].cwiseMax(corner[1]).cwiseMax(corner[2])};
  }
  data.face_tree = BoxTree(boxes);
  data.bounds = boxes.front();
  for (const Aabb& box : boxes) {
    data.bounds.lower = data.bounds.lower.cwiseMin(box.lower);
    data.bounds.upper = data.bounds.upper.cwiseMax(box.upper);
  }
  data.box = {0.5 * (data.bounds.lower + data.bounds.upper), 0.5 * (data.bounds.upper - data.bounds.lower)};
  for (const ContactFace& face : data.faces)
    for (const std::uint32_t v : face.vertex)
      data.radius_m = std::max(data.radius_m, (data.vertices[v] - data.box.center_B).norm());
  connect_faces(data);
  find_patches(data, normals, areas);
  find_vertex_normals(data);
  find_sharp_edges(data);
  if (data.curved()) data.octree = face_octree_cached(data, mesh, octrees);
  make_pieces(data);
}

/// Extent of the body from a point of its surface along the inward normal, by spheres that fit inside. Any value
/// of at least `enough_m` if it is not smaller.
double thickness_m(const Data& data, const Vec3& p, const Vec3& n, double enough_m) {
  const double least_m = 1e-3 * data.radius_m, most_m = std::min(2.0 * data.radius_m, enough_m);
  double s = least_m;
  NearestFace nearest;
  while (s < most_m) {
    const double inside_m = -data.signed_distance_m(p - s * n, nearest);
    if (!(inside_m > 0.0)) break;
    s += std::max(inside_m, least_m);
  }
  return s;
}

/// Edges are thin everywhere: a twentieth of the surface does not count.
void find_wall(Data& data) {
  constexpr std::size_t kSamples = 300;
  if (data.element_count() == 0) return;
  const std::size_t stride = std::max<std::size_t>(1, data.element_count() / kSamples);
  const std::size_t samples = (data.element_count() - 1) / stride + 1;
  // A heap of the smallest ones, as many as are needed: a sample thicker than all of them is not looked at any
  // further.
  std::vector<double> smallest;
  const std::size_t needed = samples / 20 + 1;
  for (std::size_t e = 0; e < data.element_count(); e += stride) {
    const bool full = smallest.size() == needed;
    const double s = thickness_m(data, data.point(e), data.normal(e), full ? smallest.front() : INFINITY);
    if (full && !(s < smallest.front())) continue;
    if (full) {
      std::pop_heap(smallest.begin(), smallest.end());
      smallest.pop_back();
    }
    smallest.push_back(s);
    std::push_heap(smallest.begin(), smallest.end());
  }
  data.wall_m = smallest.front();
}

}  // namespace

ClosestOnFace ContactSurface::Data::closest_on_face(const ContactFace& face, const Vec3& x) const {
  using Feature = ClosestOnFace::Feature;
  ClosestOnFace found;
  std::array<double, 3> margin;
  for (std::size_t k = 0; k < 3; ++k) margin[k] = face.inward[k].dot(x) + face.shift_m[k];
  if (margin[0] >= 0.0 && margin[1] >= 0.0 && margin[2] >= 0.0) {
    const ContactPatch& plane = patches[static_cast<std::size_t>(face.patch)];
    const double height = plane.normal.dot(x) - plane.offset_m;
    found.q = x - height * plane.normal;
    found.squared_m2 = height * height;
    return found;
  }
  // Beyond an edge: the closest point is on one of the edges that x is beyond.
  found.squared_m2 = INFINITY;
  for (std::uint8_t k = 0; k < 3; ++k) {
    if (margin[k] >= 0.0) continue;
    // The same bits from both faces of the edge.
    const auto next = static_cast<std::uint8_t>((k + 1) % 3);
    const bool forward = face.vertex[k] < face.vertex[next];
    const Vec3& a = vertices[face.vertex[forward ? k : next]];
    const Vec3& b = vertices[face.vertex[forward ? next : k]];
    const Vec3 ab = b - a;
    const double along = ab.dot(x - a), length2 = ab.squaredNorm();
    const bool at_a = along <= 0.0, at_b = along >= length2;
    const Vec3 q = at_a ? a : at_b ? b : Vec3(a + along / length2 * ab);
    const double squared = (x - q).squaredNorm();
    if (!(squared < found.squared_m2)) continue;
    found.squared_m2 = squared;
    found.q = q;
    found.feature = at_a || at_b ? Feature::vertex : Feature::edge;
    found.number = found.feature == Feature::edge ? k : at_a == forward ? k : next;
  }
  return found;
}

bool ContactSurface::Data::inside(const ContactFace& face, const ClosestOnFace& closest,
                                  const Vec3& x) const {
  using Feature = ClosestOnFace::Feature;
  const auto normal = [this](const ContactFace& f) {
    return patches[static_cast<std::size_t>(f.patch)].normal;
  };
  if (closest.feature == Feature::inside) {
    const ContactPatch& plane = patches[static_cast<std::size_t>(face.patch)];
    return plane.normal.dot(x) < plane.offset_m;
  }
  if (closest.feature == Feature::edge) {
    const ContactFace& beyond = faces[static_cast<std::size_t>(face.neighbour[closest.number])];
    return (x - closest.q).dot(normal(face) + normal(beyond)) < 0.0;
  }
  return (x - closest.q).dot(vertex_normal[face.vertex[closest.number]]) < 0.0;
}

// The bounds of all faces first: they do not wait for each other. Most points are beside the inside of the face that is
// closest, whose bound is its distance: then no other face is tested.
NearestFace ContactSurface::Data::nearest_face(const Vec3& x, const FaceOctree::Leaf& leaf) const {
  if (!FaceOctree::has_list(leaf)) return nearest_face(x);
  const std::span<const FaceOctree::Near> listed = octree.faces(leaf);
  const double from_center_m = octree.from_center_m(leaf, x);
  std::array<double, FaceOctree::kLong> least_m2;
  std::size_t count = 0, first = 0;
  double limit_m = INFINITY;
  for (; count < listed.size(); ++count) {
    if (static_cast<double>(listed[count].at_least_m) - from_center_m > limit_m) break;
    const FaceBound bound = bound_of(faces[static_cast<std::size_t>(listed[count].face)], x);
    least_m2[count] = bound.squared_m2();
    if (least_m2[count] < least_m2[first]) first = count;
    if (!(bound.beyond_m < 0.0)) limit_m = std::min(limit_m, kFurther * std::abs(bound.height_m));
  }
  NearestFace nearest;
  take_nearer(listed[first].face, x, nearest);
  for (std::size_t i = 0; i < count; ++i)
    if (i != first && !(least_m2[i] > kFurther * nearest.closest.squared_m2))
      take_nearer(listed[i].face, x, nearest);
  return nearest;
}

NearestFace ContactSurface::Data::nearest_face(const Vec3& x, std::int32_t guess) const {
  NearestFace nearest;
  if (guess >= 0) (void)take_nearer(guess, x, nearest);
  face_tree.visit_near(x, nearest.closest.squared_m2,
                       [&](std::int32_t face) { (void)take_nearer(face, x, nearest); });
  return nearest;
}

double ContactSurface::Data::signed_distance_m(const Vec3& x, NearestFace& nearest) const {
  nearest = nearest_face(x, nearest.face);
  if (nearest.face < 0) return INFINITY;
  const double distance = std::sqrt(nearest.closest.squared_m2);
  return inside(faces[static_cast<std::size_t>(nearest.face)], nearest.closest, x) ? -distance : distance;
}

double default_element_edge_m(const TriangleMesh& mesh) {
  constexpr double kShare = 1.0 / 7.0;
  if (mesh.vertices.empty()) return 0.0;
  const Aabb box = bounds_of(mesh);
  return kShare * (box.upper - box.lower).norm();
}

ContactSurface::ContactSurface(const TriangleMesh& mesh, const ContactSurfaceOptions& options,
                               const FaceOctreeCache* octrees)
    : data_(std::make_unique<Data>()) {
  const MeshCheck check = check_closed(mesh);
  if (!check.ok()) throw std::invalid_argument("a contact surface needs a closed mesh: " + check.problem);
  if (!(options.element_edge_m >= 0.0 && std::isfinite(options.element_edge_m)))
    throw std::invalid_argument("element_edge_m is " + std::to_string(options.element_edge_m) +
                                "; it must be positive, or 0 for the triangles as they are");
  make_faces(mesh, octrees == nullptr ? FaceOctreeCache() : *octrees, *data_);
  make_elements(*data_, options, default_element_edge_m(mesh));
  make_clusters(*data_);
  find_wall(*data_);
}

std::string sentence_of(const ResamplingReport& report) {
  const auto percent = [](double share) { return number_text(100.0 * share, 2) + " %"; };
  return "flat faces have cells of at most " + number_text(1e3 * report.spacing_m, 3) +
         " mm as contact elements instead of pieces of their triangles: " + std::to_string(report.elements) +
         " elements for " + std::to_string(report.elements_before) +
         "; elements longer than 10 widths have " + percent(report.slender_share) +
         " of its surface, as pieces of triangles " + percent(report.slender_share_before);
}

ContactSurface::~ContactSurface() = default;

std::size_t ContactSurface::element_count() const {
  return data_->element_count();
}
const ResamplingReport& ContactSurface::resampling() const {
  return data_->resampling;
}
std::size_t ContactSurface::face_count() const {
  return data_->faces.size();
}
double ContactSurface::area_m2() const {
  return data_->surface_area_m2;
}
double ContactSurface::patch_area_m2() const {
  return data_->surface_area_m2 / static_cast<double>(data_->patches.size());
}
double ContactSurface::wall_m() const {
  return data_->wall_m;
}
const Aabb& ContactSurface::bounds_B() const {
  return data_->bounds;
}

}  // namespace takt
