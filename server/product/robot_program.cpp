// What a plan for a robot becomes: its program, the description of the robot, its time.
#include <algorithm>
#include <cmath>

#include "idl/common/text.h"
#include "server/product/robot_plan.h"
#include "takt_enumerations.h"

namespace takt::product {

namespace {

constexpr double kSpeed_m_per_s = 0.5, kAcceleration_m_per_s2 = 2.0;
constexpr double kTurn_rad_per_s = 3.0, kTurnAcceleration_rad_per_s2 = 10.0;
constexpr double kSlow_m_per_s = 0.1;
constexpr double kJointAcceleration = 5.0;  ///< rad/s^2, m/s^2
constexpr double kShareOfJointSpeed = 0.2, kJointSpeed_m_per_s = 4.0, kJointSpeed_rad_per_s = 15.0;
constexpr double kJawTime_s = 0.3;

std::string number(double value) {
  return number_text(std::abs(value) < 1e-12 ? 0.0 : value, 9);
}

/// Angles about the fixed axes x, y, z.
Vec3 angles(const Mat3& R) {
  const double pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  if (std::abs(R(2, 0)) > 1.0 - 1e-12) return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

std::string text_of(const Pose& pose) {
  const Vec3 a = angles(pose.R);
  return "pose{x = " + number(pose.p.x()) + ", y = " + number(pose.p.y()) + ", z = " + number(pose.p.z()) +
         ", roll = " + number(a.x()) + ", pitch = " + number(a.y()) + ", yaw = " + number(a.z()) + "}";
}

/// The tool sits askew on the last joint, so that no direction along the axes of the world is singular: those are
/// singular in which the joint's x axis is vertical, and it is a space diagonal of the tool.
Mat3 mount() {
  Mat3 R;
  R.row(0) = Vec3(1, 1, 1).normalized().transpose();
  R.row(1) = Vec3(1, -1, 0).normalized().transpose();
  R.row(2) = R.row(0).cross(R.row(1));
  return R;
}

/// The word of the URDF, which is that of the enumeration.
std::string_view type(JointType joint) {
  return kEnumeration<JointType>.find(static_cast<std::int64_t>(joint))->name;
}

/// Of a motion from rest to rest (s).
double motion_time(double way, double speed, double acceleration) {
  return std::max(1.5 * way / speed, std::sqrt(6.0 * way / acceleration));
}

/// A gantry for large products is faster: its motions take as long as those over a product of this size.
double pace_of(const RobotPlan& plan) {
  constexpr double kSize_m = 0.5;
  return std::max(1.0, plan.size_m / kSize_m);
}

double line_time(const Pose& from, const Pose& to, double speed, double pace) {
  const double angle = Eigen::AngleAxisd(from.R.transpose() * to.R).angle();
  return std::max(motion_time((to.p - from.p).norm(), pace * speed, pace * kAcceleration_m_per_s2),
                  motion_time(angle, kTurn_rad_per_s, kTurnAcceleration_rad_per_s2)) +
         0.016;
}

/// All joints move; one may turn by twice the angle of the tool.
double across_time(const Pose& from, const Pose& to, double pace) {
  const double angle = Eigen::AngleAxisd(from.R.transpose() * to.R).angle();
  return std::max(motion_time((to.p - from.p).norm(), pace * kShareOfJointSpeed * kJointSpeed_m_per_s,
                              pace * kJointAcceleration),
                  motion_time(2.0 * angle, kShareOfJointSpeed * kJointSpeed_rad_per_s, kJointAcceleration));
}

constexpr const char* kAwait =
    R"(-- Waits until holds(cell), at most 5 s; the error then names the part, its place and what holds it.
local function await(r, move, holds, problem)
  local until_s
  r:wait_for(function(cell)
    if holds(cell) then return true end
    until_s = until_s or cell.time + 5
    if cell.time >= until_s then
      local part = cell.components[move.part]
      local p = part.position
      error(string.format("%s; it is at (%.4f, %.4f, %.4f) m, held by %s", problem, p.x, p.y, p.z,
                          part.partner or "nothing"))
    end
    return false
  end)
end

local function grip(r, move)
  r.gripper:close()
  await(r, move, function(cell) return cell.grippers.Gripper1.part == move.part end,
        "the jaws do not hold " .. move.part)
end

)";

constexpr const char* kHold = R"(local function ready(r, move) r.gripper:width(move.open_m) end

local function hold(r, move)
  grip(r, move)
  r:wait(JAW_TIME_S)
end

local function let_go(r, move) r.gripper:width(move.open_m) end
)";

constexpr const char* kHoldWithCup = R"(
local function ready(r, move)
  if not move.cup then r.gripper:width(move.open_m) end
end

local function hold(r, move)
  if move.cup then
    CUPS[move.cup]:set{vacuum = 1}
    await(r, move, function(cell) return cell.components[move.part].partner == "Gripper1" end,
          "the cup does not hold " .. move.part)
  else
    grip(r, move)
  end
  r:wait(JAW_TIME_S)
end

local function let_go(r, move)
  if move.cup then CUPS[move.cup]:set{vacuum = 0} else r.gripper:width(move.open_m) end
end
)";

