// A worker process as its parent sees it: messages over a socket, its printed output, its end.
#pragma once

#include <optional>
#include <string>
#include <sys/types.h>

#include "messages/messages.h"

namespace assay {

// The process ends with its parent (PR_SET_PDEATHSIG), however that ends, and with this object.
class WorkerProcess {
 public:
  // Starts `program worker`. Throws SystemError when the process or the program cannot be started.
  explicit WorkerProcess(const std::string& program);
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  // A worker that is gone is noticed when its reply is awaited.
  void send(const Request& message) const;

  // Descriptors to poll for reading; -1 when closed.
  int socket() const { return socket_; }
  int output() const { return output_; }

  // Takes in what there is to read, without waiting.
  void read_available();

  // The next whole reply, if one has come. A line that is no reply is a JobCrash: an engine has written to the socket,
  // or the worker's memory is damaged.
  std::optional<Reply> take_reply();

  // Waits for a reply at most `seconds`, or until the worker is gone, or `interrupt` (a descriptor, -1 for none)
  // becomes readable. Empty in the latter cases.
  std::optional<Reply> wait_reply(double seconds, int interrupt = -1);

  // True when the worker has closed its socket: no message will come any more.
  bool gone() const { return socket_ < 0; }

  // Ends it (SIGKILL when it still runs) and says how it ended: "signal 11 (Segmentation fault)", "exit status 3", with
  // the last line that it printed.
  std::string end();

  pid_t pid() const { return pid_; }

 private:
  void read_socket();
  void read_output();
  std::string last_line() const;

  pid_t pid_ = -1;
  int socket_ = -1, output_ = -1;
  std::string received_;
  std::string printed_;  // the tail of it
};

}  // namespace assay
