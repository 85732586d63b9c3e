#pragma once
// Content of a picture: coloured meshes and lines in the world frame, and the camera. It is plain data without
// types of the simulation or of DDS, so that any program with poses can draw it.
#include <array>
#include <cstdint>
#include <vector>

#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/spatial.h"

namespace takt::render {

/// Red, green, blue in 0..1 as seen on the screen (sRGB).
struct Color {
  double r = 0.7, g = 0.7, b = 0.7;
};

/// A surface in its own frame B (m). Triangles are drawn from both sides.
struct Mesh {
  Pose X_WB;
  Color color;
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Vec3>
      normals;      ///< one unit normal per vertex for curved surfaces; empty: each triangle is flat
  bool lit = true;  ///< false: exactly `color`, without light and shadow
};

/// A straight line in the world (m), drawn `width_px` wide.
struct Line {
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();
  Color color{0.2, 0.2, 0.2};
  double width_px = 1.0;
};

struct Scene {
  std::vector<Mesh> meshes;
  std::vector<Line> lines;
  Color background_top{0.93, 0.95, 0.97};
  Color background_bottom{0.78, 0.82, 0.86};
  Vec3 towards_light_W{-0.4, -0.55, 1.0};  ///< direction to the main light, any length
  bool shadows = true;
};

/// Perspective camera at `eye_W` looking at `target_W`; world z is up in the picture.
struct Camera {
  Vec3 eye_W{2.0, -2.5, 2.0};
  Vec3 target_W = Vec3::Zero();
  double vertical_view_rad = 0.6;
  int width_px = 1280;
  int height_px = 720;
  int samples_per_axis = 3;  ///< anti-aliasing: its square is the number of samples per pixel
};

/// Moves the camera to the front left, above the points, as near to the centre of their box as all of them are in the
/// picture, at least `least_distance_m`. `margin`: factor of their distance from the centre of the picture. Without points
/// it stays.
void look_at(Camera& camera, const std::vector<Vec3>& points_W, double margin, double least_distance_m);

/// Shapes without a mesh file. All are closed. Their frame is X_WB.
Mesh make_box(const Pose& X_WB, const Vec3& size, const Color& color);  ///< centred
Mesh make_cylinder(const Vec3& from_W, const Vec3& to_W, double radius,
                   const Color& color);  ///< round, flat ends
Mesh make_capsule(const Vec3& from_W, const Vec3& to_W, double radius,
                  const Color& color);  ///< round, round ends

/// A square floor, its centre at `center_W`, with a line grid every `spacing` m.
void add_floor(Scene& scene, const Vec3& center_W, double size, double spacing);

/// The edges of a mesh where its faces meet at more than `angle_rad` (and open borders), as on an engineering
/// drawing.
void add_edges(Scene& scene, const Mesh& mesh, double angle_rad, const Color& color, double width_px);
/// Gives the mesh normals: where faces meet at `angle_rad` and less, the surface looks curved. Each triangle then has vertices
/// of its own.
void smooth(Mesh& mesh, double angle_rad);

/// An arm as capsules between its joint frames and short cylinders around the joint axes. `q` holds
/// joint_count() values. A link whose joint frames are offset sideways along the previous axis is drawn as an
/// L, as such arms are built.
void add_arm(Scene& scene, const ArmModel& arm, const double* q, const Pose& X_WR, const Color& links,
             const Color& joints);

}  // namespace takt::render
