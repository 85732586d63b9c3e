#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <string_view>
#include <utility>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/scenario/sdf_files.h"
#include "server/scenario/sdf_frames.h"
#include "server/scenario/sdf_geometry.h"
#include "server/scenario/sdf_world.h"
#include "server/scenario/xml_file.h"

namespace takt {

namespace {

using Element = XmlFile::Element;

constexpr std::string_view kVisual{"visual"}, kCollision{"collision"};
constexpr std::size_t kDeepestInclude = 16;
constexpr double kNoLimit = 1e15;  ///< beyond it a joint is free: exporters write 1e16 for that

/// Elements without a meaning for what stands and moves in a cell.
const std::set<std::string_view> kWithoutEffect{"pose",
                                                "static",
                                                "self_collide",
                                                "allow_auto_disable",
                                                "enable_wind",
                                                "gui",
                                                "scene",
                                                "physics",
                                                "gravity",
                                                "atmosphere",
                                                "wind",
                                                "magnetic_field",
                                                "spherical_coordinates",
                                                "inertial",
                                                "velocity_decay",
                                                "kinematic",
                                                "must_be_base_link",
                                                "audio"};

class Reader {
 public:
  explicit Reader(const SdfOptions& options) : files_(options) {}

  SdfWorld read(const std::filesystem::path& path) {
    const XmlFile& file = files_.open(path);
    version_ = files_.version(file);
    const Element& root = *file.root();
    if (const Element* world = XmlFile::child(root, "world")) {
      if (const Element* second = XmlFile::next(*world, "world"))
        note(file, *second, "a second <world> is left out");
      read_world(file, *world);
    } else {
      read_models(file, root);
    }
    for (const PendingLink& link : links_) fill(link);
    for (const PendingJoint& joint : joints_) fill(joint);
    for (const std::string& sentence : files_.notes()) world_.notes.push_back(sentence);
    return std::move(world_);
  }

 private:
  using Frame = SdfFrames::Frame;
  using Scope = SdfFrames::Scope;

  struct PendingLink {
    const XmlFile* file;
    const Element* element;
    Scope scope;
    Frame frame;
    std::size_t model, link;
  };
  struct PendingJoint {
    const XmlFile* file;
    const Element* element;
    Scope scope;
    Frame frame;
    std::size_t model;
    std::string name;
    double version;
  };
  /// Where a model is read, and what its <include> states in place of it.
  struct Place {
    Scope above = SdfFrames::kWorldNames;
    std::optional<std::size_t> model;  ///< that has it; none: it is one of the world's
    std::string prefix;                ///< of its links' names
    std::size_t depth = 0;             ///< of includes
    const XmlFile* including_file = nullptr;
    const Element* including = nullptr;
    bool merged = false;
  };

  void note(const XmlFile& file, const Element& element, const std::string& sentence) {
    world_.notes.push_back(place_in(file.file(), XmlFile::line(element)) + sentence + ".");
  }
  void leave_out(const Element& element) {
    const std::string name = XmlFile::name(element);
    if (name.find(':') == name.npos && !kWithoutEffect.contains(name)) ++world_.left_out[name];
  }

  static std::string child_text(const Element& element, const char* name) {
    const Element* child = XmlFile::child(element, name);
    return child != nullptr ? XmlFile::content(*child) : std::string();
  }
  static bool flag(const XmlFile& file, const Element& parent, const char* name) {
    const Element* child = XmlFile::child(parent, name);
    if (child == nullptr) return false;
    const std::string text = lower_text(XmlFile::content(*child));
    if (text == "true" || text == "1") return true;
    if (text != "false" && text != "0" && !text.empty())
      file.fail(*child, "<" + std::string(name) + ">: found '" + text + "'; allowed: true, false, 1, 0");
    return false;
  }

  /// Of a file without a world.
  void read_models(const XmlFile& file, const Element& root) {
    bool any = false;
    XmlFile::for_each(root, nullptr, [&](const Element& child) {
      const std::string kind = XmlFile::name(child);
      if (kind == "model")
        read_model(file, child, {});
      else if (kind == "include")
        read_include(file, child, {});
      else
        leave_out(child);
      any = any || kind == "model" || kind == "include";
    });
    if (!any) file.fail(root, "<sdf>: found neither <world>, <model> nor <include>; one of them is needed");
    world_.name = world_.models.empty() ? file.file().stem().string() : world_.models.front().name;
  }

