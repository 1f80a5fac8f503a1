// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/decision.hpp"

#include <array>

namespace mauve::rules {

namespace {

constexpr auto kDecided =
    std::to_array<std::string_view>({"armed", "suppressed", "adopted", "condition_true", "condition_false",
                                     "do", "undo", "done", "failed", "suppressed"});
constexpr auto kWhy = std::to_array<std::string_view>(
    {"", "it is in effect already", "changed by another hand: left alone until the condition ends",
     "cooldown", "outranked by a rule of higher rank", "the action of another rule is under way",
     "it is not prepared", "refused", "what it was prepared against has changed",
     "something more urgent came between", "not carried out in time"});

}  // namespace

std::string_view name_of(Decided decided) noexcept { return kDecided[static_cast<std::size_t>(decided)]; }
std::int64_t trace_code(const Decision& decision) noexcept {
  // The acts of the last three have codes of their own.
  constexpr auto kFirst = std::to_array<std::int64_t>({0, 1, 2, 3, 4, 5, 6, 7, 9, 11});
  const bool has_act = decision.decided >= Decided::done;
  return kFirst[static_cast<std::size_t>(decision.decided)] + (has_act && decision.act == Act::undo ? 1 : 0);
}
std::string_view words_of(Why why) noexcept { return kWhy[static_cast<std::size_t>(why)]; }

}  // namespace mauve::rules
