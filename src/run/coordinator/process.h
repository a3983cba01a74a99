// A worker process as its parent sees it: messages over a socket, its printed output, its end.
#pragma once

#include <optional>
#include <string>
#include <sys/types.h>

#include "isolate/child.h"
#include "isolate/limits.h"
#include "isolate/time_limit.h"
#include "run/messages/messages.h"

namespace assay {

// The process ends with its parent (PR_SET_PDEATHSIG), however that ends, and with this object; so do all processes
// that its engine has started (isolate/guard.h). To end them even when somebody else has ended the guard, the
// process that has made such an object inherits what its descendants leave (PR_SET_CHILD_SUBREAPER), for good.
class WorkerProcess {
 public:
  // Starts `program worker`. Throws SystemError when the process or the program cannot be started.
  explicit WorkerProcess(const std::string& program, const WorkerLimits& limits = {});
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  // A worker that is gone is noticed when its reply is awaited.
  void send(const Request& message) const;

  // Descriptors to poll for reading; -1 when closed. The third one tells of the guard's end.
  int socket() const { return socket_; }
  int output() const { return output_; }
  int status() const { return status_; }

  // Takes in what there is to read, without waiting.
  void read_available();

  // The next whole reply, if one has come. A line that is no reply, lacks this worker's secret or is longer than
  // kMostReplyBytes is a JobCrash: an engine has written to the socket, or the worker's memory is damaged.
  std::optional<Reply> take_reply();

  // A limit of what the worker does from now on.
  TimeLimit limit(double seconds) const { return TimeLimit(seconds, guard_); }

  // Waits for a reply for that limit at most, or until the worker is gone, or `interrupt` (a descriptor, -1 for none)
  // becomes readable. Empty in the latter cases.
  std::optional<Reply> wait_reply(double seconds, int interrupt = -1);

  // True when the worker has closed its socket or its guard has ended: no message will come any more.
  bool gone() const { return socket_ < 0; }

  // Ends it (SIGKILL when it still runs) and says how it ended: "signal 11 (Segmentation fault)", "exit status 3", with
  // the last line that it printed. Throws SystemError for one that ended by itself before it had taken its job: that is
  // the machine's fault, not an engine's.
  std::string end();

  // After end(): the worker was ended by a signal that an engine's fault does not send and we did not either, as the
  // kernel's out-of-memory killer or a scheduler does.
  bool ended_from_outside() const { return outside_; }

  static constexpr std::size_t kMostReplyBytes = std::size_t{64} << 20;

 private:
  void send_line(const std::string& line) const;
  std::string finish();
  void read_socket();
  void read_output();
  std::string last_line() const;

  pid_t guard_ = -1;
  int socket_ = -1, output_ = -1, status_ = -1;
  std::string secret_;   // begins each of the worker's replies
  std::string scratch_;  // its folder for temporary files
  std::string received_;
  bool taken_ = false;     // its job
  bool too_long_ = false;  // a reply
  bool outside_ = false;
  std::string printed_;  // the tail of it
};

}  // namespace assay
