#pragma once
// Folders in which the packages of ROS that robot descriptions name are searched.
#include <filesystem>
#include <string>
#include <vector>

namespace takt::command_line {

/// Help of the option --packages.
inline constexpr const char* kPackagesHelp =
    "folder in which package://PACKAGE/... of URDF files is searched: a package, a folder of packages, or a "
    "prefix "
    "with packages below share; those of AMENT_PREFIX_PATH, ROS_PACKAGE_PATH, GZ_SIM_RESOURCE_PATH "
    "and GAZEBO_MODEL_PATH follow";

/// `named`, then the existing folders of AMENT_PREFIX_PATH, ROS_PACKAGE_PATH, GZ_SIM_RESOURCE_PATH and GAZEBO_MODEL_PATH
/// (lists with colons).
std::vector<std::filesystem::path> package_folders(const std::vector<std::string>& named);

/// The same, then where Gazebo keeps models that it fetched, as far as there are such folders: GZ_FUEL_CACHE_PATH, and in
/// HOME .gz/fuel, .ignition/fuel (caches of Fuel) and .gazebo/models.
std::vector<std::filesystem::path> model_folders(const std::vector<std::string>& named);

}  // namespace takt::command_line
