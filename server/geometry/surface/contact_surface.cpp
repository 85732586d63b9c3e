#include "server/geometry/surface/contact_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string>

#include "idl/common/text.h"
#include "server/geometry/surface/clusters.h"
#include "server/geometry/surface/contact_surface_data.h"
#include "server/geometry/surface/element_corners.h"
#include "server/geometry/surface/resampling.h"

namespace takt {
namespace {

using Data = ContactSurface::Data;

/// Beyond any practical computation; a wrong edge length must not fill the memory.
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
  find_vertex_normals(data);
  find_sharp_edges(data);
  if (data.curved()) data.octree = FaceOctree(data);
  make_pieces(data);
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

[[noreturn]] void refuse_edge(const Data& data, double edge_m) {
  const Vec3 size = 2.0 * data.box.half_B;
  std::ostringstream text;
  text << "an element edge of " << edge_m << " m makes more than " << kMaxElements
       << " contact elements of a mesh of " << size.x() << " x " << size.y() << " x " << size.z()
       << " m; choose a longer one (element_edge_m), or, of a file in millimetres, mesh_scale: 0.001";
  throw std::invalid_argument(text.str());
}

void add_element(Data& data, const Vec3& p, const Vec3& normal, double area_m2, std::uint32_t face) {
  data.px.push_back(p.x()), data.py.push_back(p.y()), data.pz.push_back(p.z());
  data.nx.push_back(normal.x()), data.ny.push_back(normal.y()), data.nz.push_back(normal.z());
  data.area_m2.push_back(area_m2);
  data.triangle.push_back(face);
}

/// Pieces of the triangles, as elements, by face.
struct Pieces {
  std::vector<std::uint32_t> first;  ///< element of each face, and their number
  std::vector<double> slender_m2;    ///< area of each face in slender pieces, where it is measured
};

/// Halving the longest edge leaves a needle about as slender as it is wide against the edge.
Pieces divide_triangles(Data& data, double edge_m, bool measures) {
  Pieces result;
  if (measures) result.slender_m2.assign(data.faces.size(), 0.0);
  std::vector<TriangleCorners> pieces;
  for (std::size_t i = 0; i < data.faces.size(); ++i) {
    const auto corner = data.corners(data.faces[i]);
    const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    pieces.clear();
    divide(corner, edge_m, pieces);
    if (data.element_count() + pieces.size() > kMaxElements) refuse_edge(data, edge_m);
    const bool may_be_slender =
        measures && slenderness(corner) > 0.25 * kSlender;  // a half is at most twice as slender
    result.first.push_back(static_cast<std::uint32_t>(data.element_count()));
    for (const auto& piece : pieces) {
      const double area = 0.5 * (piece[1] - piece[0]).cross(piece[2] - piece[0]).norm();
      if (may_be_slender && slenderness(piece) > kSlender) result.slender_m2[i] += area;
      add_element(data, (piece[0] + piece[1] + piece[2]) / 3.0, normal, area, static_cast<std::uint32_t>(i));
    }
  }
  result.first.push_back(static_cast<std::uint32_t>(data.element_count()));
  return result;
}

double slender_area_m2(const std::vector<SurfaceSample>& samples) {
  double sum = 0.0;
  for (const SurfaceSample& sample : samples)
    if (sample.slenderness > kSlender) sum += sample.area_m2;
  return sum;
}

/// Whether the needles of a region lie side by side: they resolve the direction across them more finely than any cells
/// of as large an area, as where the edge of another body lies along them.
bool are_parallel(const Data& data, const Pieces& pieces, const FlatRegion& region) {
  constexpr double kParallel = 0.9;  // mean square of the cosine to their main direction; 0.5 of a fan
  Mat3 sum = Mat3::Zero();
  for (const std::int32_t f : region.faces) {
    const double slender_m2 = pieces.slender_m2[static_cast<std::size_t>(f)];
    if (!(slender_m2 > 0.0)) continue;
    const auto corner = data.corners(data.faces[static_cast<std::size_t>(f)]);
    Vec3 along = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 edge = corner[(k + 1) % 3] - corner[k];
      if (edge.squaredNorm() > along.squaredNorm()) along = edge;
    }
    sum += slender_m2 / along.squaredNorm() * along * along.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(sum, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[2] > kParallel * sum.trace();
}

/// The elements of a region on a grid, or empty where that is no better than the pieces of its triangles. `spacing_m`:
/// the most on entry, the one chosen on return.
std::vector<SurfaceSample> sample_needles(const Data& data, const Pieces& pieces, const FlatRegions& flat,
                                          std::size_t region, double& spacing_m) {
  constexpr double kFiner = 0.9;
  double area_m2 = 0.0, slender_m2 = 0.0;
  std::size_t least = 0;
  for (const std::int32_t f : flat.regions[region].faces) {
    const auto i = static_cast<std::size_t>(f);
    slender_m2 += pieces.slender_m2[i];
    least += pieces.first[i + 1] - pieces.first[i];
    for (std::uint32_t e = pieces.first[i]; e < pieces.first[i + 1]; ++e) area_m2 += data.area_m2[e];
  }
  if (!(slender_m2 >= kSlenderShare * area_m2) || !(area_m2 > 0.0)) return {};
  if (are_parallel(data, pieces, flat.regions[region])) return {};
  std::vector<SurfaceSample> samples = sample_region(data, flat, region, spacing_m);
  // Cells of a strip that is narrow itself are as slender.
  if (!(slender_m2 - slender_area_m2(samples) >= kSlenderShare * area_m2)) return {};
  while (samples.size() < least) {
    spacing_m = std::min(kFiner * spacing_m, std::sqrt(area_m2 / static_cast<double>(least)));
    samples = sample_region(data, flat, region, spacing_m);
  }
  return samples;
}

/// Replaces the elements of the flat regions that a sampler divides: `sample` gives their samples, or none where the
/// pieces of the triangles stay. `least_gain`: share of the surface that must be rid of slender elements.
template <class Sample>
void replace_elements(Data& data, const Pieces& pieces, double edge_m, double least_gain,
                      const Sample& sample) {
  const FlatRegions flat = find_flat_regions(data);
  ResamplingReport report;
  report.elements_before = data.element_count();
  std::vector<char> stays(data.faces.size(), 1);
  std::vector<std::vector<SurfaceSample>> made(flat.regions.size());
  std::size_t count = 0;
  for (std::size_t region = 0; region < made.size(); ++region) {
    double spacing_m = 0.5 * edge_m;
    made[region] = sample(flat, region, spacing_m);
    report.slender_share += slender_area_m2(made[region]) / data.surface_area_m2;
    count += made[region].size();
    if (count > kMaxElements) refuse_edge(data, edge_m);
    if (made[region].empty()) continue;
    report.spacing_m = std::max(report.spacing_m, spacing_m);
    for (const std::int32_t f : flat.regions[region].faces) stays[static_cast<std::size_t>(f)] = 0;
  }
  for (std::size_t i = 0; i < data.faces.size(); ++i) {
    report.slender_share_before += pieces.slender_m2[i] / data.surface_area_m2;
    if (stays[i] != 0) report.slender_share += pieces.slender_m2[i] / data.surface_area_m2;
  }
  if (count == 0 || report.slender_share_before - report.slender_share < least_gain) return;

  std::size_t kept = 0;
  for (std::size_t i = 0; i < data.faces.size(); ++i) {
    if (stays[i] == 0) continue;
    for (std::uint32_t e = pieces.first[i]; e < pieces.first[i + 1]; ++e, ++kept) {
      for (auto* values : {&data.px, &data.py, &data.pz, &data.nx, &data.ny, &data.nz, &data.area_m2})
        (*values)[kept] = (*values)[e];
      data.triangle[kept] = data.triangle[e];
    }
  }
  for (auto* values : {&data.px, &data.py, &data.pz, &data.nx, &data.ny, &data.nz, &data.area_m2})
    values->resize(kept);
  data.triangle.resize(kept);
  data.outlines.resize(kept);
  for (std::size_t region = 0; region < made.size(); ++region) {
    for (const SurfaceSample& cell : made[region]) {
      add_element(data, cell.point, flat.regions[region].normal, cell.area_m2, cell.face);
      const auto begin = static_cast<std::uint32_t>(data.outline_points.size());
      data.outline_points.insert(data.outline_points.end(), cell.outline.begin(), cell.outline.end());
      data.outlines.push_back({begin, static_cast<std::uint32_t>(data.outline_points.size())});
    }
  }
  report.elements = data.element_count();
  data.resampling = report;
}

void make_elements(Data& data, const ContactSurfaceOptions& options, double default_edge_m) {
  // No piece is larger than the equilateral triangle.
  const double largest_piece_m2 = 0.4330127 * options.element_edge_m * options.element_edge_m;
  if (options.element_edge_m > 0.0 &&
      data.surface_area_m2 > largest_piece_m2 * static_cast<double>(kMaxElements))
    refuse_edge(data, options.element_edge_m);
  const bool always = options.resampling == ContactResampling::always;
  // The triangles that a user asks for are not resampled unless that is asked for as well.
  const bool may_resample =
      always || (options.resampling == ContactResampling::automatic && options.element_edge_m > 0.0);
  const Pieces pieces = divide_triangles(data, options.element_edge_m, may_resample);
  const double edge_m = options.element_edge_m > 0.0 ? options.element_edge_m : default_edge_m;
  const auto has_needles = [&] {
    return std::any_of(pieces.slender_m2.begin(), pieces.slender_m2.end(),
                       [](double m2) { return m2 > 0.0; });
  };
  if (always)
    replace_elements(data, pieces, edge_m, -INFINITY,
                     [&data](const FlatRegions& flat, std::size_t region, double& spacing_m) {
                       return sample_region(data, flat, region, spacing_m);
                     });
  else if (may_resample && has_needles())
    replace_elements(data, pieces, edge_m, kLeastGain,
                     [&](const FlatRegions& flat, std::size_t region, double& spacing_m) {
                       return sample_needles(data, pieces, flat, region, spacing_m);
                     });
  make_clusters(data);
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

ContactSurface::ContactSurface(const TriangleMesh& mesh, const ContactSurfaceOptions& options)
    : data_(std::make_unique<Data>()) {
  const MeshCheck check = check_closed(mesh);
  if (!check.ok()) throw std::invalid_argument("a contact surface needs a closed mesh: " + check.problem);
  if (!(options.element_edge_m >= 0.0 && std::isfinite(options.element_edge_m)))
    throw std::invalid_argument("element_edge_m is " + std::to_string(options.element_edge_m) +
                                "; it must be positive, or 0 for the triangles as they are");
  make_faces(mesh, *data_);
  make_elements(*data_, options, default_element_edge_m(mesh));
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
