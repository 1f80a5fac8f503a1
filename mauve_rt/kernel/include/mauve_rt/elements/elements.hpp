// SPDX-License-Identifier: LGPL-3.0-or-later
// Basic elements: common types and shells, ready machines, servers, relay and multiplexers, controller and filters.
#pragma once

#include "mauve_rt/elements/multiplexer.hpp"
#include "mauve_rt/elements/number_filters.hpp"
#include "mauve_rt/elements/periodic_fsm.hpp"
#include "mauve_rt/elements/pid.hpp"
#include "mauve_rt/elements/registration.hpp"
#include "mauve_rt/elements/relay.hpp"
#include "mauve_rt/elements/servers.hpp"
#include "mauve_rt/elements/shells.hpp"
#include "mauve_rt/elements/types.hpp"
#include "mauve_rt/elements/update.hpp"
