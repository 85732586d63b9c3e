#pragma once
// The C++ interface to a running cell; everything is in namespace takt.
#include "client_lib/client.h"
