// SPDX-License-Identifier: LGPL-3.0-or-later
// SharedData: the newest value, of any number of writers, for any number of readers.
#pragma once

#include <memory>

#include "mauve_rt/data/newest_value.hpp"
#include "mauve_rt/data/resource_kind.hpp"

namespace mauve {

/// One value; services `read` and `write`, any number of each. Readers never wait; writers among themselves have a lock
/// with priority inheritance.
template <Described T>
class SharedData final : public NewestValue<T> {
 public:
  /// `capacities`: of the sequences of T. [setup]
  explicit SharedData(Capacities capacities = {})
      : NewestValue<T>("shared_data", {}, 0, std::move(capacities)) {}
};

/// As architectures name and make it. All functions [setup].
struct SharedDataKind {
  static ResourceKind describe() {
    return {
        .name = "shared_data",
        .parameters = {max_bytes_parameter()},
        .type = TypeNeed::data,
        .values =
            5};  // its newest, one that is being written, one for others than ports, and one on its way in and one out
  }
  template <Described T>
  static std::unique_ptr<Resource> make(const ResourceParameters& given) {
    return std::make_unique<SharedData<T>>(capacities_of(message_shape<T>(), given));
  }
};

}  // namespace mauve
