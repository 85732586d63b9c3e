#include "server/headless/grid_convergence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace takt {

namespace {

constexpr double kMostOrder = 30.0;

/// Whether a difference of two values is rounding.
bool is_rounding(double difference, double a, double b) {
  return std::abs(difference) <=
         64.0 * std::numeric_limits<double>::epsilon() * std::max(std::abs(a), std::abs(b));
}

struct Three {
  GridState state = GridState::no_difference;
  double order = 0.0;
};

/// (f3 - f2) / (f2 - f1) of f = C h^p; grows with p.
double difference_ratio(double r21, double r32, double p) {
  const double a = p * std::log(r21), b = p * std::log(r32);
  return std::exp(a) * std::expm1(b) / std::expm1(a);
}

Three observed(const GridPoint& fine, const GridPoint& middle, const GridPoint& coarse) {
  const double e21 = middle.value - fine.value, e32 = coarse.value - middle.value;
  if (is_rounding(e21, middle.value, fine.value) || is_rounding(e32, coarse.value, middle.value))
    return {GridState::no_difference, 0.0};
  if ((e21 > 0.0) != (e32 > 0.0)) return {GridState::oscillatory, 0.0};
  const double r21 = middle.size / fine.size, r32 = coarse.size / middle.size;
  const double ratio = e32 / e21;
  if (ratio <= std::log(r32) / std::log(r21)) return {GridState::diverging, 0.0};
  double lower = 0.0, upper = kMostOrder;
  if (difference_ratio(r21, r32, upper) < ratio) return {GridState::monotone, upper};
  for (double p = 0.5 * (lower + upper); p > lower && p < upper; p = 0.5 * (lower + upper))
    (difference_ratio(r21, r32, p) < ratio ? lower : upper) = p;
  return {GridState::monotone, upper};
}

bool agrees(double order, double expected) {
  return std::abs(order - expected) <= kOrderAgreement * expected;
}

}  // namespace

const char* to_string(GridState state) {
  switch (state) {
    case GridState::monotone:
      return "monotone";
    case GridState::oscillatory:
      return "oscillatory";
    case GridState::diverging:
      return "diverging";
    case GridState::no_difference:
      break;
  }
  return "no_difference";
}

GridConvergence grid_convergence(std::vector<GridPoint> points, std::optional<double> formal_order) {
  if (points.size() < 3) throw std::invalid_argument("a grid convergence needs three resolutions");
  std::sort(points.begin(), points.end(),
            [](const GridPoint& a, const GridPoint& b) { return a.size < b.size; });
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!(points[i].size > 0.0) || (i > 0 && !(points[i].size > points[i - 1].size)))
      throw std::invalid_argument("the sizes of resolutions are positive and different");
  GridConvergence result;
  for (std::size_t i = 0; i + 2 < points.size(); ++i) {
    const Three three = observed(points[i], points[i + 1], points[i + 2]);
    const bool monotone = three.state == GridState::monotone;
    result.orders.push_back(monotone ? std::optional(three.order) : std::nullopt);
    if (i == 0) result.state = three.state, result.order = three.order;
  }
  if (result.state != GridState::monotone) return result;
  const double r = points[1].size / points[0].size, difference = points[0].value - points[1].value;
  result.extrapolated = points[0].value + difference / (std::pow(r, result.order) - 1.0);
  if (formal_order)
    result.asymptotic = agrees(result.order, *formal_order);
  else
    result.asymptotic =
        result.orders.size() > 1 && result.orders[1] && agrees(*result.orders[1], result.order);
  result.safety_factor = result.asymptotic ? kSafetyAsymptotic : kSafetyElse;
  if (result.asymptotic)
    result.index_order = formal_order.value_or(result.order);
  else
    result.index_order =
        std::min(std::max(kLeastIndexOrder, result.order), formal_order.value_or(result.order));
  result.index = result.safety_factor * std::abs(difference) / (std::pow(r, result.index_order) - 1.0);
  return result;
}

std::optional<double> error_order(const GridPoint& fine, const GridPoint& coarse, double exact) {
  const double e_fine = fine.value - exact, e_coarse = coarse.value - exact;
  if (is_rounding(e_fine, fine.value, exact) || is_rounding(e_coarse, coarse.value, exact)) return {};
  return std::log(std::abs(e_coarse / e_fine)) / std::log(coarse.size / fine.size);
}

}  // namespace takt
