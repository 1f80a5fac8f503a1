// SPDX-License-Identifier: LGPL-3.0-or-later
// Stands for <rmw/events_statuses/events_statuses.h>.
#pragma once

#include "simulated_rcl.h"
