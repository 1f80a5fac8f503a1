// SPDX-License-Identifier: LGPL-3.0-or-later
// The kinds of resources that the kernel gives.
#pragma once

#include <tuple>

#include "mauve_rt/data/action_client.hpp"
#include "mauve_rt/data/action_server.hpp"
#include "mauve_rt/data/client.hpp"
#include "mauve_rt/data/event_counter.hpp"
#include "mauve_rt/data/latest_value.hpp"
#include "mauve_rt/data/ring_buffer.hpp"
#include "mauve_rt/data/shared_data.hpp"
#include "mauve_rt/data/transform_tree.hpp"

namespace mauve {

/// Each has describe(), and make(): a template for those of a data type, or of a type of calls or actions; else it gets the type.
using GivenResources = std::tuple<SharedDataKind, RingBufferKind, LatestValueKind, EventKind, ClientKind,
                                  ActionServerKind, ActionClientKind, TransformTreeKind>;

}  // namespace mauve