  void read_world(const XmlFile& file, const Element& element) {
    world_.name = file.require(element, "name", "<world>");
    if (const Element* gravity = XmlFile::child(element, "gravity")) {
      const auto g = file.numbers<3>(*gravity, XmlFile::content(*gravity), "<gravity>");
      world_.gravity_m_per_s2 = {g[0], g[1], g[2]};
    }
    XmlFile::for_each(element, nullptr, [&](const Element& child) {
      const std::string name = XmlFile::name(child);
      if (name == "model")
        read_model(file, child, {});
      else if (name == "include")
        read_include(file, child, {});
      else if (name == "frame")
        read_frame(file, child, SdfFrames::kWorldNames);
      else
        leave_out(child);
    });
  }

  void place(const XmlFile& file, const Element& parent, Frame frame, Scope scope, Frame usual) {
    const Element* pose = XmlFile::child(parent, "pose");
    if (pose == nullptr)
      frames_.place(frame, {}, scope, {}, usual);
    else
      frames_.place(frame, sdf_pose(file, *pose), scope, file.attribute(*pose, "relative_to"), usual);
  }

  void read_frame(const XmlFile& file, const Element& element, Scope scope) {
    const Frame frame = frames_.add(scope, file.require(element, "name", "<frame>"), file, element);
    const std::string attached = file.attribute(element, "attached_to");
    frames_.attach(frame, scope, attached);
    const Element* pose = XmlFile::child(element, "pose");
    const std::string relative = pose != nullptr ? file.attribute(*pose, "relative_to") : std::string();
    frames_.place(frame, pose != nullptr ? sdf_pose(file, *pose) : Pose{}, scope,
                  relative.empty() ? attached : relative, frames_.own(scope));
  }

  void read_include(const XmlFile& file, const Element& element, Place at) {
    if (at.depth == kDeepestInclude)
      file.fail(element, "<include>: models include each other more than " + std::to_string(kDeepestInclude) +
                             " levels deep");
    const Element& uri = file.require_child(element, "uri", "<include>");
    const auto path = files_.model(file, uri, XmlFile::content(uri));
    if (!path) {  // reported by a note
      std::string name = child_text(element, "name");
      if (name.empty()) name = std::filesystem::path(XmlFile::content(uri)).filename().string();
      missing_.emplace(at.above, name);
      return;
    }
    const XmlFile& other = files_.open(*path);
    const double outside = std::exchange(version_, files_.version(other));
    if (const Element* model = XmlFile::child(*other.root(), "model")) {
      at.including_file = &file, at.including = &element;
      ++at.depth;
      at.merged = file.attribute(element, "merge") == "true" || file.attribute(element, "merge") == "1";
      read_model(other, *model, at);
    } else if (const Element* first = XmlFile::child(*other.root())) {
      leave_out(*first);
    }
    version_ = outside;
  }

  void read_model(const XmlFile& file, const Element& element, const Place& at) {
    const std::string own = file.require(element, "name", "<model>");
    const std::string stated = at.including != nullptr ? child_text(*at.including, "name") : std::string();
    const std::string name = stated.empty() ? own : stated;
    const Scope scope = frames_.add_scope(at.above, name, file, element);
    const bool posed = at.including != nullptr && XmlFile::child(*at.including, "pose") != nullptr;
    place(posed ? *at.including_file : file, posed ? *at.including : element, frames_.own(scope), at.above,
          frames_.own(at.above));
    const std::string placed =
        at.including != nullptr ? child_text(*at.including, "placement_frame") : std::string();
    if (const std::string frame = placed.empty() ? file.attribute(element, "placement_frame") : placed;
        !frame.empty())
      frames_.place_by(frames_.own(scope), scope, frame);
    const std::size_t model = at.model.value_or(world_.models.size());
    if (!at.model) world_.models.push_back({name, false, {}, {}});
    const bool stands = flag(file, element, "static") ||
                        (at.including != nullptr && flag(*at.including_file, *at.including, "static"));
    if (!at.model)
      world_.models[model].is_static = stands;
    else if (stands && !world_.models[model].is_static)
      note(file, element, "model '" + name + "': a static model in one that is not; it moves with that one");
    Place inside{scope,    model,   at.model && !at.merged ? at.prefix + name + "::" : at.prefix,
                 at.depth, nullptr, nullptr,
                 false};
    XmlFile::for_each(element, nullptr, [&](const Element& child) {
      const std::string kind = XmlFile::name(child);
      if (kind == "link")
        declare_link(file, child, inside);
      else if (kind == "joint")
        declare_joint(file, child, inside);
      else if (kind == "frame")
        read_frame(file, child, scope);
      else if (kind == "model")
        read_model(file, child, inside);
      else if (kind == "include")
        read_include(file, child, inside);
      else
        leave_out(child);
    });
    if (at.merged) frames_.merge(at.above, scope);
  }

