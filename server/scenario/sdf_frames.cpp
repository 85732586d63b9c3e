#include "server/scenario/sdf_frames.h"

namespace takt {

namespace {

constexpr std::size_t kMostFrames = 100'000;
constexpr std::size_t kDeepest = 1000;  ///< of frames that are relative to each other

}  // namespace

SdfFrames::SdfFrames() : frames_(1), scopes_(1) {
  frames_[0].name = kWorldName;
}

void SdfFrames::fail(const Node& node, const std::string& reason) const {
  node.file->fail(*node.element, "frame '" + node.name + "': " + reason);
}

SdfFrames::Scope SdfFrames::add_scope(Scope above, const std::string& name, const XmlFile& file,
                                      const XmlFile::Element& element) {
  const Frame own = add(above, name, file, element);
  scopes_.push_back({own, above, {}, {}});
  const Scope scope = scopes_.size() - 1;
  scopes_[above].models[name] = scope;
  frames_[own].inside = scope;
  return scope;
}

SdfFrames::Frame SdfFrames::add(Scope scope, const std::string& name, const XmlFile& file,
                                const XmlFile::Element& element) {
  if (name == "__model__" || name == "__root__" || (name.starts_with("__") && name.ends_with("__")))
    file.fail(element, "<" + XmlFile::name(element) + ">: name: found '" + name +
                           "', a name of the format itself; allowed: another one");
  if (frames_.size() == kMostFrames)
    file.fail(element, "<" + XmlFile::name(element) + ">: found more than " + std::to_string(kMostFrames) +
                           " links, joints, frames and models, those of included files counted each time");
  if (!scopes_[scope].frames.emplace(name, frames_.size()).second)
    file.fail(element,
              "<" + XmlFile::name(element) + ">: name: found '" + name +
                  "' a second time; names of links, joints, frames and models must be unique in their model");
  Node node;
  node.name = name, node.file = &file, node.element = &element, node.usual = own(scope);
  frames_.push_back(std::move(node));
  return frames_.size() - 1;
}

void SdfFrames::place(Frame frame, const Pose& X_PF, Scope scope, const std::string& relative_to,
                      Frame usual) {
  Node& node = frames_[frame];
  node.X_PF = X_PF, node.usual = usual;
  if (!relative_to.empty()) node.relative_to = {scope, relative_to};
}

void SdfFrames::attach(Frame frame, Scope scope, const std::string& to) {
  frames_[frame].attached_to = {scope, to};
}

SdfFrames::Frame SdfFrames::find(Scope scope, const std::string& name, const XmlFile& file,
                                 const XmlFile::Element& element) const {
  const auto unknown = [&]() {
    std::string known;
    for (const auto& [other, frame] : scopes_[scope].frames) known += (known.empty() ? "" : ", ") + other;
    file.fail(element, "<" + XmlFile::name(element) + ">: found '" + name +
                           "', which is no frame here; allowed: " + (known.empty() ? "none" : known));
  };
  if (name == kWorldName && scope == kWorldNames) return kWorld;
  Scope at = scope;
  std::string rest = name;
  for (;;) {
    if (rest == "__model__" && at != kWorldNames) return scopes_[at].own;
    if (const auto frame = scopes_[at].frames.find(rest); frame != scopes_[at].frames.end())
      return frame->second;
    // The longest name of a nested model that begins the rest: names of old files have :: in them.
    bool inside = false;
    for (std::size_t end = rest.rfind("::"); end != rest.npos && end > 0; end = rest.rfind("::", end - 1)) {
      const auto model = scopes_[at].models.find(rest.substr(0, end));
      if (model == scopes_[at].models.end()) continue;
      at = model->second, rest = rest.substr(end + 2), inside = true;
      break;
    }
    if (!inside) unknown();
  }
}

void SdfFrames::merge(Scope into, Scope from) {
  const Names& names = scopes_[from];
  scopes_[into].frames.insert(names.frames.begin(), names.frames.end());
  scopes_[into].models.insert(names.models.begin(), names.models.end());
}

SdfFrames::Frame SdfFrames::parent(const Node& node) const {
  return node.relative_to ? find(node.relative_to->scope, node.relative_to->name, *node.file, *node.element)
                          : node.usual;
}

Pose SdfFrames::pose_in(Frame frame, Frame base, std::size_t depth) const {
  if (frame == base) return {};
  const Node& node = frames_[frame];
  if (frame == kWorld) fail(frames_[base], "its pose is not relative to its model");
  if (depth > kDeepest)
    fail(node, "its pose is relative to itself by other frames, or by more than " + std::to_string(kDeepest) +
                   " of them; allowed: frames that lead to the world");
  Pose X = node.X_PF;
  if (node.placed) {
    if (!node.X_FP) {  // else the way to a frame doubles with each model around it
      const Frame placed = find(node.placed->scope, node.placed->name, *node.file, *node.element);
      node.X_FP = pose_in(placed, frame, depth + 1);
    }
    X = X * node.X_FP->inverse();
  }
  return pose_in(parent(node), base, depth + 1) * X;
}

std::optional<std::size_t> SdfFrames::link_of(Frame frame) const {
  for (std::size_t steps = 0; steps <= frames_.size(); ++steps) {
    const Node& node = frames_[frame];
    if (frame == kWorld || node.link) return node.link;
    if (node.attached_to && !node.attached_to->name.empty()) {
      frame = find(node.attached_to->scope, node.attached_to->name, *node.file, *node.element);
    } else if (node.attached_to) {
      frame = own(node.attached_to->scope);
    } else {
      fail(node, "it is attached to no link");
    }
  }
  fail(frames_[frame], "it is attached to itself, by other frames");
}

}  // namespace takt
