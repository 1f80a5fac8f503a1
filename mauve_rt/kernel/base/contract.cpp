// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/contract.hpp"

#include <unistd.h>

#include "mauve_rt/base/error.hpp"

namespace mauve::detail {

void break_contract(const Contract& contract) {
  const Error broken(ErrorCode::internal, "broken " + std::string(contract.kind) + ": " + contract.condition,
                     {.element = std::string(contract.file) + ":" + std::to_string(contract.line),
                      .remedy = "report this line: it names a defect in the code"});
  // Before the throw: it may end the process, in a noexcept function.
  const std::string line = "mauve_rt: " + std::string(broken.what()) + "\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
  throw broken;
}

}  // namespace mauve::detail
