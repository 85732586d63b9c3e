#include "server/simulation/model/cell_model.h"

namespace takt {

std::vector<std::unique_ptr<Drive>> make_drives(const std::vector<DriveParameters>& drives) {
  struct Make {
    std::unique_ptr<Drive> operator()(const IdealServoParameters& p) const {
      return std::make_unique<IdealServo>(p);
    }
    std::unique_ptr<Drive> operator()(const SimplifiedDriveParameters& p) const {
      return std::make_unique<SimplifiedDrive>(p);
    }
    std::unique_ptr<Drive> operator()(const DetailedDriveParameters& p) const {
      return std::make_unique<DetailedDrive>(p);
    }
    std::unique_ptr<Drive> operator()(const SignalDriveParameters& p) const {
      return std::make_unique<SignalDrive>(p);
    }
  };
  std::vector<std::unique_ptr<Drive>> result;
  for (const DriveParameters& parameters : drives) result.push_back(std::visit(Make{}, parameters));
  return result;
}

}  // namespace takt
