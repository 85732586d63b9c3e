#include "server/scenario/urdf_collision.h"

#include <tinyxml.h>

#include <array>
#include <cmath>
#include <locale>
#include <map>
#include <numbers>
#include <sstream>
#include <system_error>

#include "server/geometry/mesh/import.h"

namespace takt {

namespace {

class CollisionReader {
 public:
  CollisionReader(const std::filesystem::path& file, const UrdfArm& urdf, std::string base_link)
      : file_(file), urdf_(urdf), base_link_(std::move(base_link)) {}

  std::vector<UrdfLinkShapes> read() {
    TiXmlDocument document;  // read_urdf_arm() found it well-formed, without loops
    document.Parse(urdf_.text.c_str(), nullptr, TIXML_ENCODING_UTF8);
    const TiXmlElement* robot = document.FirstChildElement("robot");
    std::vector<UrdfLinkShapes> result;
    if (robot == nullptr) return result;
    for (const TiXmlElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
         joint = joint->NextSiblingElement("joint")) {
      const TiXmlElement* child = joint->FirstChildElement("child");
      if (child != nullptr) above_[text(*child, "link")] = joint;
    }
    for (const TiXmlElement* link = robot->FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      if (link->FirstChildElement("collision") == nullptr) continue;
      UrdfLinkShapes shapes;
      shapes.link = text(*link, "name");
      Pose X_JL;
      if (!place(shapes.link, shapes.joint, X_JL)) continue;
      for (const TiXmlElement* element = link->FirstChildElement("collision"); element != nullptr;
           element = element->NextSiblingElement("collision")) {
        read_collision(*element, shapes.link, X_JL, shapes.shapes);
      }
      result.push_back(std::move(shapes));
    }
    return result;
  }

 private:
  [[noreturn]] void refuse(const TiXmlElement& element, const std::string& reason) const {
    throw UrdfError(file_.string() + ": line " + std::to_string(element.Row()) + ", column " +
                    std::to_string(element.Column()) + ": " + reason);
  }

  static std::string text(const TiXmlElement& element, const char* attribute) {
    const char* value = element.Attribute(attribute);
    return value != nullptr ? value : "";
  }

  template <std::size_t N>
  std::array<double, N> numbers(const TiXmlElement& element, const char* attribute, const char* of,
                                const std::string& who, bool positive) const {
    const std::string value = text(element, attribute);
    std::istringstream in(value);
    in.imbue(std::locale::classic());
    std::array<double, N> result{};
    bool good = true;
    for (double& number : result)
      good = good && (in >> number) && std::isfinite(number) && (!positive || number > 0.0);
    std::string rest;
    if (!good || (in >> rest)) {
      const std::string many = N == 1 ? "a finite number" : std::to_string(N) + " finite numbers";
      refuse(element, who + ": " + of + ": " + attribute + ": found '" + value + "'; allowed: " + many +
                          (positive ? " > 0" : "") + " (m" +
                          (std::string(attribute) == "rpy" ? "; rad" : "") + ")");
    }
    return result;
  }

  Pose origin(const TiXmlElement& parent, const std::string& who) const {
    Pose X;
    const TiXmlElement* element = parent.FirstChildElement("origin");
    if (element == nullptr) return X;
    if (element->Attribute("xyz") != nullptr) {
      const auto p = numbers<3>(*element, "xyz", "<origin>", who, false);
      X.p = Vec3(p[0], p[1], p[2]);
    }
    if (element->Attribute("rpy") != nullptr) {
      const auto rpy = numbers<3>(*element, "rpy", "<origin>", who, false);
      X.R = rotation_from_rpy(Vec3(rpy[0], rpy[1], rpy[2]));
    }
    return X;
  }

  /// Up from a link over fixed joints to what moves it. False for what is above the base link.
  bool place(const std::string& link, int& joint, Pose& X_JL) const {
    std::string at = link;
    while (at != base_link_) {
      const auto found = above_.find(at);
      if (found == above_.end()) return false;
      const std::string name = text(*found->second, "name");
      for (int i = 0; i < urdf_.arm.joint_count(); ++i) {
        if (urdf_.arm.joints[static_cast<std::size_t>(i)].name != name) continue;
        joint = i;
        return true;
      }
      X_JL = origin(*found->second, "joint '" + name + "'") * X_JL;
      at = text(*found->second->FirstChildElement("parent"), "link");
    }
    joint = -1;
    return true;
  }

