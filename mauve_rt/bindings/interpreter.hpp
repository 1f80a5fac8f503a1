// SPDX-License-Identifier: LGPL-3.0-or-later
// The interpreter's lock, for threads that may outlive the interpreter.
#pragma once

#include <cxxabi.h>
#include <pybind11/pybind11.h>
#include <unistd.h>

#include <optional>
#include <utility>

namespace mauve::bindings {

/// Runs what asks for the interpreter's lock. While the interpreter ends, CPython before 3.14 ends a thread that asks for it by
/// pthread_exit(). That would leave frames that must not be left, and abort the process. The thread stands still instead until
/// the process has ended.
template <typename Call>
decltype(auto) unless_interpreter_ends(Call&& call) {
  try {
    return std::forward<Call>(call)();
  } catch (const abi::__forced_unwind&) {
    for (;;) ::pause();
  }
}

/// Has the interpreter's lock to the end of a block.
class InterpreterLocked {
 public:
  InterpreterLocked() {
    unless_interpreter_ends([this] { lock_.emplace(); });
  }

 private:
  std::optional<pybind11::gil_scoped_acquire> lock_;
};

/// Is without the interpreter's lock to the end of a block.
class InterpreterUnlocked {
 public:
  InterpreterUnlocked() : thread_(PyEval_SaveThread()) {}
  ~InterpreterUnlocked() {
    unless_interpreter_ends([this] { PyEval_RestoreThread(thread_); });
  }
  InterpreterUnlocked(const InterpreterUnlocked&) = delete;
  InterpreterUnlocked& operator=(const InterpreterUnlocked&) = delete;

 private:
  PyThreadState* thread_;
};

}  // namespace mauve::bindings
