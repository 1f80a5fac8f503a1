// SPDX-License-Identifier: LGPL-3.0-or-later
#include "explorer.hpp"

#include "model.hpp"

namespace mauve::model {

Report explore(const Options& options) { return Search<Model>(Model(options), options.most_states).run(); }

}  // namespace mauve::model
