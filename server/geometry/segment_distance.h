#pragma once
// Distances of points, segments and triangles, in one frame (m). (Ericson, Real-Time Collision Detection,
// 2005, ch. 5.1.)
#include <array>

#include "plant_models/spatial.h"

namespace takt {

/// Squared distance of a point to the segment a-b.
double point_segment_squared_distance(const Vec3& point, const Vec3& a, const Vec3& b);

/// The point of the segment a-b closest to `point`.
Vec3 closest_on_segment(const Vec3& point, const Vec3& a, const Vec3& b);

/// Squared distance of the segments p-q and a-b; either may be a point.
double segment_segment_squared_distance(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b);

/// Squared distance of a point to a triangle that has an area.
double point_triangle_squared_distance(const Vec3& point, const std::array<Vec3, 3>& triangle);

/// Squared distance of the segment p-q to a triangle that has an area; zero if it goes through.
double segment_triangle_squared_distance(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& triangle);

}  // namespace takt
