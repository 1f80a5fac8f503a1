// SPDX-License-Identifier: LGPL-3.0-or-later
// What the programs and the plug-in for large messages have in common: which messages, and what is known of each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "mauve_rt/base/time.hpp"

#include "support/records.hpp"

namespace bench {

/// An image of 1920 x 1080 points of three bytes; a cloud of 65,536 points of 16 bytes.
inline constexpr std::size_t kImageBytes = 6'220'800;
inline constexpr std::size_t kCloudBytes = 1'048'576;

/// Fills the contents, as a driver does, and says when: in `stamp`, whose seconds and nanoseconds are of CLOCK_MONOTONIC.
template <typename Stamp>
void fill(Stamp& stamp, std::uint8_t* data, std::size_t bytes, std::uint8_t pattern) {
  std::memset(data, pattern, bytes);
  const mauve::time_ns_t now = mauve::monotonic_now_ns();
  stamp.sec = static_cast<std::int32_t>(now / mauve::s_to_ns(1));
  stamp.nanosec = static_cast<std::uint32_t>(now % mauve::s_to_ns(1));
}

/// Instants sent and taken; written to a file as 64 bit integers.
class Arrivals {
 public:
  explicit Arrivals(std::size_t room = 100'000) : rows_(2 * room) {}

  /// Whether the contents are whole is said, too: else the instant sent is 0.
  template <typename Stamp>
  void add(const Stamp& stamp, const std::uint8_t* data, std::size_t bytes, std::size_t expected) {
    const bool is_whole = bytes == expected && data[0] == data[bytes - 1];
    if (count_ + 2 > rows_.size()) return;
    rows_[count_++] = is_whole ? mauve::s_to_ns(stamp.sec) + stamp.nanosec : 0;
    rows_[count_++] = mauve::monotonic_now_ns();
  }
  void write(const std::string& name) const {
    write_records(name, std::span<const mauve::time_ns_t>(rows_.data(), count_));
  }

 private:
  std::vector<mauve::time_ns_t> rows_;  // pages touched
  std::size_t count_{0};
};

}  // namespace bench
