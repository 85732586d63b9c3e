#pragma once
#include "client_lib/kinematics/arm.h"
