// SPDX-License-Identifier: LGPL-3.0-or-later
// Stands for <rosidl_runtime_c/service_type_support_struct.h>.
#pragma once

#include "simulated_rcl.h"
