// SPDX-License-Identifier: LGPL-3.0-or-later
// Relay: passes data from one resource to another, in its own thread and at its own period.
#pragma once

#include "mauve_rt/elements/selector.hpp"

namespace mauve {

template <Described T>
struct RelayShell : SelectorShell<T, 1> {
  Property<std::int64_t>& max_age_ms = this->property(
      "max_age_ms", 0,
      {.unit = "ms", .description = "older than this the default is written; 0: any age", .minimum = 0});
};

/// Writes what it reads, once when it is new, and the type's default when it has become too old:
///
///   using Shell = mauve::RelayShell<Twist>;
///   architecture.add_component<Shell, mauve::RelayCore<Twist>, mauve::PeriodicUpdateFsm<Shell>>("relay");
///
/// The output carries the relay's time. From a ring buffer it takes one element in each period.
template <Described T>
class RelayCore final : public SelectorCore<RelayShell<T>, T, 1> {
 protected:
  int choose() const override { return this->is_fresh(0, this->shell().max_age_ms) ? 0 : this->kNone; }
};

}  // namespace mauve
