// SPDX-License-Identifier: LGPL-3.0-or-later
#include "open_change/explorer.hpp"

#include "open_change/model.hpp"

namespace mauve::model::open_change {

Report explore(const Options& options) { return Search<Model>(Model(options), options.most_states).run(); }

}  // namespace mauve::model::open_change
