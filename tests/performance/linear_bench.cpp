// The linear system at velocity level: time per linearisation, factorisation and solution in the block cell
// at LoD 2, with the Parts held one by one and with everything in one group (substitute forces between all
// Parts that touch). And dense LU alone, by size.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <random>

#include "server/simulation/solver/dense_lu.h"
#include "server/simulation/solver/velocity_system.h"
#include "tests/support/block_plant.h"

namespace takt {
namespace {

double median_us(const std::function<void()>& run) {
  constexpr int kRounds = 41, kTimes = 200;
  std::vector<double> times;
  for (int round = 0; round < kRounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < kTimes; ++i) run();
    const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - start;
    times.push_back(time.count() / kTimes);
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

void bench_cell(const char* name, test::BlockPlant&& cell) {
  OdeSystem& system = cell.system();
  VelocitySystem linear(system);
  std::vector<double> f(cell.x().size()), r(f.size());
  system.derivatives(0.0, cell.x(), f);
  linear.linearise(system, 0.0, cell.x(), Linearisation::secant);
  bool good = linear.factorise(1e3, 1.0);
  std::printf("%s: %zu groups, largest %zu velocities, %zu pairs, %zu states\n", name, linear.group_count(),
              linear.largest_group(), linear.pairs().size(), f.size());
  std::printf("  derivatives            %7.2f us\n",
              median_us([&] { system.derivatives(0.0, cell.x(), f); }));
  std::printf("  linearise              %7.2f us\n",
              median_us([&] { linear.linearise(system, 0.0, cell.x(), Linearisation::secant); }));
  std::printf("  factorise              %7.2f us\n",
              median_us([&] { good = linear.factorise(1e3, 1.0) && good; }));
  std::printf("  solve                  %7.2f us\n", median_us([&] {
                r = f;
                linear.solve(r);
              }));
  if (!good) std::printf("  NOT FACTORISED\n");
}

void bench_lu() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::printf("Dense LU with partial pivoting\n");
  for (const std::size_t n : {14U, 32U, 60U, 120U, 300U}) {
    std::vector<double> a(n * n), factors(n * n), b(n);
    std::vector<int> pivots(n);
    for (double& value : a) value = unit(random);
    const auto factorise = [&] {
      factors = a;
      static_cast<void>(factorise_dense(factors.data(), n, pivots.data()));
    };
    const double time = n > 100 ? [&] {
      const auto start = std::chrono::steady_clock::now();
      for (int i = 0; i < 20; ++i) factorise();
      return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count() / 20;
    }() : median_us(factorise);
    std::printf("  %3zu unknowns           %7.2f us\n", n, time);
  }
}

}  // namespace
}  // namespace takt

int main() {
  using takt::test::BlockPlant;
  takt::bench_cell("Parts on the table", BlockPlant({}));
  takt::bench_cell("Assembly held by one gripper, partner search", BlockPlant(BlockPlant::assembly()));
  takt::bench_cell("Assembly held by one gripper, all connected",
                   BlockPlant(BlockPlant::assembly(), "substitute_force"));
  takt::bench_lu();
  return 0;
}
