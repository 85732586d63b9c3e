#pragma once
// Signed distance of a closed surface on a regular grid, made once per mesh: a depth with a continuous gradient at a
// bounded cost per point, whatever the triangles are.
//
// The field is a quadratic B-spline in each coordinate over nodes of a spacing h. Its coefficients are those of the
// quasi-interpolant c = d - (d_- - 2 d + d_+) / 8 per axis (de Boor, Fix: Spline approximation by quasiinterpolants, J.
// Approximation Theory 8, 1973): polynomials up to degree 2 are exact, the error of smooth surfaces falls with h^3, and the
// gradient is continuous. d is the exact signed distance at the nodes. At edges and corners of the surface the second
// difference is left out: they are rounded over about h, and do not stand out.
//
// Coefficients are kept in blocks of 4^3 nodes around the surface and a band below it. Deeper points take the exact
// distance, by a search of the nearest face. Everything is in the frame of the body.
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "plant_models/spatial.h"
#include "server/geometry/surface/contact_surface.h"

namespace takt {

/// Spacing that suits a surface: an eighth of its walls, at most 1/64 of its diagonal, and no finer than a field of some
/// 25 MB.
double default_field_spacing_m(const ContactSurface& surface);

class DistanceField {
 public:
  struct Depth {
    double depth_m = 0.0;
    Vec3 gradient = Vec3::Zero();  ///< of the depth, into the body; about of length 1
  };
  /// What the field costs and how exact it is, against the exact distance at random points below the surface, by at most
  /// two spacings. Same surface, same numbers.
  struct Report {
    double spacing_m = 0.0;
    std::size_t blocks = 0, bytes = 0;
    double mean_error_m = 0.0, largest_error_m = 0.0;
    Vec3 largest_at = Vec3::Zero();
    /// False: walls are thinner than four spacings, or the mean error is more than a thirtieth of a spacing.
    bool resolves = false;
  };

  /// Throws std::invalid_argument for a spacing that is not positive, or would make more than 4 million blocks.
  DistanceField(std::shared_ptr<const ContactSurface> surface, double spacing_m);

  /// Depth of a point; false if it is outside. Points beside the bounds of the surface are outside.
  bool find(const Vec3& x, Depth& depth) const;
  /// Second derivatives of the depth (1/m); zero where the exact distance serves.
  Mat3 curvature(const Vec3& x) const;
  /// Lower bound of the signed distance of x (m).
  double at_least_m(const Vec3& x) const;
  const Report& report() const { return report_; }
  double spacing_m() const { return spacing_m_; }

 private:
  class Builder;
  static constexpr std::int32_t kNodes = 4, kStored = kNodes + 2;
  static constexpr std::int32_t kOutside = -1, kDeep = -2;
  using Block = std::array<float, static_cast<std::size_t>(kStored) * kStored * kStored>;
  using Index = std::array<std::int32_t, 3>;

  std::size_t place(const Index& block) const {
    return (static_cast<std::size_t>(block[0]) * static_cast<std::size_t>(count_[1]) +
            static_cast<std::size_t>(block[1])) *
               static_cast<std::size_t>(count_[2]) +
           static_cast<std::size_t>(block[2]);
  }
  Vec3 center(const Index& block) const;
  /// The block that has the node next to x; false beside the grid. `at`: place of that node in the block, `beside`: of x
  /// from the node, in spacings.
  bool locate(const Vec3& x, Index& block, Index& at, Vec3& beside) const;
  void measure();

  std::shared_ptr<const ContactSurface> surface_;
  double spacing_m_, over_m_, band_m_ = 0.0;
  Vec3 lower_ = Vec3::Zero();        ///< node 0
  Index count_{};                    ///< blocks along each axis
  std::vector<std::int32_t> index_;  ///< by block: place in `blocks_`, or one of the constants
  std::vector<float> clear_m_;       ///< by block: lower bound of the signed distance of its centre
  std::vector<Block> blocks_;
  Report report_;
};

}  // namespace takt
