#pragma once
// The fields of a section of a scenario file, described once. Reading with checks and errors, defaults,
// writing back, the JSON Schema for editors and the reference page all follow from the description.
//
// The description of a section is a function that names every key with its member, its rule, one sentence and
// flags, in the style of a serialisation archive:
//
//   void describe(Fields& f, ScenarioScrewdriver& s) {
//     f.field("gripper", s.gripper, f.name_of("grippers", "a gripper"), "...", kRequired);
//     f.field("reach_m", s.reach_m, positive("m"), "...");
//   }
//
// The default of a key is the initialiser of the member. Fields runs the function in one of four passes:
// `read` fills the members from YAML; `defaults` notes the values of a default-constructed struct; `write`
// gives a YAML tree of the values that differ from them; `info` collects KeyInfo. A description that depends
// on an earlier value uses when(), so that `info` visits all branches; check() acts in `read` alone.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/fields/rules.h"

namespace takt {

// Flags of a key, joined by |.
inline constexpr unsigned kRequired = 1;       ///< an error without it
inline constexpr unsigned kNotInModel = 2;     ///< does not enter the model hash
inline constexpr unsigned kAlwaysWritten = 4;  ///< written even where it has the default
inline constexpr unsigned kNamesTopics = 8;    ///< of entries: their names become levels of topics

template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;

class Fields {
 public:
  /// Pass `read`. Throws ScenarioError if the node is no mapping.
  Fields(const YamlSource& source, const YAML::Node& root);
  /// Pass `write`; paths are written relative to `directory`.
  explicit Fields(std::filesystem::path directory);
  /// Pass `info`.
  Fields();

  bool reading() const { return pass_ == Pass::read; }
  bool writing() const { return pass_ == Pass::write || pass_ == Pass::defaults; }
  bool informing() const { return pass_ == Pass::info; }

  /// One key. A member of type std::optional is unset without the key.
  template <class T, class Rule>
  void field(const char* key, T& member, const Rule& rule, const char* doc, unsigned flags = 0) {
    if constexpr (kIsOptional<T>) {
      if (const auto value = reading() ? find(key) : std::nullopt) rule.read(*value, member.emplace());
      if (writing() && member) put(key, rule.write(*member), kAlwaysWritten);
      if (pass_ == Pass::info) add(key, rule.info(), doc, flags, {});
    } else {
      if (pass_ == Pass::read) {
        if (const auto value = find(key))
          rule.read(*value, member);
        else if ((flags & kRequired) != 0)
          fail(key, "nothing (the key is missing)", rule.allowed());
      }
      if (writing()) put(key, rule.write(member), flags);
      if (pass_ == Pass::info)
        add(key, rule.info(), doc, flags, (flags & kRequired) != 0 ? YAML::Node() : rule.write(member));
    }
  }
  /// A mapping whose keys `body` describes.
  template <class Body>
  void section(const char* key, const char* doc, const Body& body, unsigned flags = 0) {
    begin(key, key, doc, flags);
    body();
    end();
  }
  /// A mapping that describe(Fields&, S&) describes; `shared` is the name of a section used in several
  /// places.
  template <class S, class = decltype(describe(std::declval<Fields&>(), std::declval<S&>()))>
  void section(const char* key, const char* doc, S& member, unsigned flags = 0, const char* shared = "") {
    begin(key, key, doc, flags, shared);
    describe(*this, member);
    end();
  }
  /// Unset without the key.
  template <class S, class Describe>
  void section(const char* key, const char* doc, std::optional<S>& member, const Describe& describe_it) {
    if (informing() || (reading() && find(key))) member.emplace();
    if (!member) return;
    if (pass_ == Pass::write) {
      note_defaults([&] {
        S usual{};
        section(key, doc, [&] { describe_it(usual); });
      });
    }
    section(
        key, doc, [&] { describe_it(*member); }, kAlwaysWritten);
  }
  /// User-chosen names, each with a mapping; S::name is the name. `fresh` makes an item, `describe_item`
  /// describes one.
  template <class S, class Make, class Describe>
  void entries(const char* key, std::vector<S>& items, const char* doc, const char* item_doc, unsigned flags,
               const Make& fresh, const Describe& describe_item) {
    const auto entry = [&](const std::string& name, S& item, const char* said, unsigned entry_flags) {
      begin(name.c_str(), "*", said, entry_flags);
      describe_item(item);
      end();
    };
    if (const auto value = reading() ? find(key) : std::nullopt;
        value && !value->node.IsNull() && !value->node.IsMap())
      value->fail(describe_node(value->node), "a mapping of names to mappings");
    begin(key, key, doc, flags);
    if (informing()) {
      S item = fresh();
      entry("*", item, item_doc, 0);
    }
    if (reading()) {
      for (const std::string& name : names_in()) {
        S& item = items.emplace_back(fresh());
        item.name = name;
        entry(name, item, "", 0);
        names_.emplace_back(key, name);
      }
    }
    if (pass_ == Pass::write) {
      for (S& item : items) {
        note_defaults([&] {
          S usual = fresh();
          entry(item.name, usual, "", 0);
        });
        entry(item.name, item, "", kAlwaysWritten);
      }
    }
    end();
  }
  template <class S>
  void entries(const char* key, std::vector<S>& items, const char* doc, const char* item_doc,
               unsigned flags = 0) {
    entries(
        key, items, doc, item_doc, flags, [] { return S{}; }, [this](S& item) { describe(*this, item); });
  }
  /// A list of mappings.
  template <class S>
  void list(const char* key, std::vector<S>& items, const char* doc, const char* what, unsigned flags = 0) {
    if (pass_ == Pass::read) {
      for (const YAML::Node& node : nodes_in(key, what)) {
        begin_element(key, node);
        describe(*this, items.emplace_back());
        end();
      }
    }
    if (pass_ == Pass::write) {
      for (S& item : items) {
        note_defaults([&] {
          S usual{};
          section(key, "", usual);
        });
        begin_element(key, {});
        describe(*this, item);
        end();
      }
    }
    if (pass_ == Pass::info) {
      S fresh{};
      KeyInfo whole{.kind = KeyInfo::Kind::list};
      begin(key, key, "", 0);
      describe(*this, fresh);
      whole.items = {take_info()};
      add(key, std::move(whole), doc, flags, {});
    }
  }
  /// Keys that are allowed only where `word_key` has one of these values.
  template <class Value, class Body>
  void when(const char* word_key, const Choice<Value>& rule, const Value& value, std::vector<Value> wanted,
            const Body& body) {
    const bool holds = std::find(wanted.begin(), wanted.end(), value) != wanted.end();
    if (pass_ == Pass::info) {
      KeyInfo& info = frames_.back().info;
      const std::size_t fields = info.items.size(), groups = info.alternatives.size();
      body();
      KeyInfo::Condition condition{word_key, {}, holds};
      for (const Value& one : wanted) condition.words.push_back(rule.word(one));
      for (std::size_t i = fields; i < info.items.size(); ++i) info.items[i].when = condition;
      for (std::size_t i = groups; i < info.alternatives.size(); ++i) info.alternatives[i].when = condition;
    } else if (holds) {
      body();
    }
  }
  /// A pose: position_m, and at most one of rpy_rad, rpy_deg, quaternion_xyzw, rotation_matrix.
  void pose(const char* key, Pose& pose, const char* doc, unsigned flags = 0);
  /// Angles under NAME_rad or NAME_deg; with kRequired under one of them. `count` 0: any number.
  void angles(const std::string& name, std::vector<double>& angles_rad, std::size_t count, const char* doc,
              unsigned flags);
  /// At least and at most this many of these keys are given; the texts are those of errors.
  void alternatives(const std::vector<std::string>& keys, std::size_t least, std::size_t most,
                    const std::string& place, const std::string& found, const std::string& allowed);
  /// Both keys are given or neither is.
  void together(const char* a, const char* b);

