// SPDX-License-Identifier: LGPL-3.0-or-later
#include "mauve_rt/architecture/plugin_index.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <fstream>
#include <span>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "mauve_rt/architecture/plugin.hpp"

namespace mauve {

namespace {

constexpr std::array kKinds{"type", "call_type", "action_type", "resource", "shell", "core", "fsm"};

std::string shell_of(const PluginRegistry& registry, std::string_view kind, const std::string& name) {
  if (kind == "core") return registry.core_shell(name);
  return kind == "fsm" ? registry.fsm_shell(name) : "";
}

std::string content_of(const std::string& name) {
  std::ifstream file(name);
  std::ostringstream content;
  content << file.rdbuf();
  if (!file) throw std::runtime_error("cannot read " + name);
  return content.str();
}

void write_index(std::span<char*> words) {
  if (words.empty()) throw std::invalid_argument("expected OUTPUT [--with FILE] [TARGET LIBRARY]...");
  const std::string output = words[0];
  words = words.subspan(1);
  std::string text = "# kind; name; shell; library or module:Class\n";
  if (words.size() >= 2 && std::string_view(words[0]) == "--with") {
    text = content_of(words[1]);
    if (!text.ends_with('\n')) text += '\n';
    words = words.subspan(2);
  }
  PluginRegistry registry;
  for (; words.size() >= 2; words = words.subspan(2)) text += plugin_lines(registry, words[1], words[0]);
  std::ofstream file(output);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + output);
}

}  // namespace

std::string plugin_lines(PluginRegistry& registry, const std::string& library, const std::string& target) {
  std::array<std::vector<std::string>, kKinds.size()> before;
  for (std::size_t i = 0; i < kKinds.size(); ++i) before[i] = registry.names(kKinds[i]);
  registry.load_library(library);
  const std::vector<ResourceKind> given = PluginRegistry::given_resource_kinds();  // which get types by it
  std::string lines;
  for (std::size_t i = 0; i < kKinds.size(); ++i) {
    const std::string kind = kKinds[i];
    for (const std::string& name : registry.names(kind)) {
      if (std::ranges::binary_search(before[i], name) ||
          std::ranges::find(given, name, &ResourceKind::name) != given.end())
        continue;
      for (const std::string& word : {kind, name, shell_of(registry, kind, name)})
        lines.append(word).append("; ");
      lines.append(target) += '\n';
    }
  }
  return lines;
}

int write_plugin_index(int count, char** words) {
  try {
    write_index(std::span(words, static_cast<std::size_t>(count)).subspan(1));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mauve_rt_register_plugins: %s\n", error.what());
    return 1;
  }
}

}  // namespace mauve
