#include "server/scenario/urdf_reader.h"

#include <console_bridge/console.h>
#include <tinyxml.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <locale>
#include <map>
#include <numbers>
#include <sstream>
#include <string_view>
#include <system_error>
#include <vector>

namespace takt {

namespace {

/// urdfdom tells what is wrong only by logging. This collects its complaints instead of letting them reach
/// the terminal, for as long as it lives.
class ComplaintCollector : public console_bridge::OutputHandler {
 public:
  ComplaintCollector() : level_(console_bridge::getLogLevel()) {
    console_bridge::useOutputHandler(this);
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_ERROR);
  }
  ~ComplaintCollector() override {
    console_bridge::setLogLevel(level_);
    console_bridge::restorePreviousOutputHandler();
  }
  ComplaintCollector(const ComplaintCollector&) = delete;
  ComplaintCollector& operator=(const ComplaintCollector&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    if (!complaints_.empty()) complaints_ += "; ";
    complaints_ += text;
  }
  const std::string& complaints() const { return complaints_; }

 private:
  console_bridge::LogLevel level_;
  std::string complaints_;
};

std::string text_of(double value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(17);
  out << value;
  return out.str();
}

std::string text_of(const TiXmlElement* element, const char* attribute) {
  const char* value = element != nullptr ? element->Attribute(attribute) : nullptr;
  return value != nullptr ? value : "";
}

std::string_view type_name(int type) {
  switch (type) {
    case urdf::Joint::REVOLUTE:
      return "revolute";
    case urdf::Joint::CONTINUOUS:
      return "continuous";
    case urdf::Joint::PRISMATIC:
      return "prismatic";
    case urdf::Joint::FLOATING:
      return "floating";
    case urdf::Joint::PLANAR:
      return "planar";
    case urdf::Joint::FIXED:
      return "fixed";
    default:
      return "unknown";
  }
}

/// Elements of a URDF are nested four deep; deeper than this is an error (or malice) on which the recursive
/// XML reader would run out of stack.
constexpr int kDeepestNesting = 100;

/// Line of the first element nested deeper than allowed, or 0. Knows of XML only what moves the depth.
long line_nested_too_deep(std::string_view text) {
  const auto starts = [&](size_t at, std::string_view with) { return text.substr(at, with.size()) == with; };
  const auto past = [&](size_t at, std::string_view end) {
    const size_t found = text.find(end, at);
    return found == std::string_view::npos ? text.size() : found + end.size();
  };
  int depth = 0;
  size_t at = 0;
  while ((at = text.find('<', at)) < text.size()) {
    if (starts(at, "<!--")) {
      at = past(at, "-->");
    } else if (starts(at, "<![CDATA[")) {
      at = past(at, "]]>");
    } else if (starts(at, "<!") || starts(at, "<?")) {
      at = past(at, ">");
    } else if (starts(at, "</")) {
      --depth;
      at = past(at, ">");
    } else {
      if (++depth > kDeepestNesting)
        return 1 + std::count(text.begin(), text.begin() + static_cast<long>(at), '\n');
      char quote = 0;
      for (++at; at < text.size() && (quote != 0 || text[at] != '>'); ++at) {
        if (quote != 0 ? text[at] == quote : (text[at] == '"' || text[at] == '\''))
          quote = quote != 0 ? 0 : text[at];
      }
      if (at < text.size() && text[at - 1] == '/') --depth;
    }
  }
  return 0;
}

/// Line of the first byte that is no text in UTF-8, or 0. TinyXML 2.6.2 reads past the end of a text that is
/// cut within a character, and stops at a zero byte without a word.
long line_of_no_text(std::string_view text) {
  long line = 1;
  for (std::size_t at = 0; at < text.size();) {
    const auto byte = static_cast<unsigned char>(text[at]);
    const std::size_t length = byte < 0x80                   ? 1
                               : byte >= 0xC2 && byte < 0xE0 ? 2
                               : byte >= 0xE0 && byte < 0xF0 ? 3
                               : byte >= 0xF0 && byte < 0xF5 ? 4
                                                             : 0;
    if (byte == 0 || length == 0 || text.size() - at < length) return line;
    for (std::size_t i = 1; i < length; ++i) {
      if ((static_cast<unsigned char>(text[at + i]) & 0xC0U) != 0x80) return line;
    }
    if (byte == '\n') ++line;
    at += length;
  }
  return 0;
}

class ArmReader {
 public:
  explicit ArmReader(const std::filesystem::path& file) : file_(file.string()) {}

