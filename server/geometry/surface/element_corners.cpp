#include "server/geometry/surface/element_corners.h"

#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

std::array<TriangleCorners, 2> halve_longest_edge(const TriangleCorners& piece, double& length_m) {
  std::size_t longest = 0;
  length_m = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double edge = (piece[(k + 1) % 3] - piece[k]).norm();
    if (edge > length_m) length_m = edge, longest = k;
  }
  const Vec3 &a = piece[longest], &b = piece[(longest + 1) % 3], &c = piece[(longest + 2) % 3];
  const Vec3 middle = 0.5 * (a + b);
  return {{{middle, b, c}, {a, middle, c}}};
}

std::vector<TriangleCorners> element_triangles_B(const ContactSurface& surface, std::size_t element) {
  const ContactSurface::Data& data = surface.data();
  const auto [begin, end] = data.outlines.empty() ? ContactSurface::Data::Outline{} : data.outlines[element];
  if (begin < end) {
    std::vector<TriangleCorners> fan;
    for (std::uint32_t i = begin + 1; i + 1 < end; ++i)
      fan.push_back({data.outline_points[begin], data.outline_points[i], data.outline_points[i + 1]});
    return fan;
  }
  TriangleCorners piece = data.corners(data.faces[data.triangle[element]]);
  const Vec3 p = data.point(element);
  const auto twice_area = [](const TriangleCorners& t) { return (t[1] - t[0]).cross(t[2] - t[0]).norm(); };
  // Each cut halves the area, so the area identifies the element's level safely.
  while (twice_area(piece) > 1.5 * 2.0 * data.area_m2[element]) {
    double length_m = 0.0;
    const auto halves = halve_longest_edge(piece, length_m);
    // Both halves share the cut from the middle (corner 0 of the first) to the opposite corner. Seen along
    // the normal, the first half is on the side of its own corner 1.
    const Vec3 &middle = halves[0][0], &beyond = halves[0][1], &opposite = halves[0][2];
    const Vec3 normal = (piece[1] - piece[0]).cross(piece[2] - piece[0]);
    const Vec3 across = normal.cross(opposite - middle);
    piece = halves[across.dot(p - middle) * across.dot(beyond - middle) > 0.0 ? 0 : 1];
  }
  return {piece};
}

}  // namespace takt