constexpr const char* kRelease = R"(
-- The part is then held by the tray, or by the product.
local function release(r, move, where)
  let_go(r, move)
  r:wait(JAW_TIME_S)
  await(r, move, function(cell)
    local partner = cell.components[move.part].partner
    return partner ~= nil and partner ~= "Gripper1"
  end, "nothing takes over " .. move.part .. " " .. where .. ": its convex shapes touch neither tray nor support " ..
       "nor a part of a larger hierarchy number that is held")
end
)";

/// The pose in the middle adds nothing to a straight way.
bool on_the_way(const Pose& from, const Pose& middle, const Pose& to) {
  constexpr double kStraight_m = 1e-6;
  const Vec3 way = to.p - from.p, part = middle.p - from.p;
  return from.R.isApprox(middle.R) && middle.R.isApprox(to.R) &&
         std::abs(part.norm() + (to.p - middle.p).norm() - way.norm()) < kStraight_m;
}

bool passes_start(const RobotMove& move) {
  return !on_the_way(move.above, move.start, move.near);
}
bool passes_out(const RobotMove& move) {
  return !on_the_way(move.free, move.out, move.aside.value_or(move.lift));
}

}  // namespace

std::string robot_program(const Product& product, const RobotPlan& plan) {
  const double pace = pace_of(plan);
  std::string text =
      "-- The robot takes " + product.name +
      " apart and puts it together again. Made by takt-from-cad; calls: docs/controller_programs.md.\n"
      "-- Each move: above and before the part, slowly to it, slowly out of what it touches, straight out, "
      "up, above "
      "and on the tray.\n-- Lengths in m, "
      "angles in rad.\n\nperiod_s = 0.008\n\n"
      "local FAST = {speed_m_per_s = " +
      number(pace * kSpeed_m_per_s) + ", acceleration_m_per_s2 = " + number(pace * kAcceleration_m_per_s2) +
      ", rotation_speed_rad_per_s = " + number(kTurn_rad_per_s) +
      ",\n              rotation_acceleration_rad_per_s2 = " + number(kTurnAcceleration_rad_per_s2) +
      "}\nlocal SLOW = {speed_m_per_s = " + number(pace * kSlow_m_per_s) +
      ", acceleration_m_per_s2 = " + number(pace * kAcceleration_m_per_s2) +
      "}\nlocal ACROSS = {speed = " + number(kShareOfJointSpeed) +
      ", acceleration_rad_per_s2 = " + number(pace * kJointAcceleration) +
      "}   -- of all joints: the tool turns\nlocal JAW_TIME_S = " + number(kJawTime_s) +
      "\n\nlocal MOVES = {\n";
  for (const RobotMove& move : plan.moves) {
    text += "  {name = \"" + move.name + "\", part = \"" + product.instances[move.held].name + "\", ";
    text += move.cup ? "cup = " + std::to_string(*move.cup + 1)
                     : "open_m = " + number(move.width_m + 2.0 * plan.gripper.opening_m);
    const std::pair<const char*, const Pose*> poses[] = {
        {"above", &move.above}, {"start", passes_start(move) ? &move.start : nullptr},
        {"near", &move.near},   {"grasp", &move.grasp},
        {"free", &move.free},   {"out", passes_out(move) ? &move.out : nullptr},
        {"lift", &move.lift},   {"over", &move.over},
        {"put", &move.put},     {"aside", move.aside ? &*move.aside : nullptr}};
    for (const auto& [key, pose] : poses)
      if (pose != nullptr) text += ",\n   " + std::string(key) + " = " + text_of(*pose);
    text += "},\n";
  }
  text += "}\n\n";
  text += kAwait;
  if (plan.gripper.cups_m.empty()) {
    text += kHold;
  } else {
    text += "local CUPS = {";
    for (std::size_t k = 0; k < plan.gripper.cups_m.size(); ++k)
      text += (k > 0 ? ", " : "") + std::string("device(\"Cup") + std::to_string(k + 1) + "\")";
    text += "}\n";
    text += kHoldWithCup;
  }
  text += kRelease;
  text += R"(
routine("Robot1", function(r)
  for i = 1, #MOVES do
    local move = MOVES[i]
    r:step(move.name)
    ready(r, move)
    r:move_to(move.above, ACROSS)
    if move.start then r:move_line(move.start, FAST) end
    r:move_line(move.near, FAST)
    r:move_line(move.grasp, SLOW)
    hold(r, move)
    r:move_line(move.free, SLOW)
    if move.out then r:move_line(move.out, FAST) end
    if move.aside then r:move_line(move.aside, FAST) end
    r:move_line(move.lift, FAST)
    r:move_to(move.over, ACROSS)
    r:move_line(move.put:offset(0, 0, 0.01), FAST)
    r:move_line(move.put, SLOW)
    release(r, move, "on the tray")
    r:move_line(move.over, FAST)
  end
  signal("taken apart")
  for i = #MOVES, 1, -1 do
    local move = MOVES[i]
    r:step("assemble " .. move.part)
    ready(r, move)
    r:move_to(move.over, ACROSS)
    r:move_line(move.put:offset(0, 0, 0.01), FAST)
    r:move_line(move.put, SLOW)
    hold(r, move)
    r:move_line(move.over, FAST)
    r:move_to(move.lift, ACROSS)
    if move.aside then r:move_line(move.aside, FAST) end
    if move.out then r:move_line(move.out, FAST) end
    r:move_line(move.free, FAST)
    r:move_line(move.grasp, SLOW)
    release(r, move, "in the product")
    if move.start then r:move_line(move.start, FAST) end
    r:move_line(move.above, FAST)
  end
end)
)";
  return text;
}