  UrdfArm read(const std::string& base_link, const std::string& flange_link) {
    UrdfArm result;
    result.text = read_text();
    const urdf::ModelInterfaceSharedPtr model = parse(result.text);
    require_link(*model, base_link);
    require_link(*model, flange_link);
    const std::vector<const urdf::Joint*> chain = chain_of(*model, base_link, flange_link);
    result.arm = arm_of(chain, base_link, flange_link);
    refuse_joints_off_chain(*model, chain, base_link, flange_link);
    result.links = links_of(*model, result.arm, base_link);
    return result;
  }

  std::string read_valid_text() {
    const std::string text = read_text();
    parse(text);
    return text;
  }

 private:
  [[noreturn]] void refuse(const std::string& reason) const { throw UrdfError(file_ + ": " + reason); }

  std::string read_text() const {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file_, error)) refuse("there is no such file");
    std::ifstream in(file_, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (in.bad() || !in.is_open()) refuse("the file cannot be read");
    return text;
  }

  urdf::ModelInterfaceSharedPtr parse(const std::string& text) const {
    if (const long line = line_nested_too_deep(text)) {
      refuse("line " + std::to_string(line) + ": elements are nested deeper than " +
             std::to_string(kDeepestNesting));
    }
    if (const long line = line_of_no_text(text))
      refuse("line " + std::to_string(line) +
             ": there are bytes that are no text in UTF-8, which it must be");
    // urdfdom keeps the place of a syntax error to itself, so the same XML reader is asked first.
    TiXmlDocument document;
    document.Parse(text.c_str(), nullptr, TIXML_ENCODING_UTF8);
    if (document.Error()) {
      refuse("line " + std::to_string(document.ErrorRow()) + ", column " +
             std::to_string(document.ErrorCol()) + ": not well-formed XML: " + document.ErrorDesc());
    }
    require_tree(document);
    ComplaintCollector collector;
    urdf::ModelInterfaceSharedPtr model;
    try {
      model = urdf::parseURDF(text);
    } catch (const std::exception& error) {
      refuse(std::string("not a valid URDF: ") + error.what());
    }
    if (!model || !collector.complaints().empty()) {
      refuse("not a valid URDF: " +
             (collector.complaints().empty() ? std::string("no reason given") : collector.complaints()));
    }
    return model;
  }

  /// Looked at before urdfdom does: it keeps only the last parent of a link that has several, and never frees
  /// links that form a ring.
  void require_tree(const TiXmlDocument& document) const {
    struct Above {
      std::string joint, parent;
    };
    std::map<std::string, Above> above;  // by child link
    const TiXmlElement* robot = document.FirstChildElement("robot");
    const TiXmlElement* element = robot != nullptr ? robot->FirstChildElement("joint") : nullptr;
    for (; element != nullptr; element = element->NextSiblingElement("joint")) {
      const std::string joint = text_of(element, "name");
      const std::string child = text_of(element->FirstChildElement("child"), "link");
      if (child.empty()) continue;  // urdfdom tells
      const Above entry{joint, text_of(element->FirstChildElement("parent"), "link")};
      const auto [there, added] = above.emplace(child, entry);
      if (added) continue;
      refuse("link '" + child + "' is the child of two joints, '" + there->second.joint + "' and '" + joint +
             "'; an arm is a chain without loops");
    }
    std::map<std::string, std::string> seen_from;  // link -> where the walk up that met it first began
    for (const auto& [start, unused] : above) {
      for (std::string link = start; above.count(link) != 0; link = above[link].parent) {
        const auto [there, added] = seen_from.emplace(link, start);
        if (added) continue;
        if (there->second != start) break;  // an earlier walk went on from here and came to an end
        refuse("the joints above link '" + link + "' lead back to it, by joint '" + above[link].joint +
               "'; an arm is a chain without loops");
      }
    }
  }

