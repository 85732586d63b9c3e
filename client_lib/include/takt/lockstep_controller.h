#pragma once
// Commands in step with the simulated time of a cell.
#include "client_lib/lockstep_controller.h"
