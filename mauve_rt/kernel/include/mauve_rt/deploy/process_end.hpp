// SPDX-License-Identifier: LGPL-3.0-or-later
// The end of a process: a signal makes the outputs of all components safe before anything else ends.
#pragma once

#include <array>
#include <csignal>

#include "mauve_rt/base/time.hpp"

namespace mauve {

/// Signals that end a process in order. Each would end it at once otherwise, its outputs as they are. SIGHUP stays ignored where
/// the parent process has it so (nohup).
inline constexpr std::array kEndSignals{SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2};

struct EndOptions {
  time_ns_t grace_ns{ms_to_ns(2'700)};  // from the signal to the end of the process, whatever its threads do
  int status{1};                        // its exit status then
  int dump_signal{0};  // raised then, to report where the threads are; 0: none. Its handler may block.
};

/// Blocks the signals in the calling thread and in those that it creates from now on. [setup], first of all, main thread.
void block_end_signals() noexcept;
/// Sleeps until one of the signals comes. Then shuts down every deployer of the process, for good (Deployer::end()): outputs
/// are safe on return. Waits for no other thread but for the components' own, and takes no lock of Python. Threads and memory
/// for the end are there before the signal: a process that gets no more of either ends the same way. Returns the signal. [non-rt]
/// Throws std::bad_alloc or std::system_error, before it sleeps: the system gives too little of them already.
int wait_end_signal(const EndOptions& options = {});

}  // namespace mauve
