// SPDX-License-Identifier: LGPL-3.0-or-later
// Explores every state of the model of open changes.
#pragma once

#include "open_change/scenarios.hpp"
#include "search.hpp"

namespace mauve::model::open_change {

Report explore(const Options& options);

}  // namespace mauve::model::open_change
