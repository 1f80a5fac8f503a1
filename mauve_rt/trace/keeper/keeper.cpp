// SPDX-License-Identifier: LGPL-3.0-or-later
// bag_keeper SOCKET MEMORY: writes the files of a recording for another process, which may be killed at any instant.
//
// Linux gives up a write between two pages when its process is killed, and a file that is written over its end is torn then.
// This process gets whole writes and carries them out whole; it ends when the other one has ended. SOCKET is the file
// descriptor of a Unix socket (SOCK_SEQPACKET), MEMORY that of the memory in which the other process puts what is to be
// written. mauve_rt/trace/bag/disk.py is the other side, and has signals blocked here: what ends a group of processes must not
// end this one inside of a write.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace {

/// One write: the first `length` bytes of the memory, to the file that comes with it. The answer is an int32_t: 0 or errno.
struct Order {
  std::uint64_t offset;
  std::uint64_t length;
  std::uint64_t size;  // the file's, afterwards; kKeepSize: whatever the write makes it
};
constexpr std::uint64_t kKeepSize = UINT64_MAX;
constexpr std::size_t kKeptBytes = std::size_t{8} << 20U;  // of the memory, between two writes

bool read_number(const char* text, int& number) {
  const char* const end = text + std::strlen(text);
  return std::from_chars(text, end, number).ptr == end && text != end;
}

/// The next order, and its file; false: the other process has ended.
bool receive(int socket, Order& order, int& file) {
  iovec data{.iov_base = &order, .iov_len = sizeof(order)};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
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
  std::memcpy(&file, CMSG_DATA(rights), sizeof(file));
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

std::int32_t carry_out(const Order& order, int file, const char* data) {
  if (data == nullptr && order.length != 0) return ENOMEM;
  for (std::uint64_t done = 0; done < order.length;) {
    const ssize_t written =
        pwrite(file, data + done, order.length - done, static_cast<off_t>(order.offset + done));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    done += static_cast<std::uint64_t>(written);
  }
  if (order.size != kKeepSize && ftruncate(file, static_cast<off_t>(order.size)) != 0) return errno;
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  int socket = -1;
  int memory_descriptor = -1;
  if (count != 3 || !read_number(arguments[1], socket) || !read_number(arguments[2], memory_descriptor))
    return EXIT_FAILURE;
  keep_only(socket, memory_descriptor);
  Memory memory(memory_descriptor);
  Order order{};
  int file = -1;
  while (receive(socket, order, file)) {
    const std::int32_t outcome = carry_out(order, file, memory.of(order.length));
    close(file);
    memory.release(order.length);
    static_cast<void>(send(socket, &outcome, sizeof(outcome), MSG_NOSIGNAL));
  }
  return EXIT_SUCCESS;
}
