#include "server/simulation/solver/dense_lu.h"

#include <cmath>
#include <utility>

namespace takt {

bool factorise_dense(double* a, std::size_t n, int* pivots) {
  for (std::size_t k = 0; k < n; ++k) {
    double* column = a + k * n;
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (std::abs(column[i]) > std::abs(column[pivot])) pivot = i;
    if (!(std::abs(column[pivot]) > 0.0) || !std::isfinite(column[pivot])) return false;
    pivots[k] = static_cast<int>(pivot);
    if (pivot != k)
      for (std::size_t j = 0; j < n; ++j) std::swap(a[j * n + k], a[j * n + pivot]);
    const double inverse = 1.0 / column[k];
    for (std::size_t i = k + 1; i < n; ++i) column[i] *= inverse;
    for (std::size_t j = k + 1; j < n; ++j) {
      double* other = a + j * n;
      const double factor = other[k];
      if (factor == 0.0) continue;
      for (std::size_t i = k + 1; i < n; ++i) other[i] -= factor * column[i];
    }
  }
  return true;
}

void solve_dense(const double* a, std::size_t n, const int* pivots, double* b) {
  for (std::size_t k = 0; k < n; ++k) std::swap(b[k], b[static_cast<std::size_t>(pivots[k])]);
  for (std::size_t k = 0; k < n; ++k) {
    if (b[k] == 0.0) continue;
    for (std::size_t i = k + 1; i < n; ++i) b[i] -= a[k * n + i] * b[k];
  }
  for (std::size_t k = n; k-- > 0;) {
    b[k] /= a[k * n + k];
    for (std::size_t i = 0; i < k; ++i) b[i] -= a[k * n + i] * b[k];
  }
}

}  // namespace takt
