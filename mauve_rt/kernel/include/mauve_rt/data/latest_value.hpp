// SPDX-License-Identifier: LGPL-3.0-or-later
// LatestValue: the newest value of one writer, for a number of readers that is known from the start.
#pragma once

#include <memory>
#include <string>

#include "mauve_rt/base/error.hpp"
#include "mauve_rt/data/newest_value.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

inline constexpr std::uint32_t kDefaultMaxReaders = 14;
inline constexpr std::uint32_t kMostReaders = 1000;
/// Readers whose component was removed while a state of it hung keep their place until that ends.
inline constexpr std::uint32_t kLeftBehind = 2;

/// One value of a trivially copyable type; services `read` (at most max_readers ports) and `write` (one port, or an incoming
/// topic). Connecting a reader allocates nothing.
template <Described T>
class LatestValue final : public NewestValue<T> {
  static_assert(!kHasSequences<T>,
                "a latest_value holds values in place: use shared_data for a type with sequences");

 public:
  /// Throws Error (out_of_range). [setup]
  explicit LatestValue(std::uint32_t max_readers = kDefaultMaxReaders)
      : NewestValue<T>("latest_value", {.readers = checked(max_readers), .writers = 1},
                       max_readers + kLeftBehind) {}

  /// [rt]
  std::uint32_t max_readers() const MAUVE_RT { return this->read.max_ports(); }

 private:
  static std::uint32_t checked(std::uint32_t max_readers) {
    if (max_readers >= 1 && max_readers <= kMostReaders) return max_readers;
    throw Error(ErrorCode::out_of_range, "a latest_value cannot have that many readers",
                {.element = "max_readers",
                 .expected = "1 to " + std::to_string(kMostReaders),
                 .found = std::to_string(max_readers)});
  }
};

/// As architectures name and make it. All functions [setup].
struct LatestValueKind {
  static ResourceKind describe() {
    return {.name = "latest_value",
            .parameters = {{.name = "max_readers",
                            .initial = std::int64_t{kDefaultMaxReaders},
                            .description = "how many ports may read it",
                            .minimum = 1,
                            .maximum = kMostReaders,
                            .values_each = 1,
                            .is_reader_limit = true}},
            .type = TypeNeed::data,
            .values = 3,
            .has_one_writer = true};
  }
  template <Described T>
    requires std::is_trivially_copyable_v<T>  // which one with sequences is not
  static std::unique_ptr<Resource> make(const ResourceParameters& given) {
    return std::make_unique<LatestValue<T>>(
        static_cast<std::uint32_t>(get<std::int64_t>(given, "max_readers")));
  }
};

}  // namespace mauve
