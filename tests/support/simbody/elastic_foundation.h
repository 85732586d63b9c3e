#pragma once
// Simbody's elastic foundation (Sherman, Seth, Delp: Simbody: multibody dynamics for biomedical research,
// Procedia IUTAM 2, 2011): springs at the centroids of one mesh to the closest points of another one. In
// plain numbers: Simbody's headers are C++17 and no later.
#include <array>
#include <cstdint>
#include <vector>

namespace takt::test {

struct PlainMesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct PlainPose {
  std::array<std::array<double, 3>, 3> R;  ///< rows
  std::array<double, 3> p;                 ///< m
};

/// Force (N) and moment (N m) on the base about its own origin, axes of the target. Springs on the base
/// alone, without dissipation and friction.
std::array<double, 6> elastic_foundation(const PlainMesh& base, const PlainMesh& target,
                                         const PlainPose& X_TB, double stiffness_Pa_per_m);

}  // namespace takt::test
