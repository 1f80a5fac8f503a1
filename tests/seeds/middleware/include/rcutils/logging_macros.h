// SPDX-License-Identifier: LGPL-3.0-or-later
// Stands for <rcutils/logging_macros.h>.
#pragma once

#include "simulated_rcl.h"
