#include "server/fields/expected_poses.h"

#include "server/fields/fields.h"

namespace takt {

void describe_expected(Fields& f, std::vector<ExpectedPose>& parts, double& tolerance_m,
                       const std::vector<std::string>& names) {
  f.field("tolerance_m", tolerance_m, positive("m"), "Largest distance from the expected position.",
          kNotInModel);
  f.section(
      "parts", "Expected pose of each part, by name.",
      [&] {
        Pose any;
        if (f.informing()) f.pose("*", any, "Pose in the world.", kNotInModel);
        if (f.reading()) {
          for (const std::string& name : names) {
            const bool given = f.has(name);
            Pose X_WB;
            f.pose(name.c_str(), X_WB, "");
            if (given) parts.push_back({name, X_WB});
          }
        } else if (f.writing()) {
          for (ExpectedPose& expected : parts)
            f.pose(expected.part.c_str(), expected.X_WB, "", kAlwaysWritten);
        }
      },
      kNotInModel);
}

ExpectedPoses read_expected(const std::filesystem::path& file) {
  const YamlSource source{file, {}};
  const YAML::Node root = load_yaml(file), section = root.IsMap() ? root["expected"] : YAML::Node();
  ExpectedPoses expected;
  std::vector<std::string> names;
  if (section.IsDefined() && section.IsMap() && section["parts"].IsDefined() && section["parts"].IsMap())
    for (const auto& entry : section["parts"]) names.push_back(entry.first.as<std::string>(std::string()));
  if (names.empty())
    throw ScenarioError(file.string() +
                        ": expected.parts: found nothing to check; allowed: poses of Parts by name");
  YAML::Node alone;
  alone["expected"] = section;
  Fields f(source, alone);
  f.section("expected", "", [&] { describe_expected(f, expected.parts, expected.tolerance_m, names); });
  f.finish();
  return expected;
}

}  // namespace takt