  void read_collision(const TiXmlElement& element, const std::string& link, const Pose& X_JL,
                      std::vector<RoundedShape>& shapes) const {
    const std::string who = "link '" + link + "': <collision>";
    const Pose X_JS = X_JL * origin(element, who);
    const TiXmlElement* geometry = element.FirstChildElement("geometry");
    const TiXmlElement* kind = geometry != nullptr ? geometry->FirstChildElement() : nullptr;
    if (kind == nullptr) {
      refuse(element, who + ": found no geometry; allowed: <geometry> with box, cylinder, sphere or mesh");
    }
    const std::string name = kind->ValueStr();
    if (name == "box") {
      const auto size = numbers<3>(*kind, "size", "<box>", who, true);
      ConvexShape box = ConvexShape::from_points(std::vector<Vec3>(8, Vec3::Zero()));
      box.become_box(-0.5 * Vec3(size[0], size[1], size[2]), 0.5 * Vec3(size[0], size[1], size[2]));
      shapes.push_back(moved({std::move(box), 0.0}, X_JS));
    } else if (name == "sphere") {
      const double radius = numbers<1>(*kind, "radius", "<sphere>", who, true)[0];
      shapes.push_back({ConvexShape::from_points({X_JS.p}), radius});
    } else if (name == "cylinder") {
      const double radius = numbers<1>(*kind, "radius", "<cylinder>", who, true)[0];
      const double length = numbers<1>(*kind, "length", "<cylinder>", who, true)[0];
      shapes.push_back(moved(cylinder(radius, length), X_JS));
    } else if (name == "mesh") {
      read_mesh(*kind, who, X_JS, shapes);
    } else {
      refuse(*kind, who + ": found <" + name + ">; allowed: box, cylinder, sphere, mesh");
    }
  }

  /// The prism whose sides touch the cylinder.
  static RoundedShape cylinder(double radius, double length) {
    const double corner = radius / std::cos(std::numbers::pi / kCylinderSides);
    std::vector<Vec3> vertices;
    for (int i = 0; i < kCylinderSides; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kCylinderSides;
      for (const double z : {-0.5 * length, 0.5 * length})
        vertices.emplace_back(corner * std::cos(angle), corner * std::sin(angle), z);
    }
    return {ConvexShape::from_points(std::move(vertices)), 0.0};
  }

  void read_mesh(const TiXmlElement& element, const std::string& who, const Pose& X_JS,
                 std::vector<RoundedShape>& shapes) const {
    std::string name = text(element, "filename");
    if (name.rfind("file://", 0) == 0) name.erase(0, 7);
    std::error_code error;
    const std::filesystem::path path = file_.parent_path() / name;
    if (name.empty() || name.find("://") != std::string::npos ||
        !std::filesystem::is_regular_file(path, error)) {
      refuse(element, who + ": <mesh>: filename: found '" + text(element, "filename") +
                          "'; allowed: an existing OBJ, STL or GLB file, relative to the URDF file");
    }
    Vec3 scale = Vec3::Ones();
    if (element.Attribute("scale") != nullptr) {
      const auto s = numbers<3>(element, "scale", "<mesh>", who, true);
      scale = Vec3(s[0], s[1], s[2]);
    }
    for (const NamedMesh& object : import_mesh_objects(path)) {
      std::vector<Vec3> points;
      for (const Vec3& v : object.mesh.vertices) points.push_back(X_JS * v.cwiseProduct(scale));
      try {
        shapes.push_back({ConvexShape::from_points(convex_hull_vertices(points)), 0.0});
      } catch (const std::invalid_argument& reason) {
        refuse(element,
               who + ": <mesh>: object '" + object.name + "' of " + path.string() + ": " + reason.what());
      }
    }
  }

  std::filesystem::path file_;
  const UrdfArm& urdf_;
  std::string base_link_;
  std::map<std::string, const TiXmlElement*> above_;  ///< joint by child link
};

}  // namespace

std::vector<UrdfLinkShapes> read_urdf_collision(const std::filesystem::path& file, const UrdfArm& urdf,
                                                const std::string& base_link) {
  return CollisionReader(file, urdf, base_link).read();
}

}  // namespace takt
