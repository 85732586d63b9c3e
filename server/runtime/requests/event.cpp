#include "server/runtime/requests/event.h"

#include <cstdio>

#include "idl/common/text.h"
#include "server/runtime/pacer.h"
#include "server/simulation/model/command.h"

namespace takt {
namespace {

std::string component_name(const CellDescription& cell, int component) {
  if (component < 0) return "nothing";
  return cell.components[static_cast<std::size_t>(component)].name;
}

EventText describe_rejection(const EventRecord& event, const CellDescription& cell) {
  const std::string target(target_name(cell, event.a));
  const auto code = static_cast<RejectionCode>(event.b);
  std::string message = std::string(to_string(code)) + ": ";
  if (event.y < 0.0) {
    message +=
        "In lockstep pace " + target + " takes commands only from a registered controller that declares it.";
  } else if (event.x < 0.0) {
    message += "The command for " + target +
               " has no stamp, or the robot follows a trajectory; in lockstep it must be stamped with the "
               "boundary it is for, now " +
               number_text(event.y) + " s, and a trajectory is followed to its end.";
  } else {
    message += "The command for " + target + " is stamped " + number_text(event.x) +
               " s, but the boundary awaited is " + number_text(event.y) + " s.";
  }
  return {target, message};
}

EventText describe_motion(const EventRecord& event, const CellDescription& cell) {
  const RobotDescription& robot = cell.robots[static_cast<std::size_t>(event.a)];
  switch (event.code) {
    case EventCode::trajectory_done:
      return {robot.name, robot.name + " is at the end of its trajectory."};
    case EventCode::trajectory_replaced:
      return {robot.name,
              "The trajectory of " + robot.name + " was replaced before its end by a newer command."};
    case EventCode::command_deadline_missed:
      return {robot.name,
              "No set-point has come for " + robot.name + " for " + number_text(event.x) +
                  " s (simulated); allowed are " + number_text(robot.command_deadline.deadline_s) + " s. " +
                  (robot.command_deadline.action == SafeAction::stop ? "It brakes to a stop."
                                                                     : "It holds the last set-point.")};
    default:
      break;
  }
  if (event.b < 0) {
    return {robot.name, "The trajectory for " + robot.name + " is not followed: it ended at " +
                            number_text(event.x) + " s, before it took effect."};
  }
  const JointModel& joint = robot.arm.joints[static_cast<std::size_t>(event.b)];
  const std::string unit =
      std::string(joint.type == JointType::revolute ? "rad" : "m") + (event.c == 1 ? "/s" : "");
  return {robot.name, "The trajectory for " + robot.name +
                          " is not followed: on the way to it from where the robot is, the " +
                          (event.c == 1 ? "velocity" : "position") + " of joint '" + joint.name +
                          "' would be " + number_text(event.x) + " " + unit + ", outside [" +
                          number_text(event.y) + ", " + number_text(event.z) + "] " + unit + "."};
}

std::string millimetres(double value_m) {
  return fixed_text(1e3 * value_m, 3) + " mm";
}

EventText describe_clearance(const EventRecord& event, const CellDescription& cell) {
  const std::string& a = cell.checked_bodies[static_cast<std::size_t>(event.a)];
  const std::string& b = cell.checked_bodies[static_cast<std::size_t>(event.b)];
  char place[80];
  std::snprintf(place, sizeof place, " at (%.4f, %.4f, %.4f) m", event.position_W.x(), event.position_W.y(),
                event.position_W.z());
  const std::string limit = event.x > 0.0 ? " (limit " + millimetres(event.x) + ")" : "";
  switch (event.code) {
    case EventCode::clearance:
      return {a, a + " and " + b + " are " + millimetres(event.y) + " apart" + place + limit + "."};
    case EventCode::collision:
      return {a, a + " and " + b + " overlap by " + millimetres(event.y) + place + "."};
    default:
      return {a, a + " and " + b + " are clear again after " + number_text(event.z) + " s; " +
                     (event.y < 0.0 ? "deepest overlap " + millimetres(-event.y)
                                    : "least distance " + millimetres(event.y)) +
                     place + limit + "."};
  }
}

}  // namespace

std::string_view to_string(EventCode code) {
  switch (code) {
    case EventCode::clearance:
      return "clearance";
    case EventCode::collision:
      return "collision";
    case EventCode::clearance_restored:
      return "clearance_restored";
    case EventCode::connection_changed:
      return "connection_changed";
    case EventCode::simulation_fault:
      return "simulation_fault";
    case EventCode::state_changed:
      return "state_changed";
    case EventCode::reset:
      return "reset";
    case EventCode::pace_changed:
      return "pace_changed";
    case EventCode::schedule_rebased:
      return "schedule_rebased";
    case EventCode::controller_registered:
      return "controller_registered";
    case EventCode::controller_unregistered:
      return "controller_unregistered";
    case EventCode::controller_late:
      return "controller_late";
    case EventCode::controller_timeout:
      return "controller_timeout";
    case EventCode::command_rejected:
      return "command_rejected";
    case EventCode::end_of_scenario:
      return "end_of_scenario";
    case EventCode::level_of_detail_changed:
      return "level_of_detail_changed";
    case EventCode::attached:
      return "attached";
    case EventCode::detached:
      return "detached";
    case EventCode::entity_state_set:
      return "entity_state_set";
    case EventCode::trajectory_done:
      return "trajectory_done";
    case EventCode::trajectory_replaced:
      return "trajectory_replaced";
    case EventCode::trajectory_refused:
      return "trajectory_refused";
    case EventCode::command_deadline_missed:
      return "command_deadline_missed";
    case EventCode::weak_grip:
      return "weak_grip";
    case EventCode::alternating_force:
      return "alternating_force";
    case EventCode::save_refused:
      return "snapshot_failed";
    case EventCode::events_lost:
      return "events_lost";
  }
  return "unknown";
}

std::string_view to_string(SimulationState state) {
  switch (state) {
    case SimulationState::stopped:
      return "stopped";
    case SimulationState::playing:
      return "playing";
    case SimulationState::paused:
      return "paused";
    case SimulationState::quitting:
      return "quitting";
    case SimulationState::no_world:
      return "without a scenario";
    case SimulationState::loading_world:
      return "loading a scenario";
  }
  return "unknown";
}

std::string_view target_name(const CellDescription& cell, int target) {
  const int robots = static_cast<int>(cell.robots.size());
  if (target < 0) return "";
  if (target < robots) return cell.robots[static_cast<std::size_t>(target)].name;
  const int grippers = static_cast<int>(cell.grippers.size());
  if (target < robots + grippers) return cell.grippers[static_cast<std::size_t>(target - robots)].name;
  return cell.devices[static_cast<std::size_t>(target - robots - grippers)].name;
}

int find_target(const CellDescription& cell, std::string_view name) {
  for (std::size_t i = 0; i < cell.robots.size(); ++i) {
    if (cell.robots[i].name == name) return static_cast<int>(i);
  }
  for (std::size_t i = 0; i < cell.grippers.size(); ++i) {
    if (cell.grippers[i].name == name) return static_cast<int>(cell.robots.size() + i);
  }
  for (std::size_t i = 0; i < cell.devices.size(); ++i) {
    if (cell.devices[i].name == name) return static_cast<int>(cell.robots.size() + cell.grippers.size() + i);
  }
  return -1;
}

EventRecord fault_record(const Simulation& simulation) {
  EventRecord told;
  told.code = EventCode::simulation_fault;
  told.severity = Severity::error;
  told.time_s = simulation.time_s();
  told.step = simulation.step_index();
  told.epoch = simulation.epoch();
  told.text.assign(simulation.fault());
  return told;
}

EventRecord motion_record(const MotionNotice& notice, std::uint32_t epoch) {
  EventRecord told;
  told.time_s = notice.time_s;
  told.step = notice.step;
  told.epoch = epoch;
  told.a = notice.robot;
  told.b = notice.joint;
  told.c = notice.velocity ? 1 : 0;
  told.x = notice.value;
  told.y = notice.lower;
  told.z = notice.upper;
  switch (notice.kind) {
    case MotionNotice::Kind::trajectory_done:
      told.code = EventCode::trajectory_done;
      break;
    case MotionNotice::Kind::trajectory_replaced:
      told.code = EventCode::trajectory_replaced;
      break;
    case MotionNotice::Kind::trajectory_refused:
    case MotionNotice::Kind::trajectory_past:
      told.code = EventCode::trajectory_refused;
      told.severity = Severity::warning;
      break;
    case MotionNotice::Kind::deadline_missed:
      told.code = EventCode::command_deadline_missed;
      told.severity = Severity::warning;
      break;
  }
  return told;
}

EventRecord weak_grip_record(const WeakGrip& grip, std::uint32_t epoch) {
  EventRecord told;
  told.code = EventCode::weak_grip;
  told.severity = Severity::warning;
  told.time_s = grip.time_s;
  told.step = grip.step;
  told.epoch = epoch;
  told.a = grip.gripper;
  told.b = grip.part;
  told.x = grip.needed_N;
  told.y = grip.force_N;
  return told;
}

EventRecord alternating_force_record(const AlternatingForce& force, std::uint32_t epoch) {
  EventRecord told;
  told.code = EventCode::alternating_force;
  told.severity = Severity::warning;
  told.time_s = force.time_s;
  told.step = force.step;
  told.epoch = epoch;
  told.a = force.part;
  told.b = force.other;
  told.x = force.change_N;
  return told;
}

EventRecord collision_record(const CollisionEvent& found, std::uint32_t epoch) {
  EventRecord told;
  told.code = EventCode::clearance;
  told.severity = Severity::warning;
  told.y = found.distance_m;
  if (found.kind == CollisionEvent::Kind::collision) {
    told.code = EventCode::collision;
    told.severity = Severity::error;
    told.y = -found.distance_m;
  } else if (found.kind == CollisionEvent::Kind::cleared) {
    told.code = EventCode::clearance_restored;
    told.severity = Severity::information;
  }
  told.time_s = found.time_s;
  told.step = found.step;
  told.epoch = epoch;
  told.a = found.a;
  told.b = found.b;
  told.x = found.limit_m;
  told.z = found.duration_s;
  told.position_W = found.p_W;
  return told;
}

EventText describe(const EventRecord& event, const CellDescription& cell) {
  const std::string text = event.text.str();
  const auto awaited = [&] {
    return "the command of controller '" + text + "' for " + std::string(target_name(cell, event.a)) +
           " at the boundary " + number_text(event.x) + " s";
  };
  switch (event.code) {
    case EventCode::clearance:
    case EventCode::collision:
    case EventCode::clearance_restored:
      return describe_clearance(event, cell);
    case EventCode::trajectory_done:
    case EventCode::trajectory_replaced:
    case EventCode::trajectory_refused:
    case EventCode::command_deadline_missed:
      return describe_motion(event, cell);
    case EventCode::connection_changed: {
      const std::string part = component_name(cell, event.a);
      return {part, part + ": " + component_name(cell, event.b) + " -> " + component_name(cell, event.c)};
    }
    case EventCode::simulation_fault:
      return {cell.cell,
              "The simulation cannot go on and is paused: " + text + " A reset returns to the start."};
    case EventCode::state_changed:
      return {cell.cell,
              "The simulation is now " + std::string(to_string(static_cast<SimulationState>(event.a))) + "."};
    case EventCode::reset:
      return {cell.cell, "The cell is back in its initial state."};
    case EventCode::pace_changed: {
      const auto pace = static_cast<Pace>(event.a);
      const std::string factor = pace == Pace::realtime ? ", factor " + number_text(event.x) : "";
      return {cell.cell, "The pace is now " + std::string(to_string(pace)) + factor + "."};
    }
    case EventCode::schedule_rebased:
      return {cell.cell,
              "The simulation was " + number_text(event.x) +
                  " s behind its schedule, more than the 0.05 s that are caught up: the schedule was moved."};
    case EventCode::controller_registered:
      return {text,
              "Controller '" + text + "' is registered with a period of " + number_text(event.x) + " s."};
    case EventCode::controller_unregistered:
      return {text, "Controller '" + text + "' is no longer registered."};
    case EventCode::controller_late:
      return {text,
              "The simulation waits for " + awaited() + "; missing for " + number_text(event.y) + " s."};
    case EventCode::controller_timeout:
      return {text, "The simulation is paused: " + awaited() + " did not come within " +
                        number_text(event.y) + " s."};
    case EventCode::command_rejected:
      return describe_rejection(event, cell);
    case EventCode::end_of_scenario:
      return {cell.scenario, "The scenario's duration has been simulated; the simulation is paused."};
    case EventCode::level_of_detail_changed: {
      const std::string process =
          event.a < 0 ? std::string("all processes") : cell.processes[static_cast<std::size_t>(event.a)].name;
      return {process, "The level of detail of " + process + " is now " + std::to_string(event.b) + "."};
    }
    case EventCode::attached: {
      const std::string part = component_name(cell, event.a);
      return {part, part + " is attached to " + component_name(cell, event.b) + " until it is detached."};
    }
    case EventCode::detached: {
      const std::string part = component_name(cell, event.a);
      return {part, part + " is attached to nothing any more; the rules decide who holds it."};
    }
    case EventCode::entity_state_set: {
      const std::string part = component_name(cell, event.a);
      char place[100];
      std::snprintf(place, sizeof place, " was put to (%.6g, %.6g, %.6g) m.", event.position_W.x(),
                    event.position_W.y(), event.position_W.z());
      return {part, part + place};
    }
    case EventCode::weak_grip: {
      const std::string& gripper = cell.grippers[static_cast<std::size_t>(event.a)].name;
      return {gripper, gripper + " presses on " + component_name(cell, event.b) + " with " +
                           number_text(event.y) + " N; friction needs " + number_text(event.x) +
                           " N to carry what hangs on it, which would slip. Remedy: a larger max_force_N, a "
                           "gentler motion, or the contact.grippers.friction that is true."};
    }
    case EventCode::alternating_force: {
      const std::string part = component_name(cell, event.a);
      return {part, "The contact force on " + part + " alternates from step to step by " +
                        number_text(event.x) + " N, where " + component_name(cell, event.b) +
                        " presses most upon it: forces, joint torques and power of this run are not right. "
                        "Remedy: friction_law: stick, a larger friction_velocity_m_per_s, or a smaller "
                        "solver.contact.tolerance."};
    }
    case EventCode::save_refused:
      return {cell.cell, "The periodic snapshot was not taken: " + text};
    case EventCode::events_lost:
      return {cell.cell, std::to_string(event.a) + " events were lost: more came than could be sent."};
  }
  return {};
}

}  // namespace takt
