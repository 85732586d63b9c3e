#include "plant_models/robot/joint_path.h"

#include <algorithm>
#include <limits>

namespace takt {

namespace {

using Bernstein = std::array<double, 6>;

Bernstein bernstein(const std::array<double, 6>& c) {
  // b_i = sum over k <= i of C(i, k) / C(5, k) c_k
  constexpr std::array<std::array<double, 6>, 6> binomial{{{1, 0, 0, 0, 0, 0},
                                                           {1, 1, 0, 0, 0, 0},
                                                           {1, 2, 1, 0, 0, 0},
                                                           {1, 3, 3, 1, 0, 0},
                                                           {1, 4, 6, 4, 1, 0},
                                                           {1, 5, 10, 10, 5, 1}}};
  Bernstein b{};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = 0; k <= i; ++k) b[i] += binomial[i][k] / binomial[5][k] * c[k];
  }
  return b;
}

double search(const Bernstein& b, double lower, double upper, int depth) {
  const auto [least, most] = std::minmax_element(b.begin(), b.end());
  if (*least >= lower && *most <= upper) return std::numeric_limits<double>::quiet_NaN();
  for (const double end : {b.front(), b.back()})
    if (!(end >= lower && end <= upper)) return end;
  if (depth == 0) return *least < lower ? *least : *most;
  Bernstein left{}, right = b;
  for (std::size_t i = 0; i < 6; ++i) {  // de Casteljau at u = 1/2
    left[i] = right[0];
    for (std::size_t k = 0; k + 1 < 6 - i; ++k) right[k] = 0.5 * (right[k] + right[k + 1]);
  }
  const double found = search(left, lower, upper, depth - 1);
  return found == found ? found : search(right, lower, upper, depth - 1);
}

}  // namespace

double PathPiece::position(double u) const {
  return c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * (c[4] + u * c[5]))));
}

double PathPiece::velocity(double u) const {
  return (c[1] + u * (2.0 * c[2] + u * (3.0 * c[3] + u * (4.0 * c[4] + u * 5.0 * c[5])))) / duration_s;
}

PathPiece PathPiece::derivative() const {
  PathPiece result;
  result.duration_s = duration_s;
  for (std::size_t k = 1; k < 6; ++k) result.c[k - 1] = static_cast<double>(k) * c[k] / duration_s;
  return result;
}

PathPiece path_piece(PathOrder order, const JointPathPoint& from, const JointPathPoint& to,
                     std::size_t joint) {
  PathPiece piece;
  const double T = piece.duration_s = to.t - from.t;
  const double D = to.q[joint] - from.q[joint];
  const double v0 = T * from.qd[joint], v1 = T * to.qd[joint];
  const double a0 = T * T * from.qdd[joint], a1 = T * T * to.qdd[joint];
  piece.c[0] = from.q[joint];
  switch (order) {
    case PathOrder::linear:
      piece.c[1] = D;
      break;
    case PathOrder::cubic:
      piece.c[1] = v0;
      piece.c[2] = 3.0 * D - 2.0 * v0 - v1;
      piece.c[3] = -2.0 * D + v0 + v1;
      break;
    case PathOrder::quintic:
      piece.c[1] = v0;
      piece.c[2] = 0.5 * a0;
      piece.c[3] = 10.0 * D - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
      piece.c[4] = -15.0 * D + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
      piece.c[5] = 6.0 * D - 3.0 * (v0 + v1) - 0.5 * (a0 - a1);
      break;
  }
  return piece;
}

double value_outside(const PathPiece& piece, double lower, double upper) {
  // 2^-24 of a piece: the gap between enclosure and curve is then below rounding.
  constexpr int kDepth = 24;
  return search(bernstein(piece.c), lower, upper, kDepth);
}

}  // namespace takt
