#pragma once
// LU factorisation of small dense blocks with partial pivoting, in place in the caller's memory.
#include <cstddef>

namespace takt {

/// `a`: n x n, column-major; `pivots`: n row exchanges. False if a pivot is zero or not finite.
bool factorise_dense(double* a, std::size_t n, int* pivots);
/// Solves in place with the result of factorise_dense().
void solve_dense(const double* a, std::size_t n, const int* pivots, double* b);

}  // namespace takt
