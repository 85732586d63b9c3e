#include "server/geometry/surface/surface_elements.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "server/geometry/surface/element_corners.h"
#include "server/geometry/surface/resampling.h"
#include "server/geometry/surface/rim_strips.h"

namespace takt {
namespace {

using Data = ContactSurface::Data;

/// Beyond any practical computation; a wrong edge length must not fill the memory.
constexpr std::size_t kMaxElements = 5'000'000;

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
  std::vector<std::uint32_t> first;   ///< element of each face, and their number
  std::vector<double> slender_m2;     ///< area of each face in slender pieces, where it is measured
  std::vector<std::uint32_t> strips;  ///< elements of each face more than without strips along rims

  /// Without those of strips.
  std::size_t count(std::size_t face) const { return first[face + 1] - first[face] - strips[face]; }
};

/// Halving the longest edge leaves a needle about as slender as it is wide against the edge.
/// Along rims of flat faces they are strips, unless the elements are the triangles themselves.
Pieces divide_triangles(Data& data, double edge_m, bool measures) {
  Pieces result;
  if (measures) result.slender_m2.assign(data.faces.size(), 0.0);
  std::vector<TriangleCorners> pieces;
  std::vector<std::vector<Vec3>> parts;
  const auto add_parts = [&](std::uint32_t face, const Vec3& normal) {
    data.outlines.resize(data.element_count());
    for (const std::vector<Vec3>& part : parts) {
      Vec3 centroid;
      const double area = area_and_centroid(part, centroid);
      add_element(data, centroid, normal, area, face);
      const auto begin = static_cast<std::uint32_t>(data.outline_points.size());
      data.outline_points.insert(data.outline_points.end(), part.begin(), part.end());
      data.outlines.push_back({begin, static_cast<std::uint32_t>(data.outline_points.size())});
    }
    result.strips.back() += static_cast<std::uint32_t>(parts.size() - 1);
    data.strip_count += parts.size() - 1;
  };
  for (std::size_t i = 0; i < data.faces.size(); ++i) {
    const auto corner = data.corners(data.faces[i]);
    const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    pieces.clear();
    divide(corner, edge_m, pieces);
    if (data.element_count() + pieces.size() > kMaxElements) refuse_edge(data, edge_m);
    const bool may_be_slender =
        measures && slenderness(corner) > 0.25 * kSlender;  // a half is at most twice as slender
    result.first.push_back(static_cast<std::uint32_t>(data.element_count()));
    result.strips.push_back(0);
    const RimStrips rims(data, i, edge_m);
    for (const auto& piece : pieces) {
      const double area = 0.5 * (piece[1] - piece[0]).cross(piece[2] - piece[0]).norm();
      if (may_be_slender && slenderness(piece) > kSlender) result.slender_m2[i] += area;
      parts.clear();
      rims.divide(piece, parts);
      if (parts.empty())
        add_element(data, (piece[0] + piece[1] + piece[2]) / 3.0, normal, area,
                    static_cast<std::uint32_t>(i));
      else
        add_parts(static_cast<std::uint32_t>(i), normal);
    }
  }
  result.first.push_back(static_cast<std::uint32_t>(data.element_count()));
  if (!data.outlines.empty()) data.outlines.resize(data.element_count());
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

/// A flat has enough elements with this many along the edge of a square of its area, and across a strip of its area and
/// perimeter. Pieces of triangles are too many where they are this many times as many.
constexpr double kEnoughAlong = 32.0, kEnoughAcross = 8.0, kTooMany = 4.0;
constexpr auto kFewestTooMany = static_cast<std::size_t>(kTooMany * kEnoughAlong * kEnoughAlong);

/// The elements of a region with far more triangles than its shape needs, on a grid; empty elsewhere. `spacing_m`: the
/// most on entry, the one chosen on return.
std::vector<SurfaceSample> sample_dense(const Data& data, const Pieces& pieces, const FlatRegions& flat,
                                        std::size_t region, double& spacing_m) {
  std::size_t count = 0;
  const auto& faces = flat.regions[region].faces;
  for (const std::int32_t f : faces) {
    count += pieces.count(static_cast<std::size_t>(f));
  }
  if (count < kFewestTooMany) return {};
  double area_m2 = 0.0, rim_m = 0.0;
  for (const std::int32_t f : faces) {
    const auto i = static_cast<std::size_t>(f);
    for (std::uint32_t e = pieces.first[i]; e < pieces.first[i + 1]; ++e) area_m2 += data.area_m2[e];
    const auto corner = data.corners(data.faces[i]);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto beyond = static_cast<std::size_t>(data.faces[i].neighbour[k]);
      if (flat.of_face[beyond] != static_cast<std::int32_t>(region))
        rim_m += (corner[(k + 1) % 3] - corner[k]).norm();
    }
  }
  if (!(area_m2 > 0.0)) return {};
  const double enough_m = std::min(std::sqrt(area_m2) / kEnoughAlong, 2.0 * area_m2 / rim_m / kEnoughAcross);
  spacing_m = std::min(spacing_m, enough_m);
  if (area_m2 > spacing_m * spacing_m * static_cast<double>(count) / kTooMany) return {};
  return sample_region(data, flat, region, spacing_m, Rims::plain);
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
  std::vector<SurfaceSample> samples = sample_region(data, flat, region, spacing_m, Rims::strips);
  // Cells of a strip that is narrow itself are as slender.
  if (!(slender_m2 - slender_area_m2(samples) >= kSlenderShare * area_m2)) return {};
  while (samples.size() < least) {
    spacing_m = std::min(kFiner * spacing_m, std::sqrt(area_m2 / static_cast<double>(least)));
    samples = sample_region(data, flat, region, spacing_m, Rims::strips);
  }
  return samples;
}

/// Samples of the flat regions; none where the pieces of the triangles stay.
struct Resampled {
  FlatRegions flat;
  std::vector<std::vector<SurfaceSample>> made;  ///< by region
  std::vector<double> spacing_m;
  std::size_t count = 0;

