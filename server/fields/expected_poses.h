#pragma once
// Section `expected` of a scenario file: where Parts must be at the end, as takt-run reports it and `takt check` compares.
#include <filesystem>
#include <string>
#include <vector>

#include "plant_models/spatial.h"

namespace takt {

class Fields;

struct ExpectedPose {
  std::string part;
  Pose X_WB;
};

/// Of positions, where the section states none.
inline constexpr double kExpectedTolerance_m = 0.0001;

struct ExpectedPoses {
  std::vector<ExpectedPose> parts;
  double tolerance_m = kExpectedTolerance_m;
};

/// Describes the section; `names`: Parts that may have a pose.
void describe_expected(Fields& f, std::vector<ExpectedPose>& parts, double& tolerance_m,
                       const std::vector<std::string>& names);

/// Of a scenario file, whose other sections are not read. Throws ScenarioError, also where there is no expected pose.
ExpectedPoses read_expected(const std::filesystem::path& file);

}  // namespace takt