  /// A name of an entry of an earlier section.
  NameOf name_of(const std::vector<const char*>& sections, const char* what) const;
  ExistingFile file() const { return {directory_}; }
  ExistingMesh mesh() const { return {{directory_}}; }

  // Pass `read` alone.

  bool has(const std::string& key) const;
  /// The value of a key; marks the key as known.
  std::optional<FieldValue> find(const std::string& key);
  /// Fails unless `good`. `key` empty: the section itself.
  void check(bool good, const std::string& key, const std::string& found, const std::string& allowed) const {
    if (reading() && !good) fail(key, found, allowed);
  }
  [[noreturn]] void fail(const std::string& key, const std::string& found, const std::string& allowed) const;
  /// "file:line:column: dotted.key" of a key, for a later error message; empty in other passes.
  std::string place(const std::string& key) const;
  const std::string& path() const { return frames_.back().path; }
  /// (section, name) of all entries read so far.
  const std::vector<std::pair<std::string, std::string>>& names() const { return names_; }
  void add_name(const std::string& section, const std::string& name) { names_.emplace_back(section, name); }

  /// Ends the pass at the root: unknown keys fail.
  void finish();
  YAML::Node take_written();
  KeyInfo take_info();

  // Pass `info` alone: more about the field described last.

  /// Another form of its value.
  void or_else(KeyInfo form) {
    if (informing()) frames_.back().info.items.back().other_forms.push_back(std::move(form));
  }
  /// The key is required if this other key has one of these words.
  void required_for(const char* word_key, std::vector<std::string> words) {
    if (!informing()) return;
    frames_.back().info.items.back().required_key = word_key;
    frames_.back().info.items.back().required_for = std::move(words);
  }

  /// Pass `write`: true if all fields described by `body` have their defaults.
  template <class Body>
  void note_defaults(const Body& body) {
    pass_ = Pass::defaults;
    body();
    pass_ = Pass::write;
  }

 private:
  enum class Pass { read, defaults, write, info };
  struct Frame {
    YAML::Node node;   ///< read
    std::string path;  ///< dotted; `generic`: with * for names
    std::string generic;
    std::vector<std::string> known{};
    YAML::Node written{};
    bool always = false, element = false;
    std::string key{};
    KeyInfo info{};
  };

  void begin(const char* key, const char* generic, const char* doc, unsigned flags, const char* shared = "");
  void begin_element(const char* key, const YAML::Node& node);
  void end();
  void put(const std::string& key, const YAML::Node& value, unsigned flags);
  void add(const std::string& key, KeyInfo info, const char* doc, unsigned flags, const YAML::Node& fallback);
  FieldValue here(const std::string& key) const;
  std::vector<std::string> names_in() const;
  std::vector<YAML::Node> nodes_in(const char* key, const char* what);
  void check_keys() const;

  Pass pass_;
  YamlSource source_;
  std::filesystem::path directory_;
  std::vector<Frame> frames_;
  std::map<std::string, std::string> defaults_;  ///< by generic path: as text
  std::vector<std::pair<std::string, std::string>> names_;
};

}  // namespace takt