  explicit Resampled(const Data& data) : flat(find_flat_regions(data)), made(flat.regions.size()) {}
  /// `sample` divides a region that has no samples yet.
  template <class Sample>
  void add(const Data& data, double edge_m, const Sample& sample) {
    spacing_m.resize(made.size(), 0.0);
    for (std::size_t region = 0; region < made.size(); ++region) {
      if (!made[region].empty()) continue;
      spacing_m[region] = 0.5 * edge_m;
      made[region] = sample(flat, region, spacing_m[region]);
      count += made[region].size();
      if (count > kMaxElements) refuse_edge(data, edge_m);
    }
  }
  double slender_m2(const Pieces& pieces, std::size_t region) const {
    double sum = 0.0;
    for (const std::int32_t f : flat.regions[region].faces)
      sum += pieces.slender_m2[static_cast<std::size_t>(f)];
    return sum;
  }
};

/// In flats of far too many triangles, and in those of needles if that rids a share of the surface of slender elements.
Resampled resample_where_needed(const Data& data, const Pieces& pieces, double edge_m) {
  Resampled dense(data);
  dense.add(data, edge_m, [&](const FlatRegions& flat, std::size_t region, double& spacing_m) {
    return sample_dense(data, pieces, flat, region, spacing_m);
  });
  Resampled all = dense;
  all.add(data, edge_m, [&](const FlatRegions& flat, std::size_t region, double& spacing_m) {
    return sample_needles(data, pieces, flat, region, spacing_m);
  });
  double gain_m2 = 0.0;
  for (std::size_t region = 0; region < all.made.size(); ++region)
    if (dense.made[region].empty() && !all.made[region].empty())
      gain_m2 += all.slender_m2(pieces, region) - slender_area_m2(all.made[region]);
  return gain_m2 < kLeastGain * data.surface_area_m2 ? dense : all;
}

void replace_elements(Data& data, const Pieces& pieces, const Resampled& by) {
  if (by.count == 0) return;
  const auto& [flat, made, spacing_m, count] = by;
  ResamplingReport report;
  report.elements_before = data.element_count();
  std::vector<char> stays(data.faces.size(), 1);
  for (std::size_t region = 0; region < made.size(); ++region) {
    const double before_m2 = by.slender_m2(pieces, region);
    report.slender_share_before += before_m2 / data.surface_area_m2;
    report.slender_share +=
        (made[region].empty() ? before_m2 : slender_area_m2(made[region])) / data.surface_area_m2;
    if (made[region].empty()) continue;
    report.spacing_m = std::max(report.spacing_m, spacing_m[region]);
    for (const std::int32_t f : flat.regions[region].faces) stays[static_cast<std::size_t>(f)] = 0;
  }

  std::size_t kept = 0;
  data.strip_count = 0;
  for (std::size_t i = 0; i < data.faces.size(); ++i) {
    if (stays[i] == 0) continue;
    data.strip_count += pieces.strips[i];
    for (std::uint32_t e = pieces.first[i]; e < pieces.first[i + 1]; ++e, ++kept) {
      for (auto* values : {&data.px, &data.py, &data.pz, &data.nx, &data.ny, &data.nz, &data.area_m2})
        (*values)[kept] = (*values)[e];
      data.triangle[kept] = data.triangle[e];
      if (!data.outlines.empty()) data.outlines[kept] = data.outlines[e];
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
      if (cell.is_strip) ++data.strip_count;
    }
  }
  report.elements = data.element_count();
  data.resampling = report;
}

}  // namespace

void make_elements(ContactSurface::Data& data, const ContactSurfaceOptions& options, double default_edge_m) {
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
  if (always) {
    Resampled all(data);
    all.add(data, edge_m, [&data](const FlatRegions& flat, std::size_t region, double& spacing_m) {
      return sample_region(data, flat, region, spacing_m, Rims::strips);
    });
    replace_elements(data, pieces, all);
  } else if (may_resample && (has_needles() || data.element_count() >= kFewestTooMany)) {
    replace_elements(data, pieces, resample_where_needed(data, pieces, edge_m));
  }
}

}  // namespace takt
