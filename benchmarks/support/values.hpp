// SPDX-License-Identifier: LGPL-3.0-or-later
// Values of the sizes that are measured.
#pragma once

#include <array>
#include <cstdint>

#include "mauve_rt/data/cdr.hpp"

namespace bench {

/// 16 bytes; equal halves are whole, others are torn.
struct Small {
  std::int64_t first{};
  std::int64_t second{};
};

/// 4 KiB.
struct Large {
  std::array<double, 512> items{};
};

/// 1 MiB.
struct Huge {
  std::array<double, 131'072> items{};
};

static_assert(sizeof(Small) == 16 && sizeof(Large) == 4096 && sizeof(Huge) == 1'048'576);

}  // namespace bench

MAUVE_TYPE(bench::Small, "bench/Small", first, second)
MAUVE_TYPE(bench::Large, "bench/Large", items)
MAUVE_TYPE(bench::Huge, "bench/Huge", items)
