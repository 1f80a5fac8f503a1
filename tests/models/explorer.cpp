// SPDX-License-Identifier: LGPL-3.0-or-later
#include "explorer.hpp"

#include <chrono>
#include <cstring>

namespace mauve::model {

namespace {

constexpr std::size_t kShownStates = 16;

std::uint64_t hash(const State& state) {
  std::uint64_t bits = 1469598103934665603ULL;  // FNV-1a
  const auto* byte = reinterpret_cast<const unsigned char*>(&state);
  for (std::size_t i = 0; i < sizeof state; ++i) bits = (bits ^ byte[i]) * 1099511628211ULL;
  return bits ^ (bits >> 29);
}

class Explorer {
 public:
  explicit Explorer(const Options& options) : options_(options), model_(options) {}

  Report run() {
    const auto began = std::chrono::steady_clock::now();
    enter(store_.insert(model_.initial(), 0).number);
    while (!path_.empty() && model_.violation().empty() && store_.size() < options_.most_states) advance();
    report_.is_complete = path_.empty();
    report_.violation = model_.violation();
    report_.states = store_.size();
    report_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    return report_;
  }

 private:
  struct Visit {
    std::uint32_t number;
    std::vector<State> rest;  // successors not explored yet
  };

  void advance() {
    Visit& visit = path_.back();
    if (visit.rest.empty()) {
      is_on_path_[visit.number] = false;
      path_.pop_back();
      return;
    }
    const State to = visit.rest.back();
    visit.rest.pop_back();
    ++report_.steps;
    const auto found = store_.insert(to, visit.number);
    if (found.is_new) {
      enter(found.number);
    } else if (is_on_path_[found.number]) {
      report_.violation = "a run has no end";
      report_.trace = trace(found.number);
      path_.clear();
    }
  }

  void enter(std::uint32_t number) {
    const State here = store_[number];
    is_on_path_.push_back(true);
    const std::vector<State>& next = model_.successors(here);
    if (next.empty()) count_end(here);
    if (!model_.violation().empty()) report_.trace = trace(number);
    path_.push_back({number, next});
  }

  void count_end(const State& state) {
    model_.check_end(state);
    ++report_.ends;
    for (int k = 0; k < options_.changes; ++k)
      ++(state.changes[k].cut().is_closed() ? report_.made : report_.off);
  }

  std::string trace(std::uint32_t number) const {
    std::vector<std::uint32_t> path{number};
    while (path.back() != 0 && path.size() < kShownStates) path.push_back(store_.parent(path.back()));
    std::string text;
    for (auto at = path.rbegin(); at != path.rend(); ++at) text += model_.describe(store_[*at]) + "\n";
    return text;
  }

  Options options_;
  Model model_;
  StateStore store_;
  std::vector<bool> is_on_path_;
  std::vector<Visit> path_;
  Report report_;
};

}  // namespace

Report explore(const Options& options) { return Explorer(options).run(); }

/// Where the state is in the table, or where it would go.
std::size_t StateStore::place(const State& state) const {
  std::size_t at = hash(state) & (table_.size() - 1);
  while (table_[at] != 0 && std::memcmp(&states_[table_[at] - 1], &state, sizeof state) != 0)
    at = (at + 1) & (table_.size() - 1);
  return at;
}

void StateStore::grow() {
  table_.assign(table_.empty() ? 1 << 16 : table_.size() * 2, 0);
  for (std::size_t i = 0; i < states_.size(); ++i)
    table_[place(states_[i])] = static_cast<std::uint32_t>(i + 1);
}

StateStore::Found StateStore::insert(const State& state, std::uint32_t parent) {
  if (table_.size() < 2 * (states_.size() + 1)) grow();
  const std::size_t at = place(state);
  if (table_[at] != 0) return {table_[at] - 1, false};
  states_.push_back(state);
  parents_.push_back(parent);
  table_[at] = static_cast<std::uint32_t>(states_.size());
  return {table_[at] - 1, true};
}

}  // namespace mauve::model