  void require_link(const urdf::ModelInterface& model, const std::string& link) const {
    if (model.getLink(link)) return;
    std::string names;
    for (const auto& [name, unused] : model.links_) names += (names.empty() ? "" : ", ") + name;
    refuse("there is no link '" + link + "'; the file has the links " + names);
  }

  std::vector<const urdf::Joint*> chain_of(const urdf::ModelInterface& model, const std::string& base_link,
                                           const std::string& flange_link) const {
    std::vector<const urdf::Joint*> chain;
    std::string link = flange_link;
    while (link != base_link) {
      const urdf::LinkConstSharedPtr here = model.getLink(link);
      if (!here->parent_joint) {
        refuse("link '" + flange_link + "' is not below link '" + base_link +
               "': the chain of parents ends at '" + link + "'");
      }
      chain.push_back(here->parent_joint.get());
      link = here->parent_joint->parent_link_name;
    }
    std::reverse(chain.begin(), chain.end());
    return chain;
  }

  void refuse_joints_off_chain(const urdf::ModelInterface& model,
                               const std::vector<const urdf::Joint*>& chain, const std::string& base_link,
                               const std::string& flange_link) const {
    for (const auto& [name, joint] : model.joints_) {
      if (joint->type == urdf::Joint::FIXED) continue;
      if (std::find(chain.begin(), chain.end(), joint.get()) != chain.end()) continue;
      refuse("joint '" + name + "' (" + std::string(type_name(joint->type)) +
             ") moves but is not on the chain from '" + base_link + "' to '" + flange_link +
             "'; an arm is one chain, so branches may only be fixed");
    }
  }

  ArmModel arm_of(const std::vector<const urdf::Joint*>& chain, const std::string& base_link,
                  const std::string& flange_link) const {
    ArmModel arm;
    Pose X_PJ;  // from the last moving link (or the base) to the joint at hand, over the fixed joints in
                // between
    for (const urdf::Joint* joint : chain) {
      X_PJ = X_PJ * pose_of(*joint);
      if (joint->type == urdf::Joint::FIXED) continue;
      if (arm.joint_count() == kMaxJoints) {
        refuse("joint '" + joint->name + "' is moving joint number " + std::to_string(kMaxJoints + 1) +
               " of the chain; at most " + std::to_string(kMaxJoints) + " are allowed");
      }
      arm.joints.push_back(joint_of(*joint));
      arm.joints.back().X_PJ = X_PJ;
      X_PJ = Pose{};
    }
    if (arm.joints.empty()) {
      refuse("the chain from '" + base_link + "' to '" + flange_link + "' has no moving joint");
    }
    arm.X_JF = X_PJ;
    return arm;
  }

  /// Every link of the file: only the joints of the chain move.
  std::vector<RobotLink> links_of(const urdf::ModelInterface& model, const ArmModel& arm,
                                  const std::string& base_link) const {
    std::vector<RobotLink> links{{base_link, -1, {}}};
    const auto known = [&](const std::string& name) {
      return std::any_of(links.begin(), links.end(), [&](const RobotLink& l) { return l.name == name; });
    };
    // What carries the base is fixed to it too.
    for (urdf::LinkConstSharedPtr here = model.getLink(base_link); here->parent_joint;) {
      const RobotLink& below = links.back();
      links.push_back(
          {here->parent_joint->parent_link_name, -1, below.X_JL * pose_of(*here->parent_joint).inverse()});
      here = model.getLink(links.back().name);
    }
    for (std::size_t i = 0; i < links.size(); ++i) {
      const RobotLink from = links[i];
      for (const urdf::JointSharedPtr& joint : model.getLink(from.name)->child_joints) {
        if (known(joint->child_link_name)) continue;
        const auto moving = std::find_if(arm.joints.begin(), arm.joints.end(),
                                         [&](const JointModel& j) { return j.name == joint->name; });
        if (moving != arm.joints.end()) {
          links.push_back({joint->child_link_name, static_cast<int>(moving - arm.joints.begin()), {}});
        } else {
          links.push_back({joint->child_link_name, from.joint, from.X_JL * pose_of(*joint)});
        }
      }
    }
    return links;
  }

