// SPDX-License-Identifier: LGPL-3.0-or-later
// bag_keeper SOCKET MEMORY: writes the files of a recording for another process, which may be killed at any instant.
//
// Linux gives up a write between two pages when its process is killed, and a file that is written over its end is torn then.
// This process gets whole writes and carries them out whole; it ends when the other one has ended. SOCKET is the file
// descriptor of a Unix socket (SOCK_SEQPACKET), MEMORY that of the memory in which the other process puts what is to be
// written. A write and the metadata.yaml that belongs to it are one order: a kill between two orders finds both, or none.
// What is written is on the disk (fdatasync) a second later at most. mauve_rt/trace/bag/disk.py is the other side, and has signals blocked here: what ends a group of processes must not
// end this one inside of a write.
#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <climits>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace {

using Clock = std::chrono::steady_clock;

/// One write: the first `length` bytes of the memory, to the first file that comes with it. Then the next `metadata_length`
/// bytes replace metadata.yaml in the second file, a folder.
struct Order {
  std::uint64_t offset;
  std::uint64_t length;
  std::uint64_t size;  // the file's, afterwards; kKeepSize: whatever the write makes it
  std::uint64_t metadata_length;
  std::uint64_t flags;  // kSync, kInPlace
};
constexpr std::uint64_t kSync = 1;     // all that was written is on the disk before the answer
constexpr std::uint64_t kInPlace = 2;  // write over the present metadata.yaml: it takes no room on the disk

struct Answer {
  std::int32_t error;        // errno; 0: done
  std::int32_t is_metadata;  // 1: the file is written, metadata.yaml is not
};
constexpr std::chrono::seconds kSyncPeriod{1};
constexpr const char* kMetadata = "metadata.yaml";
constexpr const char* kNewMetadata = ".metadata.yaml.new";
constexpr std::uint64_t kKeepSize = UINT64_MAX;
constexpr std::size_t kKeptBytes = std::size_t{8} << 20U;  // of the memory, between two writes

bool read_number(const char* text, int& number) {
  const char* const end = text + std::strlen(text);
  return std::from_chars(text, end, number).ptr == end && text != end;
}

/// Closes a file descriptor at its end.
class File {
 public:
  explicit File(int descriptor = -1) : descriptor_(descriptor) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  File(File&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  ~File() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  [[nodiscard]] int get() const { return descriptor_; }
  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }

 private:
  int descriptor_;
};

struct Files {
  File file;
  File folder;
};

/// The next order, and its files; false: the other process has ended.
bool receive(int socket, Order& order, Files& files) {
  iovec data{.iov_base = &order, .iov_len = sizeof(order)};
  std::array<int, 2> descriptors{-1, -1};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(descriptors))> control{};
  msghdr message{};
  message.msg_iov = &data;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t received = 0;
  do {
    received = recvmsg(socket, &message, MSG_CMSG_CLOEXEC);
  } while (received < 0 && errno == EINTR);
  const cmsghdr* const rights = CMSG_FIRSTHDR(&message);
  if (received != sizeof(order) || rights == nullptr || rights->cmsg_type != SCM_RIGHTS) return false;
  std::memcpy(descriptors.data(), CMSG_DATA(rights),
              std::min(sizeof(descriptors), static_cast<std::size_t>(rights->cmsg_len - CMSG_LEN(0))));
  files = {.file = File(descriptors[0]), .folder = File(descriptors[1])};
  return true;
}

/// Closes what the other process had inherited itself, and leaves its folder: nobody is to wait for this process by mistake.
void keep_only(int one, int other) {
  const auto close_between = [](int after, int before) {
    if (after + 1 < before)
      close_range(static_cast<unsigned>(after + 1), static_cast<unsigned>(before - 1), 0);
  };
  close_between(STDERR_FILENO, std::min(one, other));
  close_between(std::max({STDERR_FILENO, std::min(one, other)}), std::max(one, other));
  close_between(std::max({STDERR_FILENO, one, other}), INT_MAX);
  static_cast<void>(chdir("/"));
}

/// The memory where this process sees it. It grows, and never shrinks.
class Memory {
 public:
  explicit Memory(int descriptor) : descriptor_(descriptor) {}
  /// nullptr: the system refuses.
  const char* of(std::size_t length) {
    if (length > length_) {
      if (length_ != 0) munmap(data_, length_);
      data_ = mmap(nullptr, length, PROT_READ, MAP_SHARED, descriptor_, 0);
      length_ = data_ == MAP_FAILED ? 0 : length;
    }
    return length_ == 0 ? nullptr : static_cast<const char*>(data_);
  }
  /// Gives back what an exceptionally large write took.
  void release(std::size_t length) const {
    if (length <= kKeptBytes) return;
    static_cast<void>(
        fallocate(descriptor_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(length)));
  }

 private:
  int descriptor_;
  void* data_{nullptr};
  std::size_t length_{0};
};

/// 0 or errno, as the functions below.
std::int32_t write_all(int file, const char* data, std::uint64_t length, std::uint64_t offset) {
  for (std::uint64_t done = 0; done < length;) {
    const ssize_t written = pwrite(file, data + done, length - done, static_cast<off_t>(offset + done));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    done += static_cast<std::uint64_t>(written);
  }
  return 0;
}

