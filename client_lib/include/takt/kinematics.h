#pragma once
// Kinematics of robot arms, and motions for Client::send_trajectory; everything is in namespace takt.
#include "client_lib/kinematics/arm.h"
