// SPDX-License-Identifier: LGPL-3.0-or-later
#include "middleware.hpp"

#include <utility>

#include "mauve_rt/base/seam/futex.hpp"

namespace mauve::testing {

namespace {

Middleware* present = nullptr;

/// Each kind of handles of a wait set, and how many were added.
template <typename Function>
void for_all(const rcl_wait_set_t& set, Function&& function) {
  function(set.subscriptions, set.added[0]);
  function(set.guard_conditions, set.added[1]);
  function(set.clients, set.added[2]);
  function(set.services, set.added[3]);
  function(set.events, set.added[4]);
}

}  // namespace

Middleware::Middleware(std::uint64_t seed, seeds::Findings& findings) : findings_(findings), dice_(seed) {
  present = this;
}
Middleware::~Middleware() { present = nullptr; }
Middleware& Middleware::here() { return *present; }

void Middleware::changed() {
  word_.fetch_add(1, std::memory_order_release);
  futex_wake_all(word_);
}
void Middleware::pass(time_ns_t most_ns) { seeds::compute(dice_.between(0, most_ns)); }

// ---- the network's side

void Middleware::deliver(const std::string& topic, const Bytes& data) {
  for (auto& [number, entity] : entities_) {
    if (entity.kind != Kind::subscription || entity.name != topic) continue;
    if (entity.waiting.size() >= entity.depth) entity.waiting.pop_front();
    entity.waiting.push_back({.data = data, .arrived_ns = seeds::now_ns()});
  }
  changed();
}
void Middleware::respond(const SentRequest& request, const Bytes& data) {
  const auto client = entities_.find(request.client);
  if (client == entities_.end()) return;
  client->second.waiting.push_back(
      {.data = data, .arrived_ns = seeds::now_ns(), .sequence = request.sequence});
  changed();
}
std::int64_t Middleware::request(const std::string& service, const Bytes& data) {
  for (auto& [number, entity] : entities_) {
    if (entity.kind != Kind::service || entity.name != service) continue;
    const std::int64_t sequence = ++last_request_;
    entity.waiting.push_back({.data = data, .arrived_ns = seeds::now_ns(), .sequence = sequence});
    changed();
    return sequence;
  }
  return 0;
}
void Middleware::trouble(const std::string& topic) {
  for (auto& [number, entity] : entities_) {
    if (entity.kind == Kind::event && entity.name == topic) ++entity.news;
  }
  changed();
}
void Middleware::shut_down() {
  is_shut_down_ = true;
  changed();
}

std::uint64_t Middleware::entity_of(const std::string& topic) const {
  for (const auto& [number, entity] : entities_) {
    const bool is_topic = entity.kind == Kind::publisher || entity.kind == Kind::subscription;
    if (is_topic && entity.name == topic) return number;
  }
  return 0;
}
time_ns_t Middleware::waits_since_ns(const std::string& topic) const {
  const auto found = entities_.find(entity_of(topic));
  if (found == entities_.end() || found->second.waiting.empty()) return kForever;
  return found->second.waiting.front().arrived_ns;
}

// ---- entities

std::uint64_t Middleware::open(Entity entity) {
  pass(us_to_ns(20));
  entities_.emplace(++last_number_, std::move(entity));
  return last_number_;
}
Middleware::Entity* Middleware::find(std::uint64_t number, Kind kind, const char* function) {
  const auto found = entities_.find(number);
  const bool is_there = found != entities_.end() && found->second.kind == kind;
  findings_.expect(is_there, std::string(function) + ": its entity has ended, or was never there");
  return is_there ? &found->second : nullptr;
}
void Middleware::close(std::uint64_t number, Kind kind) {
  Entity* const entity = find(number, kind, "fini");
  if (entity == nullptr) return;
  findings_.expect(entity->users == 0, "fini: " + entity->name + " is in use");
  for (const auto& [other, event] : entities_) {
    findings_.expect(event.kind != Kind::event || event.of != number,
                     "fini: an event of " + entity->name + " is left");
  }
  entities_.erase(number);
}

// ---- waits

bool Middleware::is_ready(std::uint64_t number) {
  const auto found = entities_.find(number);
  if (found == entities_.end()) {
    findings_.expect(false, "a wait set has an entity that has ended");
    return false;
  }
  Entity& entity = found->second;
  return entity.is_triggered || entity.news != 0 || !entity.waiting.empty();
}
/// Whether one is ready; at the end of the wait those that are not leave the set.
template <typename Handles>
bool Middleware::mark(Handles* handles, std::size_t added, bool is_over) {
  bool any = false;
  for (std::size_t i = 0; i < added; ++i) {
    if (handles[i] == nullptr) continue;
    const bool ready = is_ready(handles[i]->number);
    any = any || ready;
    if (!is_over) continue;
    if (!ready) {
      handles[i] = nullptr;
    } else {
      entities_.at(handles[i]->number).is_triggered = false;
    }
  }
  return any;
}
bool Middleware::mark_ready(rcl_wait_set_t& set, bool is_over) {
  bool any = false;
  for_all(set, [&](auto* handles, std::size_t added) { any = mark(handles, added, is_over) || any; });
  return any;
}

namespace {

/// What a wait set holds is used while the wait lasts.
class Users {
 public:
  Users(std::map<std::uint64_t, Middleware::Entity>& entities, const rcl_wait_set_t& set)
      : entities_(entities) {
    for_all(set, [this](auto* handles, std::size_t added) { add(handles, added); });
  }
  ~Users() {
    for (const std::uint64_t number : numbers_) {
      if (const auto found = entities_.find(number); found != entities_.end()) --found->second.users;
    }
  }
  Users(const Users&) = delete;
  Users& operator=(const Users&) = delete;

 private:
  template <typename Handles>
  void add(Handles* handles, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      if (const auto found = entities_.find(handles[i]->number); found != entities_.end()) {
        ++found->second.users;
        numbers_.push_back(handles[i]->number);
      }
    }
  }

  std::map<std::uint64_t, Middleware::Entity>& entities_;
  std::vector<std::uint64_t> numbers_;
};

}  // namespace

rcl_ret_t Middleware::wait(rcl_wait_set_t& set, time_ns_t timeout_ns) {
  const time_ns_t until_ns = timeout_ns < 0 ? kForever : seeds::now_ns() + timeout_ns;
  const Users users(entities_, set);
  pass(us_to_ns(5));
  if (fails(failures.wait)) return RCL_RET_ERROR;
  for (;;) {
    const std::uint32_t seen = word_.load(std::memory_order_acquire);
    if (is_shut_down_) return RCL_RET_ERROR;
    if (mark_ready(set, false) || seeds::now_ns() >= until_ns) {
      return mark_ready(set, true) ? RCL_RET_OK : RCL_RET_TIMEOUT;
    }
    futex_wait_until(word_, seen, until_ns);
  }
}

}  // namespace mauve::testing
