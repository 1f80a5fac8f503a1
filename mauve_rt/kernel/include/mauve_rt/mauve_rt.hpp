// SPDX-License-Identifier: LGPL-3.0-or-later
// Everything of the kernel that components, resources and programs need.
#pragma once

#include "mauve_rt/architecture.hpp"
#include "mauve_rt/bounded.hpp"
#include "mauve_rt/cdr.hpp"
#include "mauve_rt/component.hpp"
#include "mauve_rt/core.hpp"
#include "mauve_rt/deployer.hpp"
#include "mauve_rt/error.hpp"
#include "mauve_rt/fsm.hpp"
#include "mauve_rt/function_ref.hpp"
#include "mauve_rt/pi_mutex.hpp"
#include "mauve_rt/plugin.hpp"
#include "mauve_rt/port.hpp"
#include "mauve_rt/property.hpp"
#include "mauve_rt/resource.hpp"
#include "mauve_rt/ring_buffer.hpp"
#include "mauve_rt/shared_data.hpp"
#include "mauve_rt/shell.hpp"
#include "mauve_rt/time.hpp"
#include "mauve_rt/trace.hpp"
