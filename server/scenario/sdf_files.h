#pragma once
// The files of an SDFormat world: those of included models and of meshes, by the addresses that it names them with.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/scenario/sdf_world.h"
#include "server/scenario/xml_file.h"

namespace takt {

class SdfFiles {
 public:
  explicit SdfFiles(const SdfOptions& options) : options_(options) {}

  /// Each file is read once and kept. Throws DescriptionError.
  const XmlFile& open(const std::filesystem::path& file);
  /// Of the file's <sdf>. Throws for files that are not SDFormat 1.x.
  static double version(const XmlFile& file);

  /// The SDFormat file of an included model: a file, or a folder with model.config or model.sdf, as model://NAME,
  /// package://NAME, file://PATH, PATH relative to `file`, or https://HOST/.../models/NAME, of which a copy below the
  /// packages is used, or the one in a cache of Gazebo Fuel that is among them. None: it is missing, and SdfOptions::leave_out_missing. Throws if it is missing.
  std::optional<std::filesystem::path> model(const XmlFile& file, const XmlFile::Element& element,
                                             const std::string& uri);
  /// The same for a mesh file.
  std::optional<std::filesystem::path> mesh(const XmlFile& file, const XmlFile::Element& element,
                                            const std::string& uri);

  void note(const XmlFile& file, const XmlFile::Element& element, const std::string& sentence) {
    notes_.push_back(place_in(file.file(), XmlFile::line(element)) + sentence + ".");
  }
  /// Of what is left out or read in another way, one sentence each.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  std::optional<std::filesystem::path> missing(const XmlFile& file, const XmlFile::Element& element,
                                               const std::string& uri);

  SdfOptions options_;
  std::vector<std::unique_ptr<XmlFile>> files_;
  std::vector<std::string> notes_;
};

}  // namespace takt
