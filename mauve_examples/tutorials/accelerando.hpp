// SPDX-License-Identifier: LGPL-3.0-or-later
// Another core for the same shell and fsm, to replace the metronome's while it runs.
#pragma once

#include <algorithm>

#include "metronome.hpp"

namespace mauve_tutorials {

/// Brings each beat forward by one tick more than the last, until it beats twice as fast.
class Accelerando final : public Metronome {
 public:
  bool is_beat_due() const override {
    const std::int64_t slow = shell().ticks_per_beat;
    return ticks() >= std::max(slow / 2, slow - (beats() - first_beat_));
  }

  /// Takes over at the tempo it finds.
  void take(mauve::CoreBase& /*old*/) noexcept override { first_beat_ = beats(); }

 private:
  std::int64_t first_beat_{0};
};

}  // namespace mauve_tutorials
