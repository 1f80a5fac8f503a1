// SPDX-License-Identifier: LGPL-3.0-or-later
// The .msg files of C++ structs, with or without a ROS message of their own.
#pragma once

#include <string>
#include <vector>

#include "mauve_rt/data/message_shape.hpp"

namespace mauve {

/// The .msg file of a struct.
struct MessageFile {
  std::string type;  // the struct's, as MAUVE_TYPE names it
  std::string name;  // the message's: package/msg/Name
  std::string text;
};

/// The name of the message of a struct of this type: package/msg/Name; without a package: mauve/msg/Name. [non-rt]
std::string message_name(const std::string& type);

/// The file of a struct, then those of the structs within it, each once. [non-rt]
std::vector<MessageFile> message_files(const MessageShape& shape);

}  // namespace mauve
