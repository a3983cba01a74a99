// Jobs in worker processes, several at a time.
#pragma once

#include <functional>
#include <optional>
#include <queue>
#include <string>
#include <vector>

#include "run/coordinator/process.h"
#include "run/messages/messages.h"

namespace assay {

// From construction to destruction SIGINT, SIGTERM, SIGHUP and SIGALRM do not end the process: they are noted here. One
// inside another goes on with what that has noted, but for SIGALRM, which ends one budget: no signal is lost between
// them.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  int descriptor() const;  // readable after one came
  int signal() const;      // which; 0 for none
};

// Share of the machine's time that its host took for others, between two readings of /proc/stat, in whole ticks. 0
// where the host does not report it.
struct CpuTimes {
  double total = 0, steal = 0;
  static CpuTimes now(int core = -1);  // of one core; -1: of all
};
double steal_share(const CpuTimes& from, const CpuTimes& to);

// How a job ended. `answer` is empty when the worker crashed or was stopped: then `failure` says why.
struct JobEnd {
  std::optional<JobDone> answer;
  Ending failure;
  bool outside = false;  // somebody else ended the workers: the failure says nothing of the contender
  double wall_s = 0, steal = 0;
  double started = 0, finished = 0;  // seconds since 1970

  // What was found for `measure`; without an answer for it, the reason why.
  CellResult result(const std::string& measure) const;
};

struct Job {
  Request request;
  std::string title;
  double limit_s = 600;  // between two replies, without what the worker waits for a processor (isolate/time_limit.h)
  double cost = 0;       // the dearest is started first
  int lost = 0;          // workers of this job that somebody else ended
  std::function<void(const TestResult&)> on_test = {};
  std::function<void(const JobEnd&)> on_end = {};  // may add jobs
};

// A job whose worker is ended by somebody else (the out-of-memory killer, a scheduler) is started again, unless it has
// reported tests: then its owner goes on from there.
class Pool {
 public:
  Pool(std::string program, int workers, const Interrupts& interrupts);

  static constexpr int kMostTries = 3;  // of one job

  void add(Job job);

  // Until no job is left, or an interrupt: then the running ones are stopped and dropped. `on_start` gets titles.
  // Throws SystemError and InputError that a worker reports; running workers end then.
  void run(const std::function<void(const std::string&)>& on_start);

 private:
  struct Dearer {
    bool operator()(const Job& a, const Job& b) const { return a.cost < b.cost; }
  };

  std::string program_;
  size_t workers_;
  WorkerLimits limits_;
  const Interrupts& interrupts_;
  std::priority_queue<Job, std::vector<Job>, Dearer> waiting_;
};

// Throws the InputError or SystemError that a worker reports, if this is one.
void throw_worker_error(const Reply& reply);

// Seconds since 1970 by the clock as this process found it: one that is set while a campaign runs puts no end before
// its beginning.
double unix_time();

}  // namespace assay