std::int32_t write_file(const Order& order, int file, const char* data) {
  if (const std::int32_t error = write_all(file, data, order.length, order.offset); error != 0) return error;
  return order.size != kKeepSize && ftruncate(file, static_cast<off_t>(order.size)) != 0 ? errno : 0;
}

std::int32_t write_metadata(const Order& order, int folder, const char* data) {
  const bool is_in_place = (order.flags & kInPlace) != 0;
  const bool is_synced = (order.flags & kSync) != 0;
  const int how = O_WRONLY | O_CLOEXEC | (is_in_place ? 0 : O_CREAT | O_TRUNC);
  const File file(openat(folder, is_in_place ? kMetadata : kNewMetadata, how, 0644));
  if (!file.is_open()) return errno;
  std::int32_t error = write_all(file.get(), data, order.metadata_length, 0);
  if (error == 0 && is_in_place && ftruncate(file.get(), static_cast<off_t>(order.metadata_length)) != 0)
    error = errno;
  if (error == 0 && is_synced && fdatasync(file.get()) != 0) error = errno;
  if (is_in_place) return error;
  if (error == 0 && renameat(folder, kNewMetadata, folder, kMetadata) != 0) error = errno;
  if (error != 0) unlinkat(folder, kNewMetadata, 0);
  return error;
}

/// Writes, and has what was written on the disk in time.
class Writer {
 public:
  /// How long until sync() is due, in ms, rounded up; -1: nothing is to be synced.
  [[nodiscard]] int due_ms() const {
    if (!unsynced_.is_open()) return -1;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(synced_at_ + kSyncPeriod - Clock::now());
    return static_cast<int>(std::max<std::int64_t>(left.count(), 0));
  }

  Answer carry_out(Order order, Files files, const char* data) {
    if (data == nullptr && order.length + order.metadata_length != 0)
      return {.error = ENOMEM, .is_metadata = 0};
    if (const std::int32_t error = write_file(order, files.file.get(), data); error != 0)
      return {.error = error, .is_metadata = 0};
    if (!unsynced_.is_open()) synced_at_ = Clock::now();
    unsynced_ = std::move(files.file);
    if (files.folder.is_open()) folder_ = std::move(files.folder);
    if (due_ms() == 0) order.flags |= kSync;
    const bool is_synced = (order.flags & kSync) != 0;
    if (const std::int32_t error = is_synced ? sync() : 0; error != 0)
      return {.error = error, .is_metadata = 0};
    if (order.metadata_length != 0) {
      if (const std::int32_t error = write_metadata(order, folder_.get(), data + order.length); error != 0)
        return {.error = error, .is_metadata = 1};
    }
    if (is_synced && folder_.is_open()) {
      const File folder = std::exchange(folder_, File());
      if (fsync(folder.get()) != 0) return {.error = errno, .is_metadata = 1};
    }
    return {.error = std::exchange(error_, 0), .is_metadata = 0};
  }

  /// Without an order, as soon as due; an error is that of the next order.
  void sync_late() {
    error_ = sync();
    const File folder = std::exchange(folder_, File());
    if (error_ != 0 || !folder.is_open()) return;
    const File metadata(openat(folder.get(), kMetadata, O_RDONLY | O_CLOEXEC));
    if (metadata.is_open() && fdatasync(metadata.get()) != 0) error_ = errno;
    if (fsync(folder.get()) != 0) error_ = errno;
  }

 private:
  std::int32_t sync() {
    const File file = std::exchange(unsynced_, File());
    return file.is_open() && fdatasync(file.get()) != 0 && errno != EINVAL ? errno : 0;  // EINVAL: no disk
  }

  File unsynced_;  // the file that was written to since synced_at_
  File folder_;    // where its metadata.yaml is
  Clock::time_point synced_at_;
  std::int32_t error_{0};
};

/// Whether there is an order, or the other process has ended.
bool wait(int socket, int timeout_ms) {
  pollfd waited{.fd = socket, .events = POLLIN, .revents = 0};
  int ready = 0;
  do {
    ready = poll(&waited, 1, timeout_ms);
  } while (ready < 0 && errno == EINTR);
  return ready != 0;
}

}  // namespace

int main(int count, char** arguments) {
  int socket = -1;
  int memory_descriptor = -1;
  if (count != 3 || !read_number(arguments[1], socket) || !read_number(arguments[2], memory_descriptor))
    return EXIT_FAILURE;
  keep_only(socket, memory_descriptor);
  Memory memory(memory_descriptor);
  Writer writer;
  while (true) {
    if (!wait(socket, writer.due_ms())) {
      writer.sync_late();
      continue;
    }
    Order order{};
    Files files;
    if (!receive(socket, order, files)) break;
    const std::uint64_t length = order.length + order.metadata_length;
    const Answer answer = writer.carry_out(order, std::move(files), memory.of(length));
    memory.release(length);
    static_cast<void>(send(socket, &answer, sizeof(answer), MSG_NOSIGNAL));
  }
  writer.sync_late();
  return EXIT_SUCCESS;
}