  void declare_link(const XmlFile& file, const Element& element, const Place& at) {
    const std::string name = file.require(element, "name", "<link>");
    const Frame frame = frames_.add(at.above, name, file, element);
    place(file, element, frame, at.above, frames_.own(at.above));
    std::vector<SdfLink>& links = world_.models[*at.model].links;
    frames_.set_link(frame, links.size());
    frames_.set_link_once(frames_.own(at.above), links.size());
    links_.push_back({&file, &element, at.above, frame, *at.model, links.size()});
    links.emplace_back().name = at.prefix + name;
  }

  void declare_joint(const XmlFile& file, const Element& element, const Place& at) {
    const std::string name = file.require(element, "name", "<joint>");
    // Before version 1.7 joints had names of their own.
    const bool apart = version_ < 1.7 && frames_.has(at.above, name);
    const Frame frame = frames_.add(at.above, apart ? name + " (joint)" : name, file, element);
    const Element& child = file.require_child(element, "child", "joint '" + name + "'");
    const Element* pose = XmlFile::child(element, "pose");
    const std::string relative = pose != nullptr ? file.attribute(*pose, "relative_to") : std::string();
    frames_.place(frame, pose != nullptr ? sdf_pose(file, *pose) : Pose{}, at.above,
                  relative.empty() ? XmlFile::content(child) : relative, frames_.own(at.above));
    frames_.attach(frame, at.above, XmlFile::content(child));
    joints_.push_back({&file, &element, at.above, frame, *at.model, at.prefix + name, version_});
  }

  void fill(const PendingLink& at) {
    const XmlFile& file = *at.file;
    SdfLink& link = world_.models[at.model].links[at.link];
    link.X_WL = frames_.X_WF(at.frame);
    const std::string where = "link '" + link.name + "': ";
    if (const Element* inertial = XmlFile::child(*at.element, "inertial")) {
      const auto mass = finite_number(child_text(*inertial, "mass"));
      link.is_massless = mass && *mass == 0.0;
      if (link.is_massless)
        note(file, *inertial,
             where +
                 "<inertial>: <mass> is 0: read as Bullet does, in which such a link stands where no joint "
                 "carries it");
      else
        link.inertial = sdf_inertial(file, *inertial, where + "<inertial>", pose_in_link(at, *inertial));
    }
    for (const char* kind : {"kinematic", "gravity"}) {
      const Element* child = XmlFile::child(*at.element, kind);
      if (child != nullptr && flag(file, *at.element, kind) == (std::string_view(kind) == "kinematic"))
        note(file, *child, where + "<" + kind + "> has no effect in takt");
    }
    XmlFile::for_each(*at.element, nullptr, [&](const Element& child) {
      const std::string kind = XmlFile::name(child);
      const bool drawn = kind == kVisual;
      if (!drawn && kind != kCollision) {
        leave_out(child);
        return;
      }
      std::vector<UrdfShape>& shapes = drawn ? link.visuals : link.collisions;
      const Pose X_LS = pose_in_link(at, child);
      for (UrdfShape& shape : sdf_shapes(file, child, where + "<" + kind + ">", files_)) {
        shape.X_LS = X_LS * shape.X_LS;
        shapes.push_back(std::move(shape));
      }
      if (drawn && !link.color) link.color = sdf_color(file, child, where + "<visual>: <material>");
    });
  }

  Pose pose_in_link(const PendingLink& at, const Element& parent) {
    const Element* pose = XmlFile::child(parent, "pose");
    if (pose == nullptr) return {};
    const Pose X = sdf_pose(*at.file, *pose);
    const std::string relative = at.file->attribute(*pose, "relative_to");
    if (relative.empty()) return X;
    return frames_.relative(frames_.find(at.scope, relative, *at.file, *pose), at.frame) * X;
  }

  std::optional<std::size_t> end_of(const PendingJoint& at, const char* end) {
    const Element& element = at.file->require_child(*at.element, end, "joint '" + at.name + "'");
    const std::string name = XmlFile::content(element);
    if (name.empty())
      at.file->fail(element,
                    "joint '" + at.name + "': <" + end + ">: found nothing; allowed: a link or frame");
    if (name == SdfFrames::kWorldName) return std::nullopt;
    const auto link = frames_.link_of(frames_.find(at.scope, name, *at.file, element));
    if (!link)
      at.file->fail(element,
                    "joint '" + at.name + "': <" + end + ">: found '" + name + "', which is no link");
    return link;
  }

