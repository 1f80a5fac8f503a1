// SPDX-License-Identifier: LGPL-3.0-or-later
// The search through the states of a model: depth first, each state once, compared by its bytes.
//
// A model has a type State and the functions initial, successors, check_end, violation, describe and decisions.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <deque>
#include <string>
#include <utility>
#include <vector>

namespace mauve::model {

struct Decisions {
  int made{0}, off{0};
};

struct Report {
  bool is_complete{false};  // every state was explored
  std::string violation;    // empty: every invariant holds
  std::string trace;        // the last states before the violation
  long states{0}, steps{0}, ends{0};
  long made{0}, off{0};  // decisions, over all ends
  double seconds{0};
};

/// States, numbered in the order in which they were found.
template <typename State>
class StateStore {
 public:
  struct Found {
    std::uint32_t number;
    bool is_new;
  };

  Found insert(const State& state) {
    if (table_.size() < 2 * (states_.size() + 1)) grow();
    const std::uint32_t bits = hash(state);
    Entry& entry = table_[place(bits, &state)];
    if (entry.is_used()) return {entry.number - 1, false};
    states_.push_back(state);
    entry = {bits, static_cast<std::uint32_t>(states_.size())};
    return {entry.number - 1, true};
  }
  const State& operator[](std::uint32_t number) const { return states_[number]; }
  long size() const { return static_cast<long>(states_.size()); }

 private:
  struct Entry {
    std::uint32_t hash{0};
    std::uint32_t number{0};  // 0, or 1 + number

    bool is_used() const { return number != 0; }
  };

  static std::uint32_t hash(const State& state) {
    constexpr std::uint64_t kFactor = 0x9E3779B97F4A7C15ULL;
    const auto* bytes = reinterpret_cast<const unsigned char*>(&state);
    std::uint64_t bits = kFactor;
    for (std::size_t i = 0; i < sizeof state; i += sizeof bits) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes + i, i + sizeof word <= sizeof state ? sizeof word : sizeof state - i);
      bits = (bits ^ word) * kFactor;
      bits ^= bits >> 29;
    }
    return static_cast<std::uint32_t>(bits ^ (bits >> 32));
  }

  /// Where the state is in the table, or where it would go. Without a state: where there is room for this hash.
  std::size_t place(std::uint32_t bits, const State* state) const {
    std::size_t at = bits & (table_.size() - 1);
    while (table_[at].is_used() && !(state != nullptr && is_same(table_[at], bits, *state)))
      at = (at + 1) & (table_.size() - 1);
    return at;
  }
  bool is_same(const Entry& entry, std::uint32_t bits, const State& state) const {
    return entry.hash == bits && std::memcmp(&states_[entry.number - 1], &state, sizeof state) == 0;
  }

  void grow() {
    std::vector<Entry> old(table_.empty() ? 1 << 16 : table_.size() * 2);
    old.swap(table_);
    for (const Entry& entry : old) {
      if (entry.is_used()) table_[place(entry.hash, nullptr)] = entry;
    }
  }

  std::deque<State> states_;
  std::vector<Entry> table_;  // open addressing
};

template <typename Model>
class Search {
 public:
  using State = typename Model::State;

  Search(Model model, long most_states) : model_(std::move(model)), most_states_(most_states) {}

  Report run() {
    const auto began = std::chrono::steady_clock::now();
    enter(store_.insert(model_.initial()).number);
    while (!path_.empty() && model_.violation().empty() && store_.size() < most_states_) advance();
    report_.is_complete = path_.empty() && report_.violation.empty();
    if (report_.violation.empty()) report_.violation = model_.violation();
    report_.states = store_.size();
    report_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    return report_;
  }

 private:
  static constexpr std::size_t kShownStates = 16;

  struct Visit {
    std::uint32_t number;
    std::size_t first;  // of its successors in pending_
  };

  void advance() {
    const Visit visit = path_.back();
    if (pending_.size() == visit.first) {
      is_on_path_[visit.number] = false;
      path_.pop_back();
      return;
    }
    const State to = pending_.back();
    pending_.pop_back();
    ++report_.steps;
    const auto found = store_.insert(to);
    if (found.is_new) {
      enter(found.number);
    } else if (is_on_path_[found.number]) {
      report_.violation = "a run has no end";
      report_.trace = trace();
      path_.clear();
    }
  }

  void enter(std::uint32_t number) {
    const State here = store_[number];
    is_on_path_.push_back(true);
    path_.push_back({number, pending_.size()});
    const std::vector<State>& next = model_.successors(here);
    pending_.insert(pending_.end(), next.begin(), next.end());
    if (next.empty()) count_end(here);
    if (!model_.violation().empty()) report_.trace = trace();
  }

  void count_end(const State& state) {
    model_.check_end(state);
    ++report_.ends;
    const Decisions decisions = model_.decisions(state);
    report_.made += decisions.made;
    report_.off += decisions.off;
  }

  std::string trace() const {
    std::string text;
    for (std::size_t at = path_.size() - std::min(path_.size(), kShownStates); at < path_.size(); ++at)
      text += model_.describe(store_[path_[at].number]) + "\n";
    return text;
  }

  Model model_;
  long most_states_;
  StateStore<State> store_;
  std::vector<bool> is_on_path_;
  std::vector<Visit> path_;
  std::vector<State> pending_;  // successors that are not explored yet, of each visit on the path
  Report report_;
};

}  // namespace mauve::model
