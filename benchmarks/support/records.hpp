// SPDX-License-Identifier: LGPL-3.0-or-later
// What a benchmark program remembers, as a file of 64 bit integers.
#pragma once

#include <fstream>
#include <span>
#include <stdexcept>
#include <string>

namespace bench {

/// Throws std::runtime_error when the file cannot be written.
template <typename Record>
void write_records(const std::string& name, std::span<const Record> records) {
  std::ofstream file(name, std::ios::binary);
  file.write(reinterpret_cast<const char*>(records.data()),
             static_cast<std::streamsize>(records.size_bytes()));
  if (!file.flush()) throw std::runtime_error("cannot write " + name);
}

}  // namespace bench