std::vector<double> home_joints(const RobotPlan& plan) {
  const Vec3 a = angles(plan.home.R * mount().transpose());
  // The flange lies behind the tool centre point by the length of the tool.
  const Vec3 flange = plan.home.p - plan.home.R.col(2) * 2.0 * plan.gripper.finger_length_m;
  return {flange.x(), flange.y(), flange.z(), a.z(), a.y(), a.x()};
}

std::string robot_description(const RobotPlan& plan) {
  double reach = 1.0;
  for (const RobotMove& move : plan.moves)
    for (const Pose* pose : {&move.above, &move.start, &move.out, &move.lift, &move.over})
      reach = std::max(reach, pose->p.cwiseAbs().maxCoeff());
  reach += 4.0 * plan.gripper.finger_length_m;
  std::string text =
      "<?xml version=\"1.0\"?>\n<!-- A gantry for takt-from-cad's program: three slides, three turning "
      "joints about z, y "
      "and x.\n     The tool sits askew on the last one, so that no direction along the axes is singular. "
      "Masses and "
      "speeds are assumed. -->\n<robot name=\"gantry\">\n  <link name=\"base_link\"/>\n";
  const char* const names[] = {"slide_x", "slide_y", "slide_z", "turn_z", "turn_y", "turn_x"};
  const char* const axes[] = {"1 0 0", "0 1 0", "0 0 1", "0 0 1", "0 1 0", "1 0 0"};
  const double size = 0.3 * plan.gripper.finger_length_m;
  const auto axis = [&](int k, const std::string& parent, const std::string& link) {
    std::string made = "  <link name=\"" + link +
                       "\">\n    <inertial><mass value=\"2\"/><inertia ixx=\"0.01\" iyy=\"0.01\" "
                       "izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>\n";
    if (k == 5)
      made += "    <visual><geometry><box size=\"" + number(size) + " " + number(size) + " " + number(size) +
              "\"/></geometry></visual>\n";
    made += "  </link>\n  <joint name=\"" + std::string(names[k]) + "\" type=\"" +
            std::string(type(k < 3 ? JointType::prismatic : JointType::revolute)) + "\"" +
            ">\n    <parent link=\"" + parent + "\"/><child link=\"" + link + "\"/><axis xyz=\"" + axes[k] +
            "\"/>\n    <limit lower=\"" + number(k < 3 ? -reach : -12.5) + "\" upper=\"" +
            number(k < 3 ? reach : 12.5) + "\" effort=\"" + (k < 3 ? "2000" : "200") + "\" velocity=\"" +
            number(k < 3 ? pace_of(plan) * kJointSpeed_m_per_s : kJointSpeed_rad_per_s) +
            "\"/>\n  </joint>\n";
    return made;
  };
  std::string parent = "base_link";
  for (int k = 0; k < 6; ++k) {
    const std::string link = std::string(names[k]) + "_link";
    text += axis(k, parent, link);
    parent = link;
  }
  const Vec3 a = angles(mount());
  const auto arm_of_cup = [&](std::size_t k) {
    const Pose cup = cup_mount(plan.gripper, k);
    const std::string thick = number(0.5 * plan.gripper.cups_m[k]);
    return "<visual><origin xyz=\"" + number(0.5 * cup.p.x()) + " 0 " + number(cup.p.z()) +
           "\"/><geometry><box size=\"" + number(std::abs(cup.p.x())) + " " + thick + " " + thick +
           "\"/></geometry></visual>";
  };
  std::string arm;
  for (std::size_t k = 0; k < plan.gripper.cups_m.size(); ++k) arm += arm_of_cup(k);
  text += "  <link name=\"tool0\">" + arm +
          "</link>\n  <joint name=\"tool\" type=\"fixed\">\n    <parent link=\"" + parent +
          "\"/><child link=\"tool0\"/><origin xyz=\"0 0 0\" rpy=\"" + number(a.x()) + " " + number(a.y()) +
          " " + number(a.z()) + "\"/>\n  </joint>\n</robot>\n";
  return text;
}

