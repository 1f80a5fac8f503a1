// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

ResourceParameter max_bytes_parameter() {
  return {.name = "max_bytes",
          .initial = std::int64_t{65'536},
          .description = "how large a message may be where no plug-in registered its type",
          .unit = "bytes",
          .minimum = 1,
          .maximum = 268'435'456};
}

}  // namespace mauve
