#pragma once
// The XML files of an SSP: elements with errors that name file and line, units, parameter sets and their mappings.
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/devices/fmu_link.h"

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace takt::ssp {

using tinyxml2::XMLElement;

/// An XML file of the SSP, and errors with its name and lines.
class SspXml {
 public:
  /// Throws FmuError: too large, or no XML.
  SspXml(const std::filesystem::path& directory, const std::string& name);
  ~SspXml();

  const XMLElement& root(std::string_view expected) const;
  const std::string& name() const { return name_; }

  [[noreturn]] void fail(const XMLElement& at, const std::string& found, const std::string& allowed) const;
  std::string place(const XMLElement& at) const;
  /// Without its prefix.
  static std::string_view local_name(const XMLElement& element);
  /// Of an attribute; empty without it.
  static std::string text(const XMLElement& element, const char* attribute);
  std::string required(const XMLElement& element, const char* attribute) const;
  double number(const XMLElement& element, const char* attribute, double usual) const;
  bool flag(const XMLElement& element, const char* attribute) const;
  /// Calls visit(child, local name) for the children with these names; passes over pictures and annotations; refuses others.
  void children(const XMLElement& element, const std::vector<std::string_view>& names,
                const std::function<void(const XMLElement&, std::string_view)>& visit) const;

 private:
  std::string name_;
  std::unique_ptr<tinyxml2::XMLDocument> document_;
};

/// Some tools write [m] for m.
std::string unit_name(const std::string& stated);

/// By name; of an element Units.
std::map<std::string, FmuUnit> read_units(const SspXml& file, const XMLElement& units);

/// Values by name.
using Values = std::map<std::string, FmuRequest::Value>;

/// Adds the values of a ParameterSet, under their names behind the prefix.
void read_parameter_set(const SspXml& file, const XMLElement& set, const std::string& prefix, Values& values);

/// By the linear transformation that the element may have; it gives the unit of the target.
void transform(const SspXml& file, const XMLElement& element, FmuRequest::Value& value);

/// Values under the names that the mapping gives them; what it does not name has no effect.
Values mapped(const SspXml& file, const XMLElement& mapping, const Values& values);

}  // namespace takt::ssp
