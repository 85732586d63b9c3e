#pragma once
// The frames of an SDFormat file by name, each relative to another one (SDFormat 1.7, "Pose frame semantics").
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plant_models/spatial.h"
#include "server/scenario/xml_file.h"

namespace takt {

class SdfFrames {
 public:
  using Frame = std::size_t;
  using Scope = std::size_t;  ///< names of a world or model

  static constexpr Frame kWorld = 0;
  static constexpr Scope kWorldNames = 0;
  static constexpr std::string_view kWorldName{"world"};

  SdfFrames();

  /// Names of a model in `above`, where it is called `name`; its own frame is __model__ there.
  Scope add_scope(Scope above, const std::string& name, const XmlFile& file, const XmlFile::Element& element);
  Frame own(Scope scope) const { return scopes_[scope].own; }

  /// The names of a model are also those of the scope that includes it by merge.
  void merge(Scope into, Scope from);

  bool has(Scope scope, const std::string& name) const { return scopes_[scope].frames.contains(name); }
  /// A frame of that name, which is unique in its scope. Its pose follows by place().
  Frame add(Scope scope, const std::string& name, const XmlFile& file, const XmlFile::Element& element);
  /// The pose is relative to the frame `relative_to` of the scope; empty: to `usual`.
  void place(Frame frame, const Pose& X_PF, Scope scope, const std::string& relative_to, Frame usual);
  /// The pose of a model is that of its frame `placed`.
  void place_by(Frame model, Scope inside, const std::string& placed) {
    frames_[model].placed = {inside, placed};
  }
  /// The frame moves with another one, of that name in the scope; empty: with the scope's own.
  void attach(Frame frame, Scope scope, const std::string& to);
  void set_link(Frame frame, std::size_t link) { frames_[frame].link = link; }
  /// Of a model: its first link.
  void set_link_once(Frame frame, std::size_t link) {
    if (!frames_[frame].link) frames_[frame].link = link;
  }

  /// Names of nested models lead to the frames in them: arm::tip. Throws for an unknown one.
  Frame find(Scope scope, const std::string& name, const XmlFile& file,
             const XmlFile::Element& element) const;
  /// Throws for frames that are relative to each other in a loop.
  Pose X_WF(Frame frame) const { return pose_in(frame, kWorld, 0); }
  Pose relative(Frame frame, Frame base) const { return X_WF(base).inverse() * X_WF(frame); }
  /// The link that a frame moves with; none: the world's. Of a model: its first link.
  std::optional<std::size_t> link_of(Frame frame) const;

 private:
  struct Named {
    Scope scope = 0;
    std::string name;
  };
  struct Node {
    std::string name;
    Pose X_PF;
    std::optional<Named> relative_to, attached_to, placed;
    mutable std::optional<Pose> X_FP;  ///< of the frame `placed`, once it is known
    Frame usual = kWorld;              ///< where relative_to is not stated
    std::optional<std::size_t> link;
    Scope inside = 0;  ///< of a model: its names
    const XmlFile* file = nullptr;
    const XmlFile::Element* element = nullptr;
  };
  struct Names {
    Frame own = kWorld;
    Scope above = 0;
    std::map<std::string, Frame> frames;
    std::map<std::string, Scope> models;
  };

  Pose pose_in(Frame frame, Frame base, std::size_t depth) const;
  Frame parent(const Node& node) const;
  [[noreturn]] void fail(const Node& node, const std::string& reason) const;

  std::vector<Node> frames_;
  std::vector<Names> scopes_;
};

}  // namespace takt
