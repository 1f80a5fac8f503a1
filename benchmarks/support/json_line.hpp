// SPDX-License-Identifier: LGPL-3.0-or-later
// One line of JSON: a flat object of numbers and lists of numbers.
#pragma once

#include <cstdint>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

namespace bench {

class JsonLine {
 public:
  JsonLine& add(const std::string& name, std::int64_t value) {
    key(name) << value;
    return *this;
  }
  JsonLine& add(const std::string& name, const std::vector<std::int64_t>& values) {
    key(name) << '[';
    for (std::size_t i = 0; i < values.size(); ++i) text_ << (i == 0 ? "" : ", ") << values[i];
    text_ << ']';
    return *this;
  }
  void print() const { std::cout << '{' << text_.str() << '}' << std::endl; }

 private:
  std::ostream& key(const std::string& name) {
    if (text_.tellp() > 0) text_ << ", ";
    return text_ << '"' << name << "\": ";
  }

  std::ostringstream text_;
};

}  // namespace bench
