// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_examples/exploration.hpp"

#include <sstream>

#include "mauve_examples/map_file.hpp"

namespace mauve_examples {

namespace {

std::vector<std::string> split_names(const std::string& joined) {
  std::vector<std::string> names;
  std::istringstream stream(joined);
  for (std::string name; std::getline(stream, name, ',');) {
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

}  // namespace

bool ExplorationBase::configure_hook() {
  const GridMap world = load_map(shell().map.value());
  const std::vector<std::string> peers = split_names(shell().peers);
  if (peers.size() > kMaxPeers) {
    throw mauve::Error(mauve::ErrorCode::configure_failed, "too many peers",
                       {.element = "property peers",
                        .expected = "at most " + std::to_string(kMaxPeers),
                        .found = std::to_string(peers.size())});
  }
  explorer_ = std::make_unique<Explorer>();
  explorer_->configure(world, shell().robot_name.value(), peers, ExplorerOptions{});
  message_ = std::make_unique<PeerMessage>();
  robot_and_peers_ = shell().robot_name.value() + ": " + shell().peers.value();
  return true;
}

void ExplorationBase::cleanup_hook() {
  explorer_.reset();
  message_.reset();
}

bool ExplorationBase::adopt(const mauve::CoreBase& old) {
  const auto* other = dynamic_cast<const ExplorationBase*>(&old);
  if (other == nullptr) return true;  // nothing of it can be understood: start afresh
  return other->explorer_->geometry() == explorer_->geometry() && other->robot_and_peers_ == robot_and_peers_;
}

void ExplorationBase::take(mauve::CoreBase& old) noexcept {
  auto* other = dynamic_cast<ExplorationBase*>(&old);
  if (other != nullptr) std::swap(explorer_, other->explorer_);
}

void ExplorationBase::look() {
  while (shell().inbox.read(*message_) == mauve::DataStatus::new_data) explorer_->receive(*message_);
  shell().map_get([this](const OccupancyGrid& map) { explorer_->refresh(map); });
  explorer_->look(shell().pose.read().value, clock_ns());
}

void ExplorationBase::decide() {
  if (choose(*explorer_)) shell().goal.write(explorer_->destination());
  shell().done.write({explorer_->done()});
}

void ExplorationBase::tell() {
  explorer_->compose(*message_);
  shell().outbox.write(*message_);
}

}  // namespace mauve_examples
