// SPDX-License-Identifier: LGPL-3.0-or-later
// The values that random_data writes: each field derives from one number, so that a torn value is seen.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "mauve_rt/mauve_rt.hpp"

#include "seeds/scheduler.hpp"

namespace mauve::testing {

/// What number_of() finds in a value whose fields do not fit together.
inline constexpr double kTorn = -1.0;

template <typename Value>
double number_of(const Value& value) {
  const double number = value.numbers[0];
  for (std::size_t i = 1; i < value.numbers.size(); ++i) {
    if (value.numbers[i] != number * static_cast<double>(i + 1)) return kTorn;
  }
  return number;
}
template <typename Value>
Value value_of(double number) {
  Value value;
  for (std::size_t i = 0; i < value.numbers.size(); ++i)
    value.numbers[i] = number * static_cast<double>(i + 1);
  return value;
}

/// Fits into the front copy of a latest_value.
struct Small {
  std::array<double, 4> numbers{};
};

/// Lies in the slots alone. Its copy takes time, and other threads may run in its middle.
struct Wide {
  std::array<double, 20> numbers{};

  Wide() = default;
  Wide(const Wide& other) { copy(other); }
  Wide& operator=(const Wide& other) {
    if (this != &other) copy(other);
    return *this;
  }
  ~Wide() = default;

 private:
  void copy(const Wide& other) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (i == numbers.size() / 2) seeds::compute(us_to_ns(2));
      numbers[i] = other.numbers[i];
    }
  }
};

/// A call: the response is the request, and kAnswer more.
inline constexpr std::uint32_t kAnswer = 1'000'000;
struct Question {
  struct Request {
    std::uint32_t data{};
  };
  struct Response {
    std::uint32_t data{};
  };
};

}  // namespace mauve::testing

MAUVE_TYPE(mauve::testing::Small, "seeds/msg/Small", numbers)
MAUVE_TYPE(mauve::testing::Wide, "seeds/msg/Wide", numbers)
MAUVE_TYPE(mauve::testing::Question::Request, "seeds/srv/Question_Request", data)
MAUVE_TYPE(mauve::testing::Question::Response, "seeds/srv/Question_Response", data)
MAUVE_CALL_TYPE(mauve::testing::Question, "seeds/srv/Question")
