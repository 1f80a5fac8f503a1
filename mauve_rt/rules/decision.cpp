// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/rules/decision.hpp"

#include <array>

namespace mauve::rules {

namespace {

constexpr auto kDecided = std::to_array<std::string_view>(
    {"armed", "suppressed", "adopted", "condition_true", "condition_false", "condition_unknown", "do", "undo",
     "otherwise", "done", "failed", "suppressed"});
constexpr auto kActNames = std::to_array<std::string_view>({"do", "undo", "otherwise"});
constexpr auto kWhy = std::to_array<std::string_view>(
    {"", "it is in effect already", "changed by another requester: left alone until the condition ends",
     "cooldown", "outranked by a rule of higher rank", "the action of another rule is under way",
     "it is not prepared", "refused", "what it was prepared against has changed",
     "something more urgent came between", "not carried out in time"});

}  // namespace

std::string_view name_of(Decided decided) noexcept { return kDecided[static_cast<std::size_t>(decided)]; }
std::string_view name_of(Act act) noexcept { return kActNames[index_of(act)]; }
std::int64_t trace_code(const Decision& decision) noexcept {
  // Those of the last three are by act.
  constexpr auto kAlone = std::to_array<std::int64_t>({0, 1, 2, 3, 4, 16, 5, 6, 13});
  constexpr std::array<std::array<std::int64_t, kActs>, 3> kOfAct{{{7, 8, 14}, {9, 10, 15}, {11, 12, 11}}};
  const auto decided = static_cast<std::size_t>(decision.decided);
  return decided < kAlone.size() ? kAlone[decided] : kOfAct[decided - kAlone.size()][index_of(decision.act)];
}
std::string_view words_of(Why why) noexcept { return kWhy[static_cast<std::size_t>(why)]; }

}  // namespace mauve::rules
