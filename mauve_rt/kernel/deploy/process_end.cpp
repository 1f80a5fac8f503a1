// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/deploy/process_end.hpp"

#include <pthread.h>
#include <unistd.h>

#include <cstdio>

#include "mauve_rt/base/seam/ordinary_thread.hpp"
#include "mauve_rt/base/seam/sleep.hpp"
#include "mauve_rt/base/seam/thread.hpp"
#include "mauve_rt/deploy/deployer.hpp"

namespace mauve {

namespace {

/// For the handler of the dump signal.
constexpr time_ns_t kDump = ms_to_ns(100);

/// As nohup asks. A script has SIGINT and SIGQUIT ignored for what it starts in the background: they end the process all the
/// same.
bool stays_ignored(int signal) noexcept {
  struct sigaction present{};
  sigaction(signal, nullptr, &present);
  return signal == SIGHUP && present.sa_handler == SIG_IGN;
}

sigset_t end_signals() noexcept {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int each : kEndSignals) {
    if (!stays_ignored(each)) sigaddset(&signals, each);
  }
  return signals;
}

}  // namespace

void block_end_signals() noexcept {
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

int wait_end_signal(const EndOptions& options) noexcept {
  const sigset_t signals = end_signals();
  const int signal = await_signal(signals);
  end_process_after(options);  // first: a component that does not end must not keep the process
  Deployer::end_all();
  return signal;
}

void end_process_after(const EndOptions& options) noexcept {
  OrdinaryThread([options] {
    sleep_for(options.grace_ns);
    if (options.dump_signal != 0) {
      OrdinaryThread([options] {
        dprintf(STDERR_FILENO, "The process did not end within %lld ms of the signal. Its threads:\n",
                static_cast<long long>(options.grace_ns / ms_to_ns(1)));
        raise(options.dump_signal);
      }).detach();
      sleep_for(kDump);
    }
    _exit(options.status);
  }).detach();
}

}  // namespace mauve
