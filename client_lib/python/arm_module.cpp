// takt::Arm for Python. A pose is an array (4, 4): rotation, position, and the row 0 0 0 1.
#include "client_lib/kinematics/arm.h"
#include "client_lib/python/module.h"

namespace takt::python {
namespace {

using Numbers = std::vector<double>;
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

py::array_t<double> to_array(const Pose& X) {
  py::array_t<double> array({4, 4});
  auto cells = array.mutable_unchecked<2>();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      cells(row, column) = row == 3 ? (column == 3 ? 1.0 : 0.0) : column == 3 ? X.p[row] : X.R(row, column);
  return array;
}

Pose to_pose(const Array& array) {
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4)
    throw ShapeError("A pose is an array (4, 4); see takt.pose().");
  const auto cells = array.unchecked<2>();
  Pose X;
  for (int row = 0; row < 3; ++row) {
    X.p[row] = cells(row, 3);
    for (int column = 0; column < 3; ++column) X.R(row, column) = cells(row, column);
  }
  const double error = (X.R * X.R.transpose() - Mat3::Identity()).norm();
  if (!(error < 1e-9) || !(X.R.determinant() > 0.0))
    throw ShapeError("The first three rows and columns of a pose are a rotation; those given are not.");
  return X;
}

void bind_point(py::module_& m) {
  const auto array = [](Numbers TrajectoryPoint::*member) {
    return [member](const TrajectoryPoint& self) {
      const Numbers& values = self.*member;
      return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
    };
  };
  py::class_<TrajectoryPoint>(m, "TrajectoryPoint",
                              "Positions of all joints at a time, and how they are passed.")
      .def(py::init([](double time_s, Numbers positions, Numbers velocities, Numbers accelerations,
                       Numbers efforts) {
             return TrajectoryPoint{time_s, std::move(positions), std::move(velocities),
                                    std::move(accelerations), std::move(efforts)};
           }),
           py::arg("time_s"), py::arg("positions"), py::arg("velocities") = Numbers{},
           py::arg("accelerations") = Numbers{}, py::arg("efforts") = Numbers{},
           R"(time_s: from the start of the trajectory, in s; ascending
positions: (joints,) in rad or m
velocities: (joints,) in rad/s or m/s; empty: none; those of the last point are 0
accelerations: (joints,) in rad/s^2 or m/s^2; empty: none
efforts: (joints,) in N m or N, added to what the drives' controllers want; empty: none)")
      .def_readonly("time_s", &TrajectoryPoint::time_s, "Time from the start of the trajectory, in s.")
      .def_property_readonly("positions", array(&TrajectoryPoint::positions), "Array (joints,) in rad or m.")
      .def_property_readonly("velocities", array(&TrajectoryPoint::velocities),
                             "Array (joints,) in rad/s or m/s, or (0,).")
      .def_property_readonly("accelerations", array(&TrajectoryPoint::accelerations),
                             "Array (joints,) in rad/s^2 or m/s^2, or (0,).")
      .def_property_readonly("efforts", array(&TrajectoryPoint::efforts),
                             "Array (joints,) in N m or N, or (0,).");
}

}  // namespace

void bind_arm(py::module_& m) {
  bind_point(m);
  m.def(
      "pose",
      [](const std::array<double, 3>& position, const std::array<double, 4>& orientation) {
        const Quat q(orientation[3], orientation[0], orientation[1], orientation[2]);
        if (!(std::abs(q.norm() - 1.0) < 1e-6))
          throw ShapeError("The orientation is a unit quaternion x y z w.");
        return to_array(Pose::from_quaternion({position[0], position[1], position[2]}, q.normalized()));
      },
      py::arg("position"), py::arg("orientation") = std::array<double, 4>{0.0, 0.0, 0.0, 1.0},
      "Pose as an array (4, 4), from a position (3,) in m and a unit quaternion (4,) x y z w.");
  m.def(
      "orientation_of",
      [](const Array& pose) {
        const Quat q = to_pose(pose).quaternion();
        return py::array_t<double>(4, q.coeffs().data());
      },
      py::arg("pose"), "Unit quaternion (4,) x y z w of a pose (4, 4), with w not negative.");
  py::class_<Arm>(m, "Arm", R"(Kinematics of one robot of a cell, and motions for Client.send_trajectory.

A pose X_WT is an array (4, 4) that turns coordinates of the tool centre point (TCP) into those of the world; takt.pose()
makes one. Joint positions are arrays (joints,) in rad or m, in the order of info.robots[robot].joints.)")
      .def(py::init([](const InfoView& info, const std::string& robot, const std::string& gripper) {
             return Arm(info.sample(), robot, gripper);
           }),
           py::arg("info"), py::arg("robot"), py::arg("gripper") = "",
           R"(info: description of the cell (Client.info)
robot: name of the robot
gripper: name of the gripper whose tool centre point counts; empty: the flange

Raises NotFound with the names that exist.)")
      .def_property_readonly("name", &Arm::name, "Name of the robot.")
      .def(
          "set_base", [](Arm& self, const StateView& state) { self.set_base(state.sample()); },
          py::arg("state"),
          R"(Poses in the world count from where the base is in this state (Client.state()), for the next calls. Needed for a robot
on a Ground that moves, whose base is else that of the start; other robots do not change.)")
      .def("__repr__", [](const Arm& self) { return "<takt.Arm of " + self.name() + ">"; })
      .def(
          "forward_kinematics",
          [](const Arm& self, const Numbers& positions) {
            return to_array(self.forward_kinematics(positions));
          },
          py::arg("positions"), "Pose X_WT (4, 4) of the TCP in the world, for joint positions (joints,).")
      .def(
          "inverse_kinematics",
          [](const Arm& self, const Array& X_WT, const Numbers& near) {
            const Numbers found = self.inverse_kinematics(to_pose(X_WT), near);
            return py::array_t<double>(static_cast<py::ssize_t>(found.size()), found.data());
          },
          py::arg("X_WT"), py::arg("near"),
          R"(Joint positions (joints,) within the joints' ranges that put the TCP at a pose, exact to rounding.

X_WT: pose (4, 4) of the TCP in the world
near: joint positions (joints,); of the solutions that are found the nearest to these is returned

Raises MotionError where none is found, with the distance of the best attempt.)")
      .def(
          "plan_joint_move",
          [](const Arm& self, const Numbers& start, const Numbers& end, double speed,
             double acceleration_rad_per_s2, double duration_s, double period_s) {
            return self.plan_joint_move(start, end, {speed, acceleration_rad_per_s2, duration_s}, period_s);
          },
          py::arg("start"), py::arg("end"), py::kw_only(), py::arg("speed") = JointMotionOptions{}.speed,
          py::arg("acceleration_rad_per_s2") = JointMotionOptions{}.acceleration_rad_per_s2,
          py::arg("duration_s") = 0.0, py::arg("period_s") = Arm::kPeriod_s,
          R"(Motion from rest to rest as a list of TrajectoryPoint; all joints start and stop together.

start, end: joint positions (joints,)
speed: fraction of every joint's own limit, in (0, 1]
acceleration_rad_per_s2: of every joint; m/s^2 for prismatic joints
duration_s: of the motion, in s; 0: as fast as the limits allow
period_s: time from point to point, in s

Raises MotionError where the end is outside a joint's range, or the duration is too short.)")
      .def(
          "plan_line",
          [](const Arm& self, const Numbers& start, const Array& X_WT, double speed_m_per_s,
             double acceleration_m_per_s2, double rotation_speed_rad_per_s,
             double rotation_acceleration_rad_per_s2, double duration_s, double period_s) {
            return self.plan_line(start, to_pose(X_WT),
                                  {speed_m_per_s, acceleration_m_per_s2, rotation_speed_rad_per_s,
                                   rotation_acceleration_rad_per_s2, duration_s},
                                  period_s);
          },
          py::arg("start"), py::arg("X_WT"), py::kw_only(),
          py::arg("speed_m_per_s") = LineOptions{}.speed_m_per_s,
          py::arg("acceleration_m_per_s2") = LineOptions{}.acceleration_m_per_s2,
          py::arg("rotation_speed_rad_per_s") = LineOptions{}.rotation_speed_rad_per_s,
          py::arg("rotation_acceleration_rad_per_s2") = LineOptions{}.rotation_acceleration_rad_per_s2,
          py::arg("duration_s") = 0.0, py::arg("period_s") = Arm::kPeriod_s,
          R"(Motion from rest to rest as a list of TrajectoryPoint; the TCP moves on a straight line and turns about one axis.

start: joint positions (joints,)
X_WT: pose (4, 4) of the TCP at the end
speed_m_per_s, acceleration_m_per_s2: of the TCP
rotation_speed_rad_per_s, rotation_acceleration_rad_per_s2: of the TCP
duration_s: of the motion, in s; 0: as fast as the limits allow
period_s: time from point to point, in s

Raises MotionError, with the place on the line, where the line leaves the reach, a joint's range or speed limit, or meets
a singularity.)");
}

}  // namespace takt::python
