// SPDX-License-Identifier: LGPL-3.0-or-later
// Explores every state of the model of a change.
#pragma once

#include "options.hpp"
#include "search.hpp"

namespace mauve::model {

Report explore(const Options& options);

}  // namespace mauve::model
