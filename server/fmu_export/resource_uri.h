#pragma once
// The folder of resources as FMI 2.0 names it: a URI.
#include <filesystem>
#include <string>

namespace takt {

/// file:///a%20b and file:/a%20b are /a b; a path stays as it is.
inline std::filesystem::path path_of_uri(std::string uri) {
  if (!uri.starts_with("file:")) return uri;
  uri.erase(0, 5);
  if (uri.starts_with("//")) uri.erase(0, uri.find('/', 2) == std::string::npos ? 2 : uri.find('/', 2));
  std::string path;
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
  };
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
      path += static_cast<char>(16 * digit(uri[i + 1]) + digit(uri[i + 2]));
      i += 2;
    } else {
      path += uri[i];
    }
  }
  return path;
}

}  // namespace takt
