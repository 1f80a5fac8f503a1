// SPDX-License-Identifier: LGPL-3.0-or-later
// Handover: what a core takes over from the one that it replaces.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "mauve_rt/base/rt.hpp"

namespace mauve {

class CoreBase;

/// The state fields of two cores, matched by name and type, then adopt and take. Cores of different generations see nothing of
/// each other but these fields: a C++ type of the same name may have another layout there.
///
/// The constructor runs while the old core does; adopt() and take() run as CoreBase::adopt and CoreBase::take.
class Handover {
 public:
  /// [non-rt]
  Handover(CoreBase& old, CoreBase& fresh);
  ~Handover();
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;

  /// Whether the core to take over from is the one that this was made for. [rt]
  bool is_from(const CoreBase& core) const MAUVE_RT { return &old_ == &core; }
  /// Whether adopt() and take() of the new core see a core of no known C++ type: the two are of different builds. [non-rt]
  bool is_between_builds() const noexcept { return stranger_ != nullptr; }
  /// CoreBase::adopt. [rt] as far as the core is.
  bool adopt() const;
  /// Copies the matching fields, then CoreBase::take. [rt] as far as the cores are.
  void take() noexcept;
  /// Copies the matching fields, and leaves the old core as it is. [rt] as far as the cores are.
  void copy() noexcept;

  /// How many bytes the matching fields have. [rt]
  std::size_t bytes() const MAUVE_RT { return bytes_; }
  /// These bytes: of the old core, and for the new one. [rt] as far as the cores are.
  void save(std::byte* fields) noexcept;
  void load(const std::byte* fields) noexcept;

  /// Names of the fields that are taken over. [non-rt]
  const std::vector<std::string>& taken() const noexcept { return taken_; }
  /// One line for each field that is not: "gain: float32 before, float64 now". [non-rt]
  const std::vector<std::string>& left() const noexcept { return left_; }
  /// Whether each field of the old core could be read in take(). [non-rt], after it.
  bool is_whole() const noexcept { return is_whole_; }

 private:
  struct Copy {
    const void* from;
    void* to;
    std::size_t bytes;
  };

  CoreBase& old_;
  CoreBase& fresh_;
  std::unique_ptr<CoreBase> stranger_;  // in the place of an old core of another generation
  std::vector<Copy> copies_;
  std::size_t bytes_{0};
  std::vector<std::string> taken_;
  std::vector<std::string> left_;
  bool is_whole_{true};
};

}  // namespace mauve
