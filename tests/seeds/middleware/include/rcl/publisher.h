// SPDX-License-Identifier: LGPL-3.0-or-later
// Stands for <rcl/publisher.h>.
#pragma once

#include "simulated_rcl.h"
