#include "server/product/fine_faces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/product/geometry.h"

namespace takt::product {

namespace {

constexpr double kSame_m = 2e-5;  ///< axes and radii within this distance belong together

bool is_round(const Face& face) {
  return face.kind == SurfaceKind::cylinder || face.kind == SurfaceKind::cone;
}

/// Largest distance of each round face from its axis.
std::vector<double> radii_of(const Body& body) {
  std::vector<double> radii(body.faces.size(), 0.0);
  for (std::size_t t = 0; t < body.mesh.triangles.size(); ++t) {
    if (body.triangle_faces[t] < 0) continue;
    const auto f = static_cast<std::size_t>(body.triangle_faces[t]);
    const Face& face = body.faces[f];
    if (!is_round(face)) continue;
    for (const std::uint32_t v : body.mesh.triangles[t])
      radii[f] = std::max(radii[f], (body.mesh.vertices[v] - face.point_B).cross(face.axis_B).norm());
  }
  return radii;
}

/// Do these faces, both in the world, make this contact?
bool make(const Contact& contact, const Face& a, const Face& b) {
  if (a.kind != b.kind || a.concave == b.concave) return false;
  const bool fit = contact.kind == ContactKind::cylinder_fit;
  if (a.kind != (fit ? SurfaceKind::cylinder : SurfaceKind::cone)) return false;
  if (!coaxial(a, b, std::abs(contact.clearance_m) + kSame_m)) return false;
  const double clearance = (a.concave ? 1.0 : -1.0) * (a.radius_m - b.radius_m);
  return !fit || std::abs(clearance - contact.clearance_m) < kSame_m;
}

}  // namespace

std::vector<std::vector<double>> face_deflections(const Product& product) {
  constexpr double kShare = 0.125, kLeastGap_m = 2e-5, kMostFacets = 256.0;
  std::vector<std::vector<double>> result, radii;
  for (const Body& body : product.bodies) {
    result.emplace_back(body.faces.size(), 0.0);
    radii.push_back(radii_of(body));
  }
  for (const Contact& contact : product.contacts) {
    if (contact.kind != ContactKind::cylinder_fit && contact.kind != ContactKind::other) continue;
    const Instance &first = product.instances[contact.first], &second = product.instances[contact.second];
    const auto &first_faces = product.bodies[first.body].faces,
               &second_faces = product.bodies[second.body].faces;
    for (std::size_t a = 0; a < first_faces.size(); ++a) {
      if (!is_round(first_faces[a])) continue;
      const Face face = placed(first_faces[a], first.X_WB);
      for (std::size_t b = 0; b < second_faces.size(); ++b) {
        if (!make(contact, face, placed(second_faces[b], second.X_WB))) continue;
        const double radius = std::max(radii[first.body][a], radii[second.body][b]);
        const double deflection_m = std::max(kShare * std::max(std::abs(contact.clearance_m), kLeastGap_m),
                                             radius * (1.0 - std::cos(std::numbers::pi / kMostFacets)));
        // Several instances of a body touch in different ways.
        for (double* known : {&result[first.body][a], &result[second.body][b]})
          *known = *known == 0.0 ? deflection_m : std::min(*known, deflection_m);
      }
    }
  }
  return result;
}

}  // namespace takt::product
