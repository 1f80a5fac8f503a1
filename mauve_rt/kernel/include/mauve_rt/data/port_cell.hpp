// SPDX-License-Identifier: LGPL-3.0-or-later
// PortCell: a place of its own for the values of one port, in the place of a resource.
#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include "mauve_rt/base/rt.hpp"
#include "mauve_rt/data/service.hpp"

namespace mauve {

/// Serves one port, on one thread at a time. The port makes the cell, as the port knows the type (PortBase::make_cell()).
class PortCell {
 public:
  PortCell() = default;
  virtual ~PortCell() = default;
  PortCell(const PortCell&) = delete;
  PortCell& operator=(const PortCell&) = delete;

  /// The service that the port connects to. [non-rt]
  virtual ServiceBase& service() noexcept = 0;
  /// The size of a value. [rt]
  virtual std::size_t bytes() const MAUVE_RT = 0;
  /// Of a read port: the next read finds this; the reads after that find it again, as old. [rt]
  virtual void put(const std::byte* /*value*/, DataStatus /*status*/, time_ns_t /*time_ns*/) MAUVE_RT {}
  /// Of a write port: the last value that was written since the last call; nullptr: none was. [rt]
  virtual const void* take_written() MAUVE_RT { return nullptr; }
};

template <typename T>
class ReadCell final : public PortCell, public ReadService<T> {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  ReadCell() : ReadService<T>("read") {}
  ServiceBase& service() noexcept override { return *this; }
  std::size_t bytes() const noexcept override { return sizeof(T); }
  void put(const std::byte* value, DataStatus status, time_ns_t time_ns) noexcept override {
    if (status != DataStatus::none) std::memcpy(static_cast<void*>(&value_), value, sizeof(T));
    status_ = status;
    time_ns_ = time_ns;
  }
  DataStatus read(T& value, time_ns_t& time_ns, ReaderState& /*reader*/) noexcept override {
    if (status_ == DataStatus::none) return status_;
    value = value_;
    time_ns = time_ns_;
    return std::exchange(status_, DataStatus::old_data);
  }

 private:
  T value_{};
  DataStatus status_{DataStatus::none};
  time_ns_t time_ns_{0};
};

template <typename T>
class WriteCell final : public PortCell, public WriteService<T> {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  WriteCell() : WriteService<T>("write") {}
  ServiceBase& service() noexcept override { return *this; }
  std::size_t bytes() const noexcept override { return sizeof(T); }
  bool write(const T& value, time_ns_t /*time_ns*/) noexcept override {
    value_ = value;
    is_written_ = true;
    return true;
  }
  TryWrite try_write(const T& value, time_ns_t time_ns) noexcept override {
    write(value, time_ns);
    return TryWrite::done;
  }
  const void* take_written() noexcept override {
    return std::exchange(is_written_, false) ? &value_ : nullptr;
  }

 private:
  T value_{};
  bool is_written_{false};
};

}  // namespace mauve
