// SPDX-License-Identifier: LGPL-3.0-or-later
// The functions of round_trip.hpp for Python.
#include "round_trip.hpp"

/// The bytes written to `out`; -1: refused; -2: no struct of this name; -3: no room.
extern "C" long mauve_round_trip(const char* type, const std::byte* in, std::size_t size, std::byte* out,
                                 std::size_t room, std::size_t capacity) {
  const auto found = round_trip::functions().find(type);
  if (found == round_trip::functions().end()) return -2;
  std::vector<std::byte> written;
  if (!found->second({in, size}, written, capacity)) return -1;
  if (written.size() > room) return -3;
  std::ranges::copy(written, out);
  return static_cast<long>(written.size());
}
