#include "server/scenario/sdf_geometry.h"

#include <algorithm>
#include <numbers>
#include <string_view>

#include "idl/common/text.h"

namespace takt {

namespace {

using Element = XmlFile::Element;

constexpr double kPlate_m = 0.1;       ///< thickness of a plane
constexpr double kPlateSide_m = 20.0;  ///< of a plane without size

template <std::size_t N>
std::array<double, N> child_numbers(const XmlFile& file, const Element& parent, const char* name,
                                    const std::string& where) {
  const Element& child = file.require_child(parent, name, where);
  return file.numbers<N>(child, XmlFile::content(child), where + ": <" + name + ">");
}

/// Numbers that a shape must have: the specification has one value where the file has none.
template <class Value, class Read>
Value stated(const XmlFile& file, const Element& shape, const char* name, const std::string& where,
             SdfFiles& files, const Value& missing, const Read& read) {
  if (XmlFile::child(shape, name) != nullptr) return read(file, shape, name, where);
  files.note(file, shape, where + ": found no <" + name + ">; 1 m is taken, as SDFormat has it");
  return missing;
}

double positive(const XmlFile& file, const Element& parent, const char* name, const std::string& where) {
  const double value = child_numbers<1>(file, parent, name, where)[0];
  if (!(value > 0.0))
    file.fail(parent, where + ": <" + name + ">: found '" + exact_text(value) + "'; allowed: a number > 0");
  return value;
}

Vec3 positive3(const XmlFile& file, const Element& parent, const char* name, const std::string& where) {
  const auto v = child_numbers<3>(file, parent, name, where);
  if (!std::all_of(v.begin(), v.end(), [](double x) { return x > 0.0; }))
    file.fail(parent,
              where + ": <" + name + ">: found '" + join(v, " ", exact_text) + "'; allowed: 3 numbers > 0");
  return {v[0], v[1], v[2]};
}

UrdfShape plate(const XmlFile& file, const Element& plane, const std::string& where, SdfFiles& files) {
  Vec3 normal = Vec3::UnitZ();
  if (XmlFile::child(plane, "normal") != nullptr) {
    const auto n = child_numbers<3>(file, plane, "normal", where);
    normal = {n[0], n[1], n[2]};
    if (!(normal.norm() > 1e-6))
      file.fail(plane, where + ": <normal>: found a vector without direction; allowed: one with it");
  }
  std::array<double, 2> size{kPlateSide_m, kPlateSide_m};
  if (XmlFile::child(plane, "size") != nullptr) size = child_numbers<2>(file, plane, "size", where);
  if (!(size[0] > 0.0) || !(size[1] > 0.0))
    file.fail(plane, where + ": <size>: found '" + join(size, " ", exact_text) + "'; allowed: 2 numbers > 0");
  UrdfShape shape;
  shape.size_m = {size[0], size[1], kPlate_m};
  const Mat3 R = Quat::FromTwoVectors(Vec3::UnitZ(), normal.normalized()).toRotationMatrix();
  shape.X_LS = {R, R * Vec3(0.0, 0.0, -0.5 * kPlate_m)};
  files.note(file, plane,
             where + ": the endless plane is a plate of " + number_text(size[0], 6) + " m x " +
                 number_text(size[1], 6) + " m x " + number_text(kPlate_m, 6) + " m");
  return shape;
}

std::vector<UrdfShape> capsule(double radius, double length) {
  std::vector<UrdfShape> shapes(3);
  shapes[0].kind = UrdfShapeKind::cylinder, shapes[0].length_m = length;
  for (const int end : {1, 2}) {
    shapes[static_cast<std::size_t>(end)].kind = UrdfShapeKind::sphere;
    shapes[static_cast<std::size_t>(end)].X_LS.p.z() = (end == 1 ? -0.5 : 0.5) * length;
  }
  for (UrdfShape& shape : shapes) shape.radius_m = radius;
  return shapes;
}

std::optional<UrdfShape> mesh(const XmlFile& file, const Element& element, const std::string& where,
                              SdfFiles& files) {
  UrdfShape shape;
  shape.kind = UrdfShapeKind::mesh;
  const Element& uri = file.require_child(element, "uri", where);
  if (XmlFile::child(element, "scale") != nullptr) {
    const auto s = child_numbers<3>(file, element, "scale", where);
    shape.scale = {s[0], s[1], s[2]};
  }
  if (XmlFile::child(element, "submesh") != nullptr)
    files.note(file, element, where + ": <submesh>: the whole mesh is taken");
  const auto found = files.mesh(file, uri, XmlFile::content(uri));
  if (!found) return std::nullopt;
  shape.filename = found->string();
  return shape;
}

}  // namespace

Pose sdf_pose(const XmlFile& file, const Element& pose) {
  const std::string text = XmlFile::content(pose), format = file.attribute(pose, "rotation_format");
  if (text.empty()) return {};
  if (format == "quat_xyzw") {
    const auto v = file.numbers<7>(pose, text, "<pose>");
    const Quat q(v[6], v[3], v[4], v[5]);
    if (!(q.norm() > 1e-6))
      file.fail(pose, "<pose>: found '" + text + "'; allowed: a quaternion (x y z w) that is not zero");
    return {q.normalized().toRotationMatrix(), {v[0], v[1], v[2]}};
  }
  if (!format.empty() && format != "euler_rpy")
    file.fail(pose, "<pose>: rotation_format: found '" + format + "'; allowed: euler_rpy, quat_xyzw");
  const auto v = file.numbers<6>(pose, text, "<pose>");
  const std::string degrees = file.attribute(pose, "degrees");
  if (!degrees.empty() && degrees != "true" && degrees != "1" && degrees != "false" && degrees != "0")
    file.fail(pose, "<pose>: degrees: found '" + degrees + "'; allowed: true, false");
  const double unit = degrees == "true" || degrees == "1" ? std::numbers::pi / 180.0 : 1.0;
  return {rotation_from_rpy(Vec3(v[3], v[4], v[5]) * unit), {v[0], v[1], v[2]}};
}

UrdfInertial sdf_inertial(const XmlFile& file, const Element& element, const std::string& where,
                          const Pose& X_LC) {
  UrdfInertial inertial;
  inertial.line = XmlFile::line(element);
  inertial.X_LC = X_LC;
  inertial.at_centre.mass_kg =
      XmlFile::child(element, "mass") != nullptr ? positive(file, element, "mass", where) : 1.0;
  const Element* tensor = XmlFile::child(element, "inertia");
  const auto moment = [&](const char* name, double missing) {
    if (tensor == nullptr || XmlFile::child(*tensor, name) == nullptr) return missing;
    return child_numbers<1>(file, *tensor, name, where + ": <inertia>")[0];
  };
  const double xx = moment("ixx", 1.0), xy = moment("ixy", 0.0), xz = moment("ixz", 0.0),
               yy = moment("iyy", 1.0), yz = moment("iyz", 0.0), zz = moment("izz", 1.0);
  inertial.at_centre.I_BBcm_B << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return inertial;
}

std::vector<UrdfShape> sdf_shapes(const XmlFile& file, const Element& element, const std::string& where,
                                  SdfFiles& files) {
  const Element* geometry = XmlFile::child(element, "geometry");
  const Element* kind = geometry != nullptr ? XmlFile::child(*geometry) : nullptr;
  while (kind != nullptr && XmlFile::name(*kind).find(':') != std::string_view::npos)
    kind = XmlFile::next(*kind);
  if (kind == nullptr) {
    files.note(file, element, where + ": it is left out: its <geometry> has no shape");
    return {};
  }
  const std::string name = XmlFile::name(*kind), of = where + ": <" + name + ">";
  const auto length = [&](const char* which) { return stated(file, *kind, which, of, files, 1.0, positive); };
  const auto lengths = [&](const char* which) {
    return stated(file, *kind, which, of, files, Vec3(Vec3::Ones()), positive3);
  };
  UrdfShape shape;
  if (name == "box") {
    shape.size_m = lengths("size");
  } else if (name == "sphere") {
    shape.kind = UrdfShapeKind::sphere;
    shape.radius_m = length("radius");
  } else if (name == "ellipsoid") {
    shape.kind = UrdfShapeKind::sphere;
    shape.radius_m = 1.0, shape.scale = lengths("radii");
  } else if (name == "cylinder") {
    shape.kind = UrdfShapeKind::cylinder;
    shape.radius_m = length("radius"), shape.length_m = length("length");
  } else if (name == "capsule") {
    std::vector<UrdfShape> shapes =
        capsule(positive(file, *kind, "radius", of), positive(file, *kind, "length", of));
    for (UrdfShape& part : shapes) part.line = XmlFile::line(*kind);
    return shapes;
  } else if (name == "plane") {
    shape = plate(file, *kind, of, files);
  } else if (name == "mesh") {
    const auto found = mesh(file, *kind, of, files);
    if (!found) return {};
    shape = *found;
  } else if (name == "empty") {
    return {};
  } else if (name == "cone" || name == "polyline" || name == "heightmap" || name == "image") {
    files.note(file, *kind, of + " is left out: takt does not have this shape");
    return {};
  } else {
    file.fail(
        *kind,
        where + ": <geometry>: found <" + name +
            ">; allowed: box, sphere, ellipsoid, cylinder, capsule, plane, mesh, empty, cone, polyline, "
            "heightmap, image");
  }
  shape.line = XmlFile::line(*kind);
  return {shape};
}

std::optional<std::array<float, 4>> sdf_color(const XmlFile& file, const Element& visual,
                                              const std::string& where) {
  const Element* material = XmlFile::child(visual, "material");
  if (material == nullptr) return std::nullopt;
  for (const char* kind : {"diffuse", "ambient"}) {
    const Element* color = XmlFile::child(*material, kind);
    if (color == nullptr) continue;
    const auto values = XmlFile::finite_numbers(XmlFile::content(*color));
    if (!values || (values->size() != 3 && values->size() != 4))
      file.fail(*color, where + ": <" + kind + ">: found '" + XmlFile::content(*color) +
                            "'; allowed: 3 or 4 numbers in [0, 1]");
    std::array<float, 4> result{0.0F, 0.0F, 0.0F, 1.0F};
    for (std::size_t i = 0; i < values->size(); ++i)
      result[i] = static_cast<float>(std::clamp((*values)[i], 0.0, 1.0));
    return result;
  }
  return std::nullopt;
}

}  // namespace takt
