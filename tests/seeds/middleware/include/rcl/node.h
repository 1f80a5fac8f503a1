// SPDX-License-Identifier: LGPL-3.0-or-later
// Stands for <rcl/node.h>.
#pragma once

#include "simulated_rcl.h"