  Pose pose_of(const urdf::Joint& joint) const {
    const urdf::Pose& origin = joint.parent_to_joint_origin_transform;
    const Vec3 p(origin.position.x, origin.position.y, origin.position.z);
    const Quat q(origin.rotation.w, origin.rotation.x, origin.rotation.y, origin.rotation.z);
    if (!p.allFinite() || !q.coeffs().allFinite()) {
      refuse("joint '" + joint.name + "': its origin is not finite");
    }
    return Pose::from_quaternion(p, q.normalized());
  }

  JointModel joint_of(const urdf::Joint& joint) const {
    const std::string who = "joint '" + joint.name + "' (" + std::string(type_name(joint.type)) + ")";
    JointModel result;
    result.name = joint.name;
    switch (joint.type) {
      case urdf::Joint::REVOLUTE:
      case urdf::Joint::CONTINUOUS:
        result.type = JointType::revolute;
        break;
      case urdf::Joint::PRISMATIC:
        result.type = JointType::prismatic;
        break;
      default:
        refuse(who +
               ": the type is not allowed in an arm; allowed are revolute, continuous, prismatic, fixed");
    }
    if (joint.mimic) {
      refuse(who + ": it mimics joint '" + joint.mimic->joint_name + "'; joints of an arm move on their own");
    }
    const Vec3 axis(joint.axis.x, joint.axis.y, joint.axis.z);
    if (!axis.allFinite() || !(axis.norm() > 1e-6)) {
      refuse(who + ": its axis (" + text_of(axis.x()) + ", " + text_of(axis.y()) + ", " + text_of(axis.z()) +
             ") has no direction; a finite, non-zero vector is needed");
    }
    result.axis = axis.normalized();
    if (!joint.limits)
      refuse(who + ": it has no <limit> element; lower, upper, velocity and effort are needed");
    const bool continuous = joint.type == urdf::Joint::CONTINUOUS;
    result.lower = continuous ? -2.0 * std::numbers::pi : joint.limits->lower;
    result.upper = continuous ? 2.0 * std::numbers::pi : joint.limits->upper;
    result.max_velocity = joint.limits->velocity;
    result.max_effort = joint.limits->effort;
    if (!std::isfinite(result.lower) || !std::isfinite(result.upper) || !std::isfinite(result.max_velocity) ||
        !std::isfinite(result.max_effort)) {
      refuse(who + ": its limits are not finite");
    }
    if (!(result.lower < result.upper)) {
      refuse(who + ": its lower limit " + text_of(result.lower) + " is not below its upper limit " +
             text_of(result.upper));
    }
    if (!(result.max_velocity > 0.0)) {
      refuse(who + ": its velocity limit is " + text_of(result.max_velocity) + "; it must be greater than 0");
    }
    if (!(result.max_effort >= 0.0)) {
      refuse(who + ": its effort limit is " + text_of(result.max_effort) + "; it must not be negative");
    }
    return result;
  }

  std::string file_;
};

}  // namespace

UrdfArm read_urdf_arm(const std::filesystem::path& file, const std::string& base_link,
                      const std::string& flange_link) {
  return ArmReader(file).read(base_link, flange_link);
}

std::string read_urdf_text(const std::filesystem::path& file) {
  return ArmReader(file).read_valid_text();
}

}  // namespace takt
