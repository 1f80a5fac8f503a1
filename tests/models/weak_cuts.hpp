// SPDX-License-Identifier: LGPL-3.0-or-later
// The twins of mauve::Cut, and the call of the cut that a model's twin asks for: by default mauve::Cut itself.
#pragma once

#include <algorithm>

#include "cut_call.hpp"
#include "options.hpp"
#include "state.hpp"

namespace mauve::model {

/// One thread makes one call at a time in the model, so a twin needs no atomic.
class WeakCut {
 public:
  explicit WeakCut(CutWord word) : word_(word) {}
  CutWord look() const { return word_; }
  CutWord raise(time_ns_t clock) {
    if (word_.is_open() && word_.frontier_ns() < clock) word_ = CutWord::open_at(clock);
    return word_;
  }
  CutWord raise_always(time_ns_t clock) { return raise(std::max(clock, word_.instant_ns())); }
  CutWord close() {
    if (word_.is_open()) word_.bits |= CutWord::kClosed;
    return word_;
  }
  bool close_if(CutWord seen) {
    if (word_.bits != seen.bits) return false;
    word_.bits |= CutWord::kClosed;
    return true;
  }
  bool call_off() {
    if (!word_.is_open()) return false;
    word_.bits |= CutWord::kOff;
    return true;
  }

 protected:
  CutWord word_;
};

/// Whether it is decided was looked at too early.
struct CutRaisedByStore : WeakCut {
  using WeakCut::WeakCut;
  CutWord raise(time_ns_t clock) {
    if (word_.frontier_ns() < clock) word_ = CutWord::open_at(clock);
    return word_;
  }
};

struct CutRaisedBackwards : WeakCut {
  using WeakCut::WeakCut;
  CutWord raise(time_ns_t clock) {
    if (word_.is_open()) word_ = CutWord::open_at(clock);
    return word_;
  }
};

struct CutClosedOverOff : WeakCut {
  using WeakCut::WeakCut;
  CutWord close() {
    word_.bits = (word_.bits & ~CutWord::kOff) | CutWord::kClosed;
    return word_;
  }
};

struct CutOffOverClosed : WeakCut {
  using WeakCut::WeakCut;
  bool call_off() {
    word_.bits = (word_.bits & ~CutWord::kClosed) | CutWord::kOff;
    return true;
  }
};

/// T is the frontier, not the clock after it.
struct CutAtFrontier : WeakCut {
  using WeakCut::WeakCut;
  CutWord close() {
    if (word_.is_open() && word_.frontier_ns() > 0) word_ = CutWord::open_at(word_.frontier_ns() - 1);
    return WeakCut::close();
  }
};

template <typename Call>
auto call_cut(Twin twin, std::uint8_t& word, Call call) {
  switch (twin) {
    case Twin::kRaiseByStore:
      return call_on<CutRaisedByStore>(word, call);
    case Twin::kRaiseLowers:
      return call_on<CutRaisedBackwards>(word, call);
    case Twin::kCloseOverOff:
      return call_on<CutClosedOverOff>(word, call);
    case Twin::kOffOverClosed:
      return call_on<CutOffOverClosed>(word, call);
    case Twin::kInstantIsFrontier:
      return call_on<CutAtFrontier>(word, call);
    default:
      return call_on<Cut>(word, call);
  }
}

}  // namespace mauve::model
