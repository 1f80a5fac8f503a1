// SPDX-License-Identifier: LGPL-3.0-or-later
// A call of a cut whose word is kept in a model's state.
#pragma once

#include <cstdint>

#include "mauve_rt/run/cut.hpp"

namespace mauve::model {

/// One call of the cut is one step: its compare-exchange takes effect at one moment.
template <typename AnyCut, typename Call>
auto call_on(std::uint8_t& word, Call call) {
  AnyCut cut{CutWord{word}};
  const auto answer = call(cut);
  word = static_cast<std::uint8_t>(cut.look().bits);
  return answer;
}

}  // namespace mauve::model