  void fill(const PendingJoint& at) {
    const XmlFile& file = *at.file;
    const std::string where = "joint '" + at.name + "'";
    SdfJoint joint;
    joint.name = at.name;
    joint.place = place_in(file.file(), XmlFile::line(*at.element));
    joint.kind = file.require(*at.element, "type", where);
    using Kind = std::pair<std::string_view, UrdfJointType>;
    constexpr UrdfJointType other = UrdfJointType::floating;
    constexpr std::array<Kind, 9> kinds{Kind{"fixed", UrdfJointType::fixed},
                                        Kind{"revolute", UrdfJointType::revolute},
                                        Kind{"continuous", UrdfJointType::continuous},
                                        Kind{"prismatic", UrdfJointType::prismatic},
                                        Kind{"ball", other},
                                        Kind{"screw", other},
                                        Kind{"universal", other},
                                        Kind{"revolute2", other},
                                        Kind{"gearbox", other}};
    const auto known =
        std::find_if(kinds.begin(), kinds.end(), [&](const Kind& kind) { return kind.first == joint.kind; });
    if (known == kinds.end())
      file.fail(*at.element, where + ": type: found '" + joint.kind + "'; allowed: " +
                                 join(kinds, ", ", [](const Kind& kind) { return std::string(kind.first); }));
    joint.type = known->second;
    for (const char* end : {"parent", "child"}) {
      const std::string name = child_text(*at.element, end);
      if (!missing_.contains({at.scope, name.substr(0, name.find("::"))})) continue;
      note(file, *at.element,
           where + " is left out: its <" + end + "> '" + name + "' is of a model that is not there");
      return;
    }
    joint.parent = end_of(at, "parent");
    const auto child = end_of(at, "child");
    if (!child) file.fail(*at.element, where + ": <child>: found 'world'; allowed: a link of the model");
    joint.child = *child;
    if (joint.parent == joint.child)
      file.fail(*at.element, where + ": parent and child are one link; allowed: two");
    joint.X_WJ = frames_.X_WF(at.frame);
    if (const Element* axis = XmlFile::child(*at.element, "axis"))
      read_axis(at, *axis, where + ": <axis>", joint);
    else if (joint.type != UrdfJointType::fixed && joint.type != other)
      note(file, *at.element, where + ": found no <axis>; z is taken, without limits, as SDFormat has it");
    world_.models[at.model].joints.push_back(std::move(joint));
  }

  void read_axis(const PendingJoint& at, const Element& axis, const std::string& where, SdfJoint& joint) {
    const XmlFile& file = *at.file;
    if (const Element* xyz = XmlFile::child(axis, "xyz")) {
      const auto v = file.numbers<3>(*xyz, XmlFile::content(*xyz), where + ": <xyz>");
      joint.axis = {v[0], v[1], v[2]};
      if (!(joint.axis.norm() > 1e-6))
        file.fail(*xyz, where + ": <xyz>: found '" + XmlFile::content(*xyz) +
                            "'; allowed: a vector with a direction");
      const std::string expressed = file.attribute(*xyz, "expressed_in");
      std::optional<Frame> frame;
      if (!expressed.empty()) frame = frames_.find(at.scope, expressed, file, *xyz);
      if (at.version < 1.5 || flag(file, axis, "use_parent_model_frame")) frame = frames_.own(at.scope);
      if (frame) joint.axis = frames_.relative(*frame, at.frame).R * joint.axis;
    }
    joint.axis.normalize();
    const Element* limit = XmlFile::child(axis, "limit");
    if (limit == nullptr) return;
    const auto value = [&](const char* name, double missing) {
      const Element* child = XmlFile::child(*limit, name);
      if (child == nullptr) return missing;
      std::string text = lower_text(XmlFile::content(*child));
      if (text == "inf" || text == "+inf" || text == "infinity")
        return std::numeric_limits<double>::infinity();
      if (text == "-inf" || text == "-infinity") return -std::numeric_limits<double>::infinity();
      return file.numbers<1>(*child, text, where + ": <" + name + ">")[0];
    };
    constexpr double inf = std::numeric_limits<double>::infinity();
    joint.lower = value("lower", -inf), joint.upper = value("upper", inf);
    if (joint.lower < -kNoLimit) joint.lower = -inf;
    if (joint.upper > kNoLimit) joint.upper = inf;
    const auto stated = [](double x) { return x > 0.0 && x < kNoLimit ? x : 0.0; };
    joint.velocity = stated(value("velocity", 0.0)), joint.effort = stated(value("effort", 0.0));
    if (joint.lower > joint.upper)
      file.fail(*limit, where + ": <limit>: found lower " + exact_text(joint.lower) + ", upper " +
                            exact_text(joint.upper) + "; lower must not be above upper");
  }

  SdfFiles files_;
  SdfFrames frames_;
  SdfWorld world_;
  double version_ = 0.0;
  std::vector<PendingLink> links_;
  std::vector<PendingJoint> joints_;
  std::set<std::pair<Scope, std::string>> missing_;  ///< included models that are not there
};

}  // namespace

SdfWorld read_sdf(const std::filesystem::path& file, const SdfOptions& options) {
  return Reader(options).read(file);
}

}  // namespace takt
