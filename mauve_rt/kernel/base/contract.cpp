// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/contract.hpp"

#include <unistd.h>

#include "mauve_rt/base/error.hpp"

namespace mauve::detail {

namespace {

Error error_of(const Contract& contract) {
  return {ErrorCode::internal, "broken " + std::string(contract.kind) + ": " + contract.condition,
          ErrorDetail{.element = std::string(contract.file) + ":" + std::to_string(contract.line),
                      .remedy = "report this line: it names a defect in the code"}};
}

}  // namespace

void break_contract(const Contract& contract) {
  // Before the throw, which ends the process in a noexcept function.
  const std::string line = "mauve_rt: " + std::string(error_of(contract).what()) + "\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
  throw error_of(contract);
}

}  // namespace mauve::detail
