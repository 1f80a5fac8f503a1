// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/data/message_file.hpp"

#include <algorithm>

namespace mauve {

namespace {

/// geometry_msgs/msg/Point in two parts: geometry_msgs, Point.
struct NameParts {
  std::string package{"mauve"};
  std::string name;
};

NameParts parts_of(const std::string& type) {
  const std::size_t slash = type.rfind('/');
  if (slash == std::string::npos) return {.name = type};
  std::string package = type.substr(0, slash);
  if (package.ends_with("/msg")) package.resize(package.size() - std::string("/msg").size());
  return {.package = package, .name = type.substr(slash + 1)};
}

/// As .msg files may have it: class for class_.
std::string field_name(const std::string& member) {
  return member.substr(0, member.find_last_not_of('_') + 1);
}

void add(const std::string& type, const std::vector<FieldShape>& fields, std::vector<MessageFile>& files) {
  const std::string name = message_name(type);
  if (std::ranges::find(files, name, &MessageFile::name) != files.end()) return;
  const std::size_t place = files.size();
  files.push_back({.type = type, .name = name, .text = {}});
  std::string text;
  for (const FieldShape& field : fields) {
    std::string item = item_text(field);
    if (!field.fields.empty() || field.type.find('/') != std::string::npos) {  // a message, an empty one too
      const NameParts parts = parts_of(field.type);
      item = parts.package + "/" + parts.name;
      add(field.type, field.fields, files);
    }
    text += item + array_text(field) + " " + field_name(field.name) + "\n";
  }
  files[place].text = text;
}

}  // namespace

std::string message_name(const std::string& type) {
  const NameParts parts = parts_of(type);
  return parts.package + "/msg/" + parts.name;
}

std::vector<MessageFile> message_files(const MessageShape& shape) {
  std::vector<MessageFile> files;
  add(shape.type, shape.fields, files);
  return files;
}

}  // namespace mauve
