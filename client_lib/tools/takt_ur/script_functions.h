#pragma once
// Functions of URScript on a controller that take no time: what they read, and what they set.
#include "client_lib/tools/takt_ur/call_arguments.h"
#include "client_lib/tools/takt_ur/ur_controller.h"

namespace takt::ur {

/// Of the kinds solves and reads. `near`: joint positions from which inverse kinematics searches. Throws ValueError.
urscript::Value read_function(const UrController& controller, const CallArguments& arguments,
                              const Vector6& near);
/// Of the kind sets, and those of the kind acts that take no time; false for others. Throws ValueError.
bool set_function(UrController& controller, const CallArguments& arguments);
/// The two know the function.
bool is_read(std::string_view function);
bool is_set(std::string_view function);

}  // namespace takt::ur
