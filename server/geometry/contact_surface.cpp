#include "server/geometry/contact_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string>

#include "server/geometry/contact_clusters.h"
#include "server/geometry/contact_surface_data.h"
#include "server/geometry/element_corners.h"

namespace takt {
namespace {

using Data = ContactSurface::Data;

/// Far more than any computation would survive; a slip of the edge length should not fill the memory.
constexpr std::size_t kMaxElements = 5'000'000;

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

/// Grows planes from the largest triangles: their normals are known best.
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

/// Regions without sharp edges inside, and the sharp convex edges between them.
void find_rims(Data& data, const std::vector<Vec3>& normals) {
  std::vector<std::int32_t> open;
  std::int32_t region = 0;
  const auto smooth = [&](std::size_t a, std::int32_t b) {
    return normals[a].dot(normals[static_cast<std::size_t>(b)]) >= kSharpCosine;
  };
  for (std::size_t seed = 0; seed < data.faces.size(); ++seed) {
    if (data.faces[seed].region >= 0) continue;
    data.faces[seed].region = region;
    open.assign(1, static_cast<std::int32_t>(seed));
    while (!open.empty()) {
      const auto face = static_cast<std::size_t>(open.back());
      open.pop_back();
      for (const std::int32_t next : data.faces[face].neighbour) {
        ContactFace& other = data.faces[static_cast<std::size_t>(next)];
        if (other.region >= 0 || !smooth(face, next)) continue;
        other.region = region;
        open.push_back(next);
      }
    }
    ++region;
  }
  data.patch_region.resize(data.patches.size());
  for (const ContactFace& face : data.faces)
    data.patch_region[static_cast<std::size_t>(face.patch)] = face.region;
  for (ContactFace& face : data.faces) face.rim = {-1, -1, -1};
  for (std::size_t i = 0; i < data.faces.size(); ++i) {
    ContactFace& face = data.faces[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t next = face.neighbour[k];
      if (next < static_cast<std::int32_t>(i) || smooth(i, next)) continue;
      ContactFace& other = data.faces[static_cast<std::size_t>(next)];
      const std::uint32_t from = face.vertex[k], to = face.vertex[(k + 1) % 3];
      for (std::size_t j = 0; j < 3; ++j) {
        if (other.vertex[j] != to || other.vertex[(j + 1) % 3] != from) continue;
        const Vec3& opposite = data.vertices[other.vertex[(j + 2) % 3]];
        if (normals[i].dot(opposite - data.vertices[from]) >= 0.0) continue;  // concave
        face.rim[k] = other.rim[j] = static_cast<std::int32_t>(data.rims.size());
        data.rims.push_back({data.vertices[from], data.vertices[to], {face.region, other.region}});
      }
    }
  }
}

void make_faces(const TriangleMesh& mesh, Data& data) {
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
  find_rims(data, normals);
  boxes.clear();
  for (const ContactRim& rim : data.rims) boxes.push_back({rim.a.cwiseMin(rim.b), rim.a.cwiseMax(rim.b)});
  data.rim_tree = BoxTree(boxes);
  make_pieces(data);
}

/// Half the way to where the line leaves the body again, at most `longest`.
double line_length(const Data& data, std::size_t triangle, const Vec3& p, const Vec3& d, double longest) {
  double wall_m = 2.0 * longest;
  data.face_tree.visit_segment(p, p + wall_m * d, 2.0 * kEdgeWidth_m, [&](std::int32_t index) {
    if (index == static_cast<std::int32_t>(triangle)) return;
    const ContactFace& face = data.faces[static_cast<std::size_t>(index)];
    const ContactPatch& plane = data.patches[static_cast<std::size_t>(face.patch)];
    const double along = plane.normal.dot(d);
    if (!(along > 0.0)) return;
    const double t = (plane.offset_m - plane.normal.dot(p)) / along;
    if (t > 0.0 && t < wall_m && data.pierces(face, p, d, p + t * d)) wall_m = t;
  });
  return 0.5 * wall_m;
}

/// Halves the longest edge until none is longer than `edge_m`; a fixed order of corners gives fixed elements.
void divide(const TriangleCorners& corner, double edge_m, std::vector<TriangleCorners>& pieces) {
  std::vector<TriangleCorners> open{corner};
  while (!open.empty()) {
    const TriangleCorners piece = open.back();
    open.pop_back();
    double length_m = 0.0;
    const auto halves = halve_longest_edge(piece, length_m);
    if (edge_m <= 0.0 || length_m <= edge_m)
      pieces.push_back(piece);
    else
      open.insert(open.end(), halves.begin(), halves.end());
  }
}

[[noreturn]] void refuse_edge(double edge_m) {
  std::ostringstream text;
  text << "an element edge of " << edge_m << " m makes more than " << kMaxElements
       << " contact elements; choose a longer one";
  throw std::invalid_argument(text.str());
}

void make_elements(Data& data, const ContactSurfaceOptions& options) {
  std::vector<std::array<Vec3, 3>> pieces;
  // No piece is larger than the equilateral triangle.
  const double largest_piece_m2 = 0.4330127 * options.element_edge_m * options.element_edge_m;
  if (options.element_edge_m > 0.0 &&
      data.surface_area_m2 > largest_piece_m2 * static_cast<double>(kMaxElements))
    refuse_edge(options.element_edge_m);
  for (std::size_t i = 0; i < data.faces.size(); ++i) {
    const auto corner = data.corners(data.faces[i]);
    const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    pieces.clear();
    divide(corner, options.element_edge_m, pieces);
    if (data.element_count() + pieces.size() > kMaxElements) refuse_edge(options.element_edge_m);
    for (const auto& piece : pieces) {
      const Vec3 p = (piece[0] + piece[1] + piece[2]) / 3.0;
      const double area = 0.5 * (piece[1] - piece[0]).cross(piece[2] - piece[0]).norm();
      const double line = line_length(data, i, p, -normal, options.line_length_m);
      data.px.push_back(p.x()), data.py.push_back(p.y()), data.pz.push_back(p.z());
      data.nx.push_back(normal.x()), data.ny.push_back(normal.y()), data.nz.push_back(normal.z());
      data.area_m2.push_back(area);
      data.line_m.push_back(line);
      data.fade_m.push_back(0.5 * std::sqrt(area));
      data.triangle.push_back(static_cast<std::uint32_t>(i));
      data.largest_fade_m = std::max(data.largest_fade_m, data.fade_m.back());
    }
  }
  make_clusters(data);
}

}  // namespace

bool ContactSurface::Data::pierces(const ContactFace& face, const Vec3& p, const Vec3& d,
                                   const Vec3& x) const {
  std::array<double, 3> margin;
  for (std::size_t k = 0; k < 3; ++k) {
    margin[k] = face.inward[k].dot(x) + face.shift_m[k];
    if (!(margin[k] > -kEdgeWidth_m)) return false;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    if (margin[k] > kEdgeWidth_m) continue;
    const ContactFace& beyond = faces[static_cast<std::size_t>(face.neighbour[k])];
    if (beyond.patch == face.patch) continue;
    const double along = patches[static_cast<std::size_t>(face.patch)].normal.dot(d);
    if (along * patches[static_cast<std::size_t>(beyond.patch)].normal.dot(d) > 0.0) continue;
    // The line's moment about the edge, the same number for both faces but for its sign.
    const std::uint32_t from = face.vertex[k], to = face.vertex[(k + 1) % 3];
    const Vec3 a = vertices[std::min(from, to)] - p, b = vertices[std::max(from, to)] - p;
    const double moment = from < to ? d.dot(a.cross(b)) : -d.dot(a.cross(b));
    if (along > 0.0 ? moment < 0.0 : moment > 0.0) return false;
  }
  return true;
}

ContactSurface::ContactSurface(const TriangleMesh& mesh, const ContactSurfaceOptions& options)
    : data_(std::make_unique<Data>()) {
  const MeshCheck check = check_closed(mesh);
  if (!check.ok()) throw std::invalid_argument("a contact surface needs a closed mesh: " + check.problem);
  if (!(options.line_length_m > 0.0 && std::isfinite(options.line_length_m)))
    throw std::invalid_argument("line_length_m is " + std::to_string(options.line_length_m) +
                                "; it must be positive");
  if (!(options.element_edge_m >= 0.0 && std::isfinite(options.element_edge_m)))
    throw std::invalid_argument("element_edge_m is " + std::to_string(options.element_edge_m) +
                                "; it must be positive, or 0 for the triangles as they are");
  make_faces(mesh, *data_);
  make_elements(*data_, options);
}

ContactSurface::~ContactSurface() = default;

std::size_t ContactSurface::element_count() const {
  return data_->element_count();
}
std::size_t ContactSurface::face_count() const {
  return data_->faces.size();
}
double ContactSurface::area_m2() const {
  return data_->surface_area_m2;
}
const Aabb& ContactSurface::bounds_B() const {
  return data_->bounds;
}

}  // namespace takt
