#include "idl/command_line/package_folders.h"

#include <cstdlib>
#include <sstream>
#include <system_error>

namespace takt::command_line {

std::vector<std::filesystem::path> package_folders(const std::vector<std::string>& named) {
  std::vector<std::filesystem::path> folders(named.begin(), named.end());
  for (const char* variable :
       {"AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH", "GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH"}) {
    const char* value = std::getenv(variable);
    std::istringstream list(value != nullptr ? value : "");
    std::error_code error;
    for (std::string folder; std::getline(list, folder, ':');)
      if (!folder.empty() && std::filesystem::is_directory(folder, error)) folders.emplace_back(folder);
  }
  return folders;
}

std::vector<std::filesystem::path> model_folders(const std::vector<std::string>& named) {
  std::vector<std::filesystem::path> folders = package_folders(named);
  const auto add = [&](const char* variable, const char* inside) {
    const char* value = std::getenv(variable);
    if (value == nullptr || *value == '\0') return;
    const std::filesystem::path folder = std::filesystem::path(value) / inside;
    std::error_code error;
    if (std::filesystem::is_directory(folder, error)) folders.push_back(folder);
  };
  add("GZ_FUEL_CACHE_PATH", "");
  for (const char* inside : {".gz/fuel", ".ignition/fuel", ".gazebo/models"}) add("HOME", inside);
  return folders;
}

}  // namespace takt::command_line
