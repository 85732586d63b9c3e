#include "client_lib/view/robot_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

#include "idl/common/ros_packages.h"
#include "idl/common/text.h"

namespace takt::view {
namespace {

/// Percent-encoded bytes; nothing for what is none, and for a byte 0.
std::optional<std::string> decoded(std::string_view text) {
  std::string result;
  const auto digit = [](char c) {
    constexpr std::string_view digits = "0123456789abcdef";
    const auto at = digits.find(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
    return at == std::string_view::npos ? -1 : static_cast<int>(at);
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result.push_back(text[i]);
      continue;
    }
    const int high = i + 2 < text.size() ? digit(text[i + 1]) : -1, low = high < 0 ? -1 : digit(text[i + 2]);
    if (low < 0 || (high == 0 && low == 0)) return std::nullopt;
    result.push_back(static_cast<char>(16 * high + low));
    i += 2;
  }
  return result;
}

bool is_drawable(const std::filesystem::path& file) {
  constexpr std::array<std::string_view, 8> kinds{".stl", ".dae",  ".obj", ".png",
                                                  ".jpg", ".jpeg", ".tga", ".bmp"};
  const std::string kind = lower_text(file.extension().string());
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

}  // namespace

std::optional<std::filesystem::path> file_below(const std::filesystem::path& folder,
                                                const std::filesystem::path& file) {
  std::error_code problem, gone;
  const auto place = std::filesystem::canonical(file, problem),
             top = std::filesystem::canonical(folder, gone);
  if (problem || gone || !std::filesystem::is_regular_file(place, problem)) return std::nullopt;
  if (std::mismatch(top.begin(), top.end(), place.begin(), place.end()).first != top.end())
    return std::nullopt;
  return place;
}

RobotFiles::RobotFiles(const std::vector<std::filesystem::path>& folders) {
  for (const auto& folder : folders) folders_.push_back(std::filesystem::canonical(folder));
}

std::optional<std::filesystem::path> RobotFiles::allowed(const std::filesystem::path& file) const {
  for (const auto& folder : folders_)
    if (auto place = file_below(folder, file)) return is_drawable(*place) ? std::move(place) : std::nullopt;
  return std::nullopt;
}

std::optional<std::filesystem::path> RobotFiles::find(std::string_view address) const {
  std::vector<std::string> parts;
  while (!address.empty()) {
    const auto slash = address.find('/');
    auto part = decoded(address.substr(0, slash));
    if (!part) return std::nullopt;
    if (!part->empty() && *part != ".") parts.push_back(*part == "(up)" ? ".." : *std::move(part));
    address.remove_prefix(slash == std::string_view::npos ? address.size() : slash + 1);
  }
  if (parts.size() < 2) return std::nullopt;
  std::filesystem::path path;
  for (std::size_t i = 1; i < parts.size(); ++i) path /= parts[i];
  path = path.relative_path();
  if (parts[0] == "relative") {
    for (const auto& folder : folders_)
      if (auto file = allowed(folder / path)) return file;
    return std::nullopt;
  }
  if (parts[0] != "package" && parts[0] != "absolute") return std::nullopt;
  const std::string name = (parts[0] == "package" ? "package://" : "file:///") + path.generic_string();
  const auto file = find_mesh_file(name, {}, folders_);
  return file ? allowed(*file) : std::nullopt;
}

}  // namespace takt::view
