// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/resource.hpp"

#include "mauve_rt/futex.hpp"

namespace mauve {

void Notifier::notify() noexcept {
  word_.fetch_add(1, std::memory_order_seq_cst);
  if (waiters_.load(std::memory_order_seq_cst) != 0) futex_wake_all(word_);
}

std::uint32_t Notifier::wait(std::uint32_t seen, time_ns_t until_ns) noexcept {
  waiters_.fetch_add(1, std::memory_order_seq_cst);
  while (word_.load(std::memory_order_seq_cst) == seen) {
    if (!futex_wait_until(word_, seen, until_ns)) break;
  }
  waiters_.fetch_sub(1, std::memory_order_seq_cst);
  return word();
}

ServiceBase* Resource::find_service(std::string_view name) const noexcept {
  for (ServiceBase* service : services_) {
    if (service->name() == name) return service;
  }
  return nullptr;
}

}  // namespace mauve
