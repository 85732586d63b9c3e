#pragma once
// A URDF file as a tree of links and joints: read once, strictly, into one model. It is the source of an
// arm's kinematics and dynamics (urdf_arm.h) and of the shapes of collision checking (urdf_collision.h).
//
// Frames and units are those of URDF: m, rad, kg, N, N m. L is the frame of a link, J that of the joint above
// it at position zero (the same frame), P the frame of the link that carries the joint. Rotations are
// fixed-axis roll, pitch, yaw (rotation_from_rpy). Of materials only the colour is read, for pictures. Ignored are
// <dynamics>, <safety_controller>, <calibration>, <transmission>, <gazebo>.
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "idl/common/ros_packages.h"
#include "plant_models/mechanics/multibody_tree.h"
#include "plant_models/spatial.h"
#include "server/scenario/description_error.h"

namespace takt {

using UrdfError = DescriptionError;

struct UrdfInertial {
  Pose X_LC;              ///< centre of mass and axes of the tensor
  BodyInertia at_centre;  ///< in C: p_BBcm_B is zero. Finite numbers, not necessarily physical ones
  int line = 0;
};

enum class UrdfShapeKind { box, cylinder, sphere, mesh };

/// Geometry of a <visual> or <collision>. Sizes are finite numbers, not necessarily positive ones.
struct UrdfShape {
  UrdfShapeKind kind = UrdfShapeKind::box;
  Pose X_LS;
  Vec3 size_m = Vec3::Zero();                   ///< of a box
  double radius_m = 0.0;                        ///< of a sphere or cylinder
  double length_m = 0.0;                        ///< of a cylinder, along z
  Vec3 scale = Vec3::Ones();                    ///< of a mesh
  std::string filename;                         ///< of a mesh, as the file has it
  std::optional<std::array<float, 3>> color{};  ///< of its material: red, green, blue in 0..1
  int line = 0;
};

struct UrdfLink {
  std::string name;
  std::optional<std::size_t> above;  ///< joint that carries it; std::nullopt for the root
  std::vector<std::size_t> below;    ///< joints that it carries, in the order of the file
  std::optional<UrdfInertial> inertial;
  std::vector<UrdfShape> visuals, collisions;
  int line = 0;
};

enum class UrdfJointType { fixed, revolute, continuous, prismatic, floating, planar };

struct UrdfLimit {
  double lower = 0.0, upper = 0.0;  ///< rad or m
  double velocity = 0.0;            ///< rad/s or m/s; 0 or less: not stated
  double effort = 0.0;              ///< N m or N; 0 or less: not stated
  int line = 0;
};

struct UrdfJoint {
  std::string name;
  UrdfJointType type = UrdfJointType::fixed;
  std::size_t parent = 0, child = 0;  ///< links
  Pose X_PJ;
  Vec3 axis = Vec3::UnitX();       ///< in J, of any length
  std::optional<UrdfLimit> limit;  ///< always there for revolute and prismatic joints
  /// The joint that it follows, at mimic_multiplier times its position plus mimic_offset; empty: an independent joint.
  std::string mimics;
  double mimic_multiplier = 1.0, mimic_offset = 0.0;
  int line = 0;

  std::string describe() const;  ///< "joint 'NAME' (TYPE)"
};

struct UrdfRobot {
  std::filesystem::path file;
  PackageFolders packages;
  std::string text;               ///< the file as it is
  std::vector<UrdfLink> links;    ///< in the order of the file, as joints
  std::vector<UrdfJoint> joints;  ///< join all links to one tree

  /// Index of the link of that name. Throws UrdfError that lists the links.
  std::size_t find_link(const std::string& name) const;
  /// The existing file of a shape of kind mesh.
  std::optional<std::filesystem::path> mesh_file(const UrdfShape& shape) const {
    return find_mesh_file(shape.filename, file, packages);
  }
  /// "FILE: line LINE: ", where line 0 stands for the whole file.
  std::string place(int line) const;
  /// Throws UrdfError: place and reason.
  [[noreturn]] void fail(int line, const std::string& reason) const;
};

/// Throws UrdfError for a missing file, bytes that are not UTF-8, text that is not well-formed XML, a version
/// other than 1.0, names that are missing or used twice, numbers that are not finite, missing elements and
/// attributes that URDF requires, unknown types of joints and geometry, links that do not form one tree,
/// and files of other formats (xacro, SDFormat).
UrdfRobot read_urdf(const std::filesystem::path& file, const PackageFolders& packages = {});

}  // namespace takt
