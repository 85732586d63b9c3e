// Where the commands search packages and models: variables of the environment, and the caches of Gazebo.
#include <gmock/gmock.h>

#include <array>
#include <cstdlib>
#include <optional>

#include "idl/command_line/package_folders.h"
#include "tests/support/temporary_directory.h"

namespace takt::command_line {
namespace {

using testing::ElementsAre;

/// Sets variables of the environment, and sets them back.
class Environment {
 public:
  ~Environment() {
    for (const auto& [name, value] : before_) value ? ::setenv(name, value->c_str(), 1) : ::unsetenv(name);
  }
  void set(const char* name, const std::string& value) {
    const char* before = std::getenv(name);
    before_.emplace_back(name, before != nullptr ? std::optional<std::string>(before) : std::nullopt);
    ::setenv(name, value.c_str(), 1);
  }

 private:
  std::vector<std::pair<const char*, std::optional<std::string>>> before_;
};

TEST(ModelFolders, AreThoseThatAreNamedThenThoseOfTheEnvironmentThenTheCaches) {
  const test::TemporaryDirectory directory;
  const auto make = [&](const std::string& folder) {
    std::filesystem::create_directories(directory / folder);
    return (directory / folder).string();
  };
  Environment environment;
  for (const char* name : {"AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH", "GAZEBO_MODEL_PATH"})
    environment.set(name, "");
  environment.set("GZ_SIM_RESOURCE_PATH", make("a") + "::" + (directory / "none").string() + ":" + make("b"));
  environment.set("GZ_FUEL_CACHE_PATH", make("cache"));
  make("home/.gz/fuel"), make("home/.gazebo/models");
  environment.set("HOME", (directory / "home").string());
  EXPECT_THAT(package_folders({"named"}), ElementsAre("named", directory / "a", directory / "b"));
  EXPECT_THAT(model_folders({"named"}),
              ElementsAre("named", directory / "a", directory / "b", directory / "cache/",
                          directory / "home/.gz/fuel", directory / "home/.gazebo/models"));
}

}  // namespace
}  // namespace takt::command_line
