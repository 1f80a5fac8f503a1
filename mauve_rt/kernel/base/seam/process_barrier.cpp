// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/base/seam/process_barrier.hpp"

#include <linux/membarrier.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace mauve {

namespace {

bool ask(int command) MAUVE_RT { return MAUVE_RT_TRUSTED(syscall(SYS_membarrier, command, 0, 0) == 0); }

const bool is_registered = ask(MEMBARRIER_CMD_REGISTER_PRIVATE_EXPEDITED);

}  // namespace

void process_barrier() noexcept {
  // Registered by the process itself, or by the one that it was forked from; if that does not count, once more.
  while (!ask(MEMBARRIER_CMD_PRIVATE_EXPEDITED)) ask(MEMBARRIER_CMD_REGISTER_PRIVATE_EXPEDITED);
}

bool has_process_barrier() noexcept { return is_registered; }

}  // namespace mauve
