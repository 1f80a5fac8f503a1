// SPDX-License-Identifier: LGPL-3.0-or-later
#include "conditions/kinds.hpp"

namespace mauve::rules {

namespace {

PeerState state_of(const std::string& name) {
  if (name == "unheard") return PeerState::unheard;
  if (name == "there") return PeerState::there;
  if (name == "another_instance") return PeerState::another_instance;
  if (name == "faulted") return PeerState::faulted;
  return PeerState::gone;
}

double as_value(PeerState state) { return static_cast<double>(state); }

}  // namespace

ConditionKind peer_kind() {
  return {.name = "peer",
          .summary =
              "another executor is gone, was started again, has a FAULTED component, is there, or was never "
              "received",
          .parameters = {{.name = "executor", .type = "executor", .required = true},
                         {.name = "is",
                          .type = "gone|another_instance|faulted|there|unheard",
                          .initial = std::string("gone")}},
          .hears =
              [](const Parameters& told) {
                return std::vector{SignalSpec{SignalKind::peer, text(told, "executor")}};
              },
          .make = [](const Parameters& told, std::span<Signal* const> signals) -> std::unique_ptr<Condition> {
            const PeerState is = state_of(text(told, "is"));
            if (is == PeerState::unheard) return std::make_unique<Equal>(*signals[0], as_value(is));
            return std::make_unique<Equal>(*signals[0], as_value(is), as_value(PeerState::unheard));
          }};
}

}  // namespace mauve::rules
