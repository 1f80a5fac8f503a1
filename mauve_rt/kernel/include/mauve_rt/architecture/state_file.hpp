// SPDX-License-Identifier: LGPL-3.0-or-later
// The file in which an executor keeps what rules and persons decided, for the executor that comes after a restart.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "mauve_rt/architecture/overlays.hpp"

namespace mauve {

/// One record a line, for a person to read: the version first, a sum over all before it last. [non-rt]
std::string text_of(const KeptState& state);
/// Throws Error (invalid_argument): the text is damaged, or of another version; the detail says where. [non-rt]
KeptState kept_state_of(std::string_view text);

/// Nothing: there is no file. [non-rt] Throws Error (invalid_argument): the file is damaged, or cannot be read.
std::optional<KeptState> read_state_file(const std::filesystem::path& path);
/// Puts the text in the place of the file, whole or not at all, whenever the process or the computer ends. Creates the folder. [non-rt]
/// Throws Error (io): the folder cannot be written; the file is as before.
void write_state_file(const std::filesystem::path& path, std::string_view text);

}  // namespace mauve
