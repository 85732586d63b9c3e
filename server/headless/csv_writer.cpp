#include "server/headless/csv_writer.h"

#include <algorithm>
#include <iomanip>
#include <stdexcept>

#include "server/headless/contact_report.h"

namespace takt {

CsvWriter::CsvWriter(const std::filesystem::path& file, const Simulation& simulation, double period_s)
    : file_(file), out_(file), snapshot_(simulation.make_snapshot()), period_s_(period_s) {
  if (!out_) throw std::runtime_error(file.string() + ": cannot be written");
  const CellDescription& cell = simulation.description();
  out_ << "time";
  for (const ComponentDescription& component : cell.components) {
    for (const char* field :
         {"position.x", "position.y", "position.z", "orientation.x", "orientation.y", "orientation.z",
          "orientation.w", "force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z", "partner"}) {
      out_ << ',' << component.name << '.' << field;
    }
  }
  for (std::size_t r = 0; r < cell.robots.size(); ++r) robot_header(cell.robots[r], snapshot_.robots[r]);
  for (const GripperDescription& gripper : cell.grippers) out_ << ',' << gripper.name << ".width";
  for (const DeviceDescription& device : cell.devices)
    for (const SignalDescription& signal : device.signals) out_ << ',' << device.name << '.' << signal.name;
  contact_columns_ = snapshot_.contacts.acting;
  if (contact_columns_) write_contact_header(out_, simulation.model());
  out_ << '\n' << std::setprecision(17);
}

void CsvWriter::robot_header(const RobotDescription& robot, const RobotSample& sample) {
  const std::size_t joints = robot.arm.joints.size();
  RobotColumns columns;
  columns.dynamic = sample.level_of_detail > 1;
  columns.motors =
      columns.dynamic && std::any_of(sample.drives.begin(), sample.drives.begin() + static_cast<int>(joints),
                                     [](const DriveSample& drive) { return drive.has_motor; });
  robot_columns_.push_back(columns);
  const auto of_joints = [&](const char* quantity) {
    for (const JointModel& joint : robot.arm.joints)
      out_ << ',' << robot.name << '.' << joint.name << '.' << quantity;
  };
  of_joints("position");
  of_joints("velocity");
  if (columns.motors) {
    for (const char* quantity : {"motor_current", "gear_deflection", "friction_mode"}) of_joints(quantity);
  }
  if (!columns.dynamic) return;
  of_joints("torque");
  for (const char* quantity :
       {"flange_force.x", "flange_force.y", "flange_force.z", "flange_torque.x", "flange_torque.y",
        "flange_torque.z", "mechanical_power", "electrical_power", "mechanical_energy", "electrical_energy"})
    out_ << ',' << robot.name << '.' << quantity;
}

void CsvWriter::write_robot(const RobotSample& sample, std::size_t joints, const RobotColumns& columns) {
  const auto of_joints = [&](const auto& value) {
    for (std::size_t j = 0; j < joints; ++j) out_ << ',' << value(j);
  };
  of_joints([&](std::size_t j) { return sample.position[j]; });
  of_joints([&](std::size_t j) { return sample.velocity[j]; });
  if (columns.motors) {
    of_joints([&](std::size_t j) { return sample.drives[j].motor_current_A; });
    of_joints([&](std::size_t j) { return sample.drives[j].gear_deflection_rad; });
    of_joints([&](std::size_t j) { return static_cast<int>(sample.drives[j].friction_mode); });
  }
  if (!columns.dynamic) return;
  of_joints([&](std::size_t j) { return sample.effort[j]; });
  for (const Vec3& v : {sample.flange_load_W.f, sample.flange_load_W.t})
    out_ << ',' << v.x() << ',' << v.y() << ',' << v.z();
  out_ << ',' << sample.power.mechanical_total_W << ',' << sample.power.electrical_W << ','
       << sample.power.mechanical_energy_J << ',' << sample.power.electrical_energy_J;
}

void CsvWriter::record(const Simulation& simulation) {
  const CellDescription& cell = simulation.description();
  if (simulation.step_index() != period_boundary_step(next_, period_s_, cell.step_s)) return;
  while (period_boundary_step(next_, period_s_, cell.step_s) <= simulation.step_index()) ++next_;
  simulation.read_snapshot(snapshot_);
  const auto write = [this](const Vec3& v) { out_ << ',' << v.x() << ',' << v.y() << ',' << v.z(); };
  out_ << snapshot_.time_s;
  for (const ComponentSample& sample : snapshot_.components) {
    write(sample.p_WB);
    out_ << ',' << sample.q_WB.x() << ',' << sample.q_WB.y() << ',' << sample.q_WB.z() << ','
         << sample.q_WB.w();
    write(sample.F_Bo_W.f);
    write(sample.F_Bo_W.t);
    out_ << ',' << (sample.partner < 0 ? "" : cell.components[static_cast<std::size_t>(sample.partner)].name);
  }
  for (std::size_t r = 0; r < cell.robots.size(); ++r)
    write_robot(snapshot_.robots[r], cell.robots[r].arm.joints.size(), robot_columns_[r]);
  for (const GripperSample& gripper : snapshot_.grippers) out_ << ',' << gripper.width_m;
  for (std::size_t d = 0; d < cell.devices.size(); ++d)
    for (std::size_t s = 0; s < cell.devices[d].signals.size(); ++s)
      out_ << ',' << snapshot_.devices[d].signals[s];
  if (contact_columns_) write_contacts(out_, simulation.model(), snapshot_.contacts);
  out_ << '\n';
}

void CsvWriter::close() {
  out_.close();
  if (!out_) throw std::runtime_error(file_.string() + ": writing failed (disk full?)");
}

}  // namespace takt
