// Reports that clients of the dashboard ask for.
#include <chrono>
#include <fstream>

#include "client_lib/tools/takt_ur/ur_controller.h"
#include "idl/common/text.h"

namespace takt::ur {
namespace {

/// So many files; a client cannot fill the disk.
constexpr int kMostReports = 100;

std::size_t numbers_of(rtde::Type type) {
  switch (type) {
    case rtde::Type::vector3:
      return 3;
    case rtde::Type::vector6:
    case rtde::Type::vector6_int32:
    case rtde::Type::vector6_uint32:
      return 6;
    default:
      return 1;
  }
}

void write(std::ostream& out, const rtde::Table& table, const char* title) {
  out << "\n[" << title << "]\n";
  for (const rtde::Variable& variable : table.variables()) {
    const rtde::Value& value = table[variable.name];
    out << variable.name << " =";
    for (std::size_t i = 0; i < numbers_of(variable.type); ++i)
      out << " "
          << (rtde::is_real(variable.type) ? number_text(value.real.at(i))
                                           : std::to_string(value.whole.at(i)));
    out << "\n";
  }
}

}  // namespace

std::optional<std::string> UrController::write_report(std::string& reason) {
  if (mapping_.reports.empty()) {
    reason = "no directory for reports; the mapping needs the key reports";
    return std::nullopt;
  }
  if (++reports_ > kMostReports) {
    reason = "this takt-ur has written " + std::to_string(kMostReports) + " reports";
    return std::nullopt;
  }
  const auto now =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch());
  const std::filesystem::path file =
      std::filesystem::path(mapping_.reports) /
      (mapping_.robot.robot + "_" + std::to_string(now.count()) + "_" + std::to_string(reports_) + ".txt");
  std::ofstream out(file);
  out << mapping_.model << ", software " << mapping_.version << ", serial number " << mapping_.serial_number
      << ", robot mode " << robot_mode() << ", safety mode " << safety_mode() << ", program "
      << program_state() << "\n\n[log]\n";
  for (const std::string& line : log_) out << line << "\n";
  write(out, outputs_, "outputs");
  write(out, inputs_, "inputs");
  out.flush();
  if (!out) {
    reason = file.string() + " cannot be written";
    return std::nullopt;
  }
  log("A report is written: " + file.string());
  return file.string();
}

}  // namespace takt::ur
