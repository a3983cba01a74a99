#include "isolate/time_limit.h"

#include <array>
#include <csignal>
#include <functional>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace assay {
namespace {

// A process of this machine's core `core` until it goes out of scope.
class Process {
 public:
  Process(int core, const std::function<void()>& what) : id_(::fork()) {
    if (id_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    cpu_set_t only;
    CPU_ZERO(&only);
    CPU_SET(core, &only);
    ::sched_setaffinity(0, sizeof only, &only);
    what();
    ::_exit(0);
  }
  ~Process() {
    ::kill(id_, SIGKILL);
    ::waitpid(id_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t id() const { return id_; }

 private:
  pid_t id_;
};

[[noreturn]] void compute() {
  volatile bool endless = true;
  while (endless) {
  }
  ::_exit(0);
}

[[noreturn]] void hang() {
  while (true) ::pause();
}

int some_core() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  ::sched_getaffinity(0, sizeof allowed, &allowed);
  int core = 0;
  while (!CPU_ISSET(core, &allowed)) ++core;
  return core;
}

void sleep_until(TimeLimit::Clock::time_point moment) { std::this_thread::sleep_until(moment); }

TEST(TimeLimit, WaitingForAProcessorDoesNotCount) {
  const int core = some_core();
  const Process slowed(core, compute), other(core, compute), third(core, compute);
  constexpr double kSeconds = 1;
  TimeLimit limit(kSeconds, slowed.id());
  sleep_until(limit.end());
  // It has had a third of its core, or less.
  EXPECT_GT(processor_wait_s(slowed.id()), 0.2 * kSeconds);
  EXPECT_FALSE(limit.over());
}

TEST(TimeLimit, AChildsWaitingDoesNotCount) {
  const int core = some_core();
  const Process parent(core,
                       [] {
                         if (::fork() == 0) {
                           ::prctl(PR_SET_PDEATHSIG, SIGKILL);
                           compute();
                         }
                         hang();
                       }),
      other(core, compute), third(core, compute);
  TimeLimit limit(1, parent.id());
  sleep_until(limit.end());
  EXPECT_FALSE(limit.over());
}

TEST(TimeLimit, WhatHangsEndsAtItsLimit) {
  const Process hanging(some_core(), hang);
  TimeLimit limit(0.3, hanging.id());
  EXPECT_FALSE(limit.over());
  sleep_until(limit.end() + std::chrono::duration_cast<TimeLimit::Clock::duration>(std::chrono::milliseconds(300)));
  EXPECT_TRUE(limit.over());
}

// However crowded the machine is, and whatever a process does to wait for processors.
TEST(TimeLimit, EndsAtTenTimesTheLimit) {
  const int core = some_core();
  const Process slowed(core, compute), other(core, compute), third(core, compute);
  const auto begin = TimeLimit::Clock::now();
  TimeLimit limit(0.01, slowed.id());
  sleep_until(begin + std::chrono::milliseconds(100));
  EXPECT_TRUE(limit.over());
  EXPECT_LE(limit.end(), begin + std::chrono::milliseconds(101));
}

TEST(TimeLimit, WithoutAProcessItIsPlainTime) {
  EXPECT_EQ(processor_wait_s(-1), 0);
  TimeLimit limit(0);
  EXPECT_TRUE(limit.over());
  EXPECT_FALSE(TimeLimit(1e300).over());
}

}  // namespace
}  // namespace assay
