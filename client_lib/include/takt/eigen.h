#pragma once
// Vectors, rotations and poses of a cell as types of Eigen: to_eigen(), and back.
#include "idl/common/eigen_messages.h"
