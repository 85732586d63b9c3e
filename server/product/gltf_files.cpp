#include "server/product/gltf_files.h"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "idl/common/bounded_file.h"
#include "idl/common/uri.h"
#include "server/geometry/mesh/builder.h"
#include "server/geometry/mesh/glb_check.h"

namespace takt::product {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr int kDeepest = 200;  ///< lists and objects within each other

[[noreturn]] void fail(std::size_t buffer, const std::string& reason) {
  throw MeshFault("buffers[" + std::to_string(buffer) + "]: " + reason);
}

Json parsed(const std::string& text) {
  try {
    return Json::parse(text, [](int depth, Json::parse_event_t, Json&) {
      if (depth > kDeepest)
        throw MeshFault("its lists and objects are nested deeper than " + std::to_string(kDeepest) +
                        " levels");
      return true;
    });
  } catch (const Json::exception& error) {
    throw MeshFault(std::string("it cannot be understood: ") + error.what());
  }
}

/// Null: none.
Json* list_of(Json& document, const char* name) {
  if (!document.is_object()) throw MeshFault("it is no object of JSON");
  const auto found = document.find(name);
  if (found == document.end()) return nullptr;
  if (!found->is_array()) throw MeshFault(std::string(name) + " is no list");
  return &*found;
}

/// RFC 4648, section 4. `ok` becomes false for what is no base64.
std::string from_base64(std::string_view text, bool& ok) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const std::size_t digit = kDigits.find(c);
    ok = ok && digit != kDigits.npos;
    bits = (bits << 6U) | static_cast<std::uint32_t>(digit & 63U);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>((bits >> static_cast<unsigned>(count)) & 255U);
  }
  return bytes;
}

/// The file of a buffer, which lies in the folder of the description or below it.
std::string read_beside(const fs::path& file, std::size_t buffer, const std::string& uri,
                        std::size_t most_MB) {
  constexpr const char* kAllowed = "; allowed: a file in the folder of the glTF file or below it, or base64";
  const fs::path name = without_escapes(uri);
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(fs::absolute(file), error).parent_path();
  const fs::path beside = fs::weakly_canonical(folder / name, error);
  const auto [end, at] = std::mismatch(folder.begin(), folder.end(), beside.begin(), beside.end());
  if (error || name.is_absolute() || uri.find(':') != uri.npos || end != folder.end())
    fail(buffer, "its uri is '" + uri + "'" + kAllowed);
  if (!fs::is_regular_file(beside, error))
    fail(buffer, "its uri is '" + uri + "'; there is no such file beside the glTF file. Put it there");
  FileText read = read_bounded_file(beside, most_MB);
  if (!read.problem.empty()) fail(buffer, "'" + uri + "': " + read.problem);
  return std::move(read.text);
}

std::string content_of(const fs::path& file, std::size_t buffer, const Json& description,
                       std::size_t most_MB) {
  const auto uri = description.is_object() ? description.find("uri") : description.end();
  if (!description.is_object() || uri == description.end() || !uri->is_string())
    fail(buffer, "it has no uri; allowed: the name of a file, or data:...;base64,...");
  const std::string& text = uri->get_ref<const std::string&>();
  constexpr std::string_view kCode = ";base64,";
  if (!text.starts_with("data:")) return read_beside(file, buffer, text, most_MB);
  const std::size_t at = text.find(kCode);
  bool ok = at != text.npos;
  std::string bytes = ok ? from_base64(std::string_view(text).substr(at + kCode.size()), ok) : "";
  if (!ok) fail(buffer, "its uri is no base64; allowed: data:application/octet-stream;base64,...");
  return bytes;
}

}  // namespace

std::string glb_of_gltf(const fs::path& file, std::size_t most_MB) {
  const FileText description_text = read_bounded_file(file, most_MB);
  if (!description_text.problem.empty()) throw MeshFault(description_text.problem);
  Json document = parsed(description_text.text);
  std::string data;
  std::vector<std::size_t> starts;
  constexpr std::size_t kBytesOfMB = 1'000'000;
  if (const Json* buffers = list_of(document, "buffers"))
    for (const Json& description : *buffers) {
      const std::size_t buffer = starts.size();
      starts.push_back(data.size());
      const std::string content = content_of(file, buffer, description, most_MB);
      const auto length = description.find("byteLength");
      if (length == description.end() || !length->is_number_unsigned())
        fail(buffer, "its byteLength must be a whole number");
      if (length->get<std::uint64_t>() > content.size())
        fail(buffer, "its byteLength is " + length->dump() + ", but there are " +
                         std::to_string(content.size()) + " bytes");
      data += content.substr(0, length->get<std::size_t>());
      data.resize((data.size() + 7) / 8 * 8, '\0');
      if (data.size() > most_MB * kBytesOfMB)
        fail(buffer, "with those before it has more than " + std::to_string(most_MB) + " MB");
    }
  if (Json* views = list_of(document, "bufferViews"))
    for (std::size_t i = 0; i < views->size(); ++i) {
      Json& view = (*views)[i];
      const std::string place = "bufferViews[" + std::to_string(i) + "]";
      if (!view.is_object()) throw MeshFault(place + " is no object");
      const Json buffer = view.value("buffer", Json()), offset = view.value("byteOffset", Json(0U));
      if (!buffer.is_number_unsigned() || buffer.get<std::uint64_t>() >= starts.size())
        throw MeshFault(place + ": its buffer is " + buffer.dump() + ", there are " +
                        std::to_string(starts.size()));
      const std::size_t start = starts[buffer.get<std::size_t>()];
      const std::size_t end =
          buffer.get<std::size_t>() + 1 < starts.size() ? starts[buffer.get<std::size_t>() + 1] : data.size();
      const Json length = view.value("byteLength", Json());
      if (!offset.is_number_unsigned() || !length.is_number_unsigned() ||
          offset.get<std::uint64_t>() > end - start ||
          length.get<std::uint64_t>() > end - start - offset.get<std::uint64_t>())
        throw MeshFault(place + ": byteOffset " + offset.dump() + " and byteLength " + length.dump() +
                        " must lie in the buffer");
      view["byteOffset"] = start + offset.get<std::uint64_t>();
      view["buffer"] = 0;
    }
  document["buffers"] = Json::array({{{"byteLength", data.size()}}});
  std::string json;
  try {
    json = document.dump();
  } catch (const Json::exception& error) {  // bytes that are not UTF-8
    throw MeshFault(std::string("it cannot be understood: ") + error.what());
  }
  return glb_bytes(std::move(json), data);
}

}  // namespace takt::product
