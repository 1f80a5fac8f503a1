// SPDX-License-Identifier: LGPL-3.0-or-later
// Threads that leave signals to the process.
#pragma once

#include <pthread.h>

#include <csignal>
#include <thread>
#include <utility>

namespace mauve::bridge {

/// A thread of that name, with every signal blocked. [non-rt]
template <typename Work>
std::thread start_thread(const char* name, Work work) {
  sigset_t all;
  sigset_t callers;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &callers);
  std::thread thread(std::move(work));
  pthread_sigmask(SIG_SETMASK, &callers, nullptr);
  pthread_setname_np(thread.native_handle(), name);
  return thread;
}

}  // namespace mauve::bridge