double program_duration_s(const RobotPlan& plan) {
  constexpr double kRest_s = 0.5;
  if (plan.cycle_s) return std::ceil(*plan.cycle_s + kRest_s);
  const double pace = pace_of(plan);
  const auto line = [pace](const Pose& from, const Pose& to, double speed) {
    return line_time(from, to, speed, pace);
  };
  double time = 0.0;
  const Pose* before = &plan.home;
  for (const RobotMove& m : plan.moves) {
    const Pose& beside = m.aside.value_or(m.out);
    const double slow = line(m.near, m.grasp, kSlow_m_per_s) + 2.0 * line(m.grasp, m.free, kSlow_m_per_s);
    const double inside =
        2.0 * (line(m.above, m.start, kSpeed_m_per_s) + line(m.start, m.grasp, kSpeed_m_per_s) +
               line(m.free, m.out, kSpeed_m_per_s) + line(m.out, beside, kSpeed_m_per_s) +
               line(beside, m.lift, kSpeed_m_per_s));
    const double outside =
        2.0 * across_time(m.lift, m.over, pace) + 4.0 * line(m.over, m.put, kSpeed_m_per_s);
    // Two ways, with the jaws' times, the last centimetre, and the way to the next move.
    time += slow + inside + outside + 2.0 * across_time(*before, m.above, pace) + 8.0 * kJawTime_s + 1.0;
    before = &m.over;
  }
  return std::ceil(1.1 * time + 3.0);
}

}  // namespace takt::product
