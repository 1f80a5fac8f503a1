// SPDX-License-Identifier: LGPL-3.0-or-later
// Explores every state of a model, depth first, each once.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model.hpp"

namespace mauve::model {

struct Report {
  bool is_complete{false};  // every state was explored
  std::string violation;    // empty: every invariant holds
  std::string trace;        // the last states before the violation
  long states{0}, steps{0}, ends{0};
  long made{0}, off{0};  // decisions, over all ends
  double seconds{0};
};

Report explore(const Options& options);

/// States, numbered in the order in which they were found.
class StateStore {
 public:
  struct Found {
    std::uint32_t number;
    bool is_new;
  };
  Found insert(const State& state, std::uint32_t parent);
  const State& operator[](std::uint32_t number) const { return states_[number]; }
  std::uint32_t parent(std::uint32_t number) const { return parents_[number]; }
  long size() const { return static_cast<long>(states_.size()); }

 private:
  void grow();
  std::size_t place(const State& state) const;

  std::vector<State> states_;
  std::vector<std::uint32_t> parents_;
  std::vector<std::uint32_t> table_;  // open addressing: 0, or 1 + number
};

}  // namespace mauve::model
