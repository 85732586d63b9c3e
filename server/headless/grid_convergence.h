#pragma once
// Convergence of a number under refinement: observed order, Richardson extrapolation and Roache's grid convergence index
// (Roache 1998; Celik et al. 2008; safety factors of Oberkampf and Roy 2010, 8.7). The model is f(h) = f0 + C h^p.
#include <optional>
#include <vector>

namespace takt {

/// A result at one resolution. `size` is the size of the step, tolerance or element, > 0.
struct GridPoint {
  double size = 0.0, value = 0.0;
};

enum class GridState {
  monotone,       ///< the differences shrink with one sign: order and index exist
  oscillatory,    ///< the differences have opposite signs
  diverging,      ///< the differences do not shrink as a positive order demands
  no_difference,  ///< two neighbours agree to rounding: the series has no order
};
const char* to_string(GridState state);

struct GridConvergence {
  GridState state = GridState::no_difference;
  // Of the three finest points, in state `monotone` alone:
  double order = 0.0;         ///< observed
  double extrapolated = 0.0;  ///< Richardson, with the observed order
  double index_order = 0.0;   ///< used by the index
  double safety_factor = 0.0;
  double index = 0.0;  ///< absolute grid convergence index of the finest point, in the unit of the value
  bool asymptotic =
      false;  ///< the observed order agrees with the formal one, or with that of the next coarser three
  /// Observed orders of all neighbouring threes, the finest first; absent where the three is not monotone.
  std::vector<std::optional<double>> orders;
};

/// Largest relative deviation of an order in the asymptotic range.
inline constexpr double kOrderAgreement = 0.1;
inline constexpr double kSafetyAsymptotic = 1.25, kSafetyElse = 3.0;
/// The index of a series outside of the asymptotic range has at least this order.
inline constexpr double kLeastIndexOrder = 0.5;

/// Of at least three points with different sizes, in any order. In the asymptotic range the safety factor is 1.25, else 3
/// with the order min(max(0.5, observed), formal). Throws std::invalid_argument.
GridConvergence grid_convergence(std::vector<GridPoint> points, std::optional<double> formal_order);

/// Observed order of the errors of two points against an exact value: ln(e_coarse / e_fine) / ln(h_coarse / h_fine).
/// Absent where an error is zero to rounding.
std::optional<double> error_order(const GridPoint& fine, const GridPoint& coarse, double exact);

}  // namespace takt
