// Preloaded, it steps CLOCK_REALTIME for one process: by the nanoseconds, an int64, in the file that STEPPED_CLOCK names.
// Waits with a deadline of that clock end when the stepped clock reaches it, as the kernel's do. Every other clock is as it was.
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum { SECOND = 1000000000, SLICE = 20000000 };  // ns; a wait notices a step after a slice

static const volatile int64_t* step;

__attribute__((constructor)) static void map_step(void) {
  const char* path = getenv("STEPPED_CLOCK");
  const int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
  void* mapped = file < 0 ? MAP_FAILED : mmap(NULL, sizeof(int64_t), PROT_READ, MAP_SHARED, file, 0);
  if (mapped != MAP_FAILED) step = mapped;
  if (file >= 0) close(file);
}

static int64_t read_clock(clockid_t clock) {
  struct timespec now;
  syscall(SYS_clock_gettime, clock, &now);
  return now.tv_sec * (int64_t)SECOND + now.tv_nsec;
}

static int64_t stepped_now(void) { return read_clock(CLOCK_REALTIME) + (step ? *step : 0); }

static struct timespec as_timespec(int64_t time_ns) {
  return (struct timespec){.tv_sec = time_ns / SECOND, .tv_nsec = time_ns % SECOND};
}

int clock_gettime(clockid_t clock, struct timespec* now) {
  if (clock != CLOCK_REALTIME) return (int)syscall(SYS_clock_gettime, clock, now);
  *now = as_timespec(stepped_now());
  return 0;
}

int gettimeofday(struct timeval* restrict now, void* restrict zone) {
  (void)zone;
  const int64_t now_ns = stepped_now();
  *now = (struct timeval){.tv_sec = now_ns / SECOND, .tv_usec = now_ns % SECOND / 1000};
  return 0;
}

time_t time(time_t* now) {
  const time_t seconds = stepped_now() / SECOND;
  if (now) *now = seconds;
  return seconds;
}

// The end of the next slice of a wait, CLOCK_MONOTONIC.
static struct timespec slice_end(const struct timespec* deadline) {
  int64_t left = deadline->tv_sec * (int64_t)SECOND + deadline->tv_nsec - stepped_now();
  left = left < 0 ? 0 : left > SLICE ? SLICE : left;
  return as_timespec(read_clock(CLOCK_MONOTONIC) + left);
}

static int is_over(const struct timespec* deadline) {
  return stepped_now() >= deadline->tv_sec * (int64_t)SECOND + deadline->tv_nsec;
}

int pthread_cond_timedwait(pthread_cond_t* restrict condition, pthread_mutex_t* restrict mutex,
                           const struct timespec* restrict deadline) {
  int result;
  do {
    const struct timespec end = slice_end(deadline);
    result = pthread_cond_clockwait(condition, mutex, CLOCK_MONOTONIC, &end);
  } while (result == ETIMEDOUT && !is_over(deadline));
  return result;
}

int pthread_mutex_timedlock(pthread_mutex_t* restrict mutex, const struct timespec* restrict deadline) {
  int result;
  do {
    const struct timespec end = slice_end(deadline);
    result = pthread_mutex_clocklock(mutex, CLOCK_MONOTONIC, &end);
  } while (result == ETIMEDOUT && !is_over(deadline));
  return result;
}

int sem_timedwait(sem_t* restrict semaphore, const struct timespec* restrict deadline) {
  int result;
  do {
    const struct timespec end = slice_end(deadline);
    result = sem_clockwait(semaphore, CLOCK_MONOTONIC, &end);
  } while (result != 0 && errno == ETIMEDOUT && !is_over(deadline));
  return result;
}
