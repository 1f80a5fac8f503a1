// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/parts/component_part.hpp"

#include "mauve_rt/base/error.hpp"

namespace mauve {

void throw_no_object(const std::string& part) {
  throw Error(ErrorCode::prepare_failed, "the factory of the part returned no object",
              {.element = part,
               .expected = "another instance of the same",
               .found = "nullptr",
               .remedy = "correct the factory that the part was given"});
}

}  // namespace mauve
