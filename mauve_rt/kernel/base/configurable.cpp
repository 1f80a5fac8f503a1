// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/configurable.hpp"

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/base/running_hook.hpp"

namespace mauve {

void Configurable::configure() {
  if (configured_) return;
  RunningHook running("configure", description());
  try {
    if (!configure_hook()) {
      throw Error(
          ErrorCode::configure_failed, "configure failed",
          {.element = description(), .expected = "a configure hook that returns true", .found = "false"});
    }
  } catch (const Error&) {
    throw;
  } catch (...) {
    throw Error(ErrorCode::configure_failed, caught_text(), {.element = description()});
  }
  configured_ = true;
  running.leave();
}

void Configurable::cleanup() {
  if (!configured_) return;
  check_cleanup();
  configured_ = false;
  const RunningHook running("cleanup", description());
  try {
    cleanup_hook();
  } catch (
      ...) {  // a clean-up that throws leaves nothing that could be mended; the object counts as cleaned up
  }
}

}  // namespace mauve
