// SPDX-License-Identifier: LGPL-3.0-or-later
// without_membarrier PROGRAM [ARGUMENT...]: runs a program in a sandbox that refuses membarrier(2), as those of some containers do.
#include <linux/filter.h>
#include <linux/membarrier.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace {

constexpr int kSkipped = 77;

bool refuse_membarrier() {
  std::array<sock_filter, 4> filter{{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_membarrier, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  }};
  const sock_fprog program{.len = filter.size(), .filter = filter.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::fputs("usage: without_membarrier PROGRAM [ARGUMENT...]\n", stderr);
    return EXIT_FAILURE;
  }
  if (!refuse_membarrier()) {
    std::perror("without_membarrier: this system makes no sandbox");
    return kSkipped;
  }
  if (syscall(SYS_membarrier, MEMBARRIER_CMD_QUERY, 0, 0) != -1) {
    std::fputs("without_membarrier: the sandbox does not refuse it\n", stderr);
    return EXIT_FAILURE;
  }
  execv(arguments[1], &arguments[1]);
  std::perror("without_membarrier: cannot execute the program");
  return EXIT_FAILURE;
}
